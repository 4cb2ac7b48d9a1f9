# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise enter: lines of standard input, a terminal, wrong options."""

import os
import pty
import select
import subprocess
import time

import pytest
from support import ROOT

COMMAND = str(ROOT / "bin" / "chipwise")
PATIENCE_S = 300.0  # for an answer of the terminal, on a busy machine


def environment(**more):
    return {
        **{key: value for key, value in os.environ.items() if key not in ("LANG", "LANGUAGE", "LC_ALL", "LC_MESSAGES")},
        "INI_FILE_NAME": "",
        "TERM": "dumb",
        **more,
    }


def enter(*arguments, text="", **more):
    data = text if isinstance(text, bytes) else text.encode()
    done = subprocess.run(
        [COMMAND, "enter", *map(str, arguments)],
        input=data,
        capture_output=True,
        env=environment(**more),
        timeout=PATIENCE_S,
    )
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def test_lines_of_standard_input():
    assert enter("g79", text="100,-8,,5\n100, -8\n") == (0, "G79 Q100 Z-8 R5\nG79 Q100 Z-8\n", "")
    assert enter("M252", text="\n") == (0, "M252\n", "") and enter("M252") == (0, "", "")


def test_run_without_data_is_no_success():
    """Standard input that is closed, or has nothing: the exit status and a sentence say that nothing is run."""
    said = "chipwise: enter: nothing is run, because standard input is closed or empty; give the data there\n"
    assert enter("M252", "--run") == (1, "", said)
    done = subprocess.run(
        ["sh", "-c", 'exec "$0" enter M252 --run <&-', COMMAND],
        capture_output=True,
        env=environment(),
        timeout=PATIENCE_S,
    )
    assert (done.returncode, done.stdout.decode(), done.stderr.decode()) == (1, "", said)


def test_a_line_that_is_wrong_does_not_stop_the_others():
    status, out, err = enter("G79", text=b"100,x\n100,-8\n\xff\xfe,1\n" + b"1" * 30_000)
    lines = err.splitlines()
    assert status == 1 and out == "G79 Q100 Z-8\n" and "Traceback" not in err
    assert (
        lines[0]
        == "chipwise: enter: line 1: G79: field 2, Z (final depth): x is not a number; use digits and a point, as 12.5 "
        "or -8"
    )
    assert lines[1].startswith("chipwise: enter: line 3: G79: field 1, Q (sub of the pocket): ")
    assert lines[2].endswith("the line has more than 1000 characters; type the data of one code")


def test_list():
    status, out, err = enter("list")
    assert (
        (status, err) == (0, "")
        and "G79   clear a pocket: Q,Z,D,R,P,L,I,K,J,E,F,H\n" in out
        and "M252  volumetric feed off\n" in out
    )
    assert "G79   Tasche räumen: Q,Z," in enter("list", LANG="de_DE.UTF-8")[1]


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["G99"], "'G99' is not a code that can be entered; use one of G12, "),
        ([], "the following arguments are required: CODE"),
        (["G79", "--unit", "cm"], "--unit: invalid choice: 'cm'"),
        (["G79", "--ini", "/nowhere.ini"], "INI file /nowhere.ini: No such file"),
    ],
)
def test_wrong_input(arguments, words):
    status, out, err = enter(*arguments)
    assert status == 2 and out == "" and words in err and err.count("\n") == 1


def test_the_table_of_a_machine(tmp_path):
    ini = tmp_path / "a.ini"
    ini.write_text("[TRAJ]\nLINEAR_UNITS = inch\n[CHIPWISE]\nENTRY = mine.toml\n")
    (tmp_path / "mine.toml").write_text('[G79]\norder = ["Z", "Q"]\n')
    assert enter("G79", "--ini", ini, text="-8,100\n")[:2] == (0, "G79 Z-8 Q100\n")
    (tmp_path / "mine.toml").write_text('[G79]\norder = ["Z"]\n')
    status, out, err = enter("G79", INI_FILE_NAME=str(ini), text="-8,100\n")
    assert (status, out) == (
        2,
        "",
    ) and "mine.toml: G79: order lacks Q (sub of the pocket), which is always needed; add Q" in err


class Terminal:
    """chipwise enter in a terminal of its own."""

    def __init__(self, *arguments, stdout_too=True, **more):
        self.handle, other = pty.openpty()
        self.child = subprocess.Popen(
            [COMMAND, "enter", *arguments],
            stdin=other,
            stderr=other,
            env=environment(**more),
            stdout=other if stdout_too else subprocess.PIPE,
        )
        os.close(other)
        self.seen = ""

    def wait_for(self, text):
        """What was shown up to a text, which is taken."""
        end = time.monotonic() + PATIENCE_S
        while text not in self.seen:
            assert select.select([self.handle], [], [], max(0.0, end - time.monotonic()))[0], (
                f"{text!r} is not in {self.seen!r}"
            )
            try:
                self.seen += os.read(self.handle, 65536).decode()
            except OSError:  # the other side has closed
                assert text in self.seen, self.seen
        before, _, self.seen = self.seen.partition(text)
        return before

    def type(self, text):
        os.write(self.handle, text.encode())

    def end(self):
        status = self.child.wait(PATIENCE_S)
        os.close(self.handle)
        return status


def test_a_terminal():
    shown = Terminal("G79", "--unit", "in", LANG="de_DE.UTF-8")
    assert "Endtiefe, in" in shown.wait_for("H> ")
    shown.type("100,x\n")
    shown.wait_for("field 2, Z (final depth): x is not a number")
    shown.wait_for("H> ")
    shown.wait_for("100,x")  # the line again, to be corrected
    shown.type("\b-8,2.5\n")
    shown.wait_for("G79 Q100 Z-8 D2.5")
    assert shown.end() == 0


def test_a_terminal_asks_again_and_ends():
    shown = Terminal("M253")
    shown.wait_for("P> ")
    shown.type("?\n")
    shown.wait_for("save the stock")
    shown.wait_for("P> ")
    shown.type("\x04")
    assert shown.end() == 1


def test_a_terminal_whose_output_is_kept():
    """line=$(chipwise enter M253): the names and questions go to the terminal, the line to the output."""
    shown = Terminal("M253", stdout_too=False)
    shown.wait_for("P> ")
    shown.type("3\n")
    assert shown.child.stdout.read() == b"M253 P3\n" and shown.end() == 0
    shown.child.stdout.close()


# ---- what the line does ------------------------------------------------------------------------------------------

POCKET = ROOT / "nc_files" / "pocket.ngc"


def test_a_drawing(tmp_path):
    status, out, err = enter(
        "G79", "--program", POCKET, "-o", tmp_path / "a.svg", "--dark", text="179,-8,,1\n", LANG="de_DE.UTF-8"
    )
    full, cuts = err.splitlines()
    assert (status, out) == (0, "G79 Q179 Z-8 R1\n")
    assert full.startswith("chipwise: G79: the tool cuts its full width over ")  # as in the controller
    assert cuts.startswith("Werkzeug 3; Schnitte: ") and "down" not in cuts
    text = (tmp_path / "a.svg").read_text()
    assert "Endtiefe: -8 mm" in text and "Tasche räumen" in text and "#14181e" in text


def test_a_line_that_the_code_refuses_names_the_field(tmp_path):
    status, out, err = enter("G79", "--program", POCKET, "-o", tmp_path / "a.png", text="179,-8,30\n")
    assert (status, out) == (1, "") and not (tmp_path / "a.png").exists()
    assert (
        err
        == "chipwise: enter: line 1: G79: step-over D30 mm is larger than the tool (10 mm); use D up to 10 mm (field "
        "3, D)\n"
    )


def test_what_a_program_has_set(tmp_path):
    arguments = ["G13", "-o", tmp_path / "a.svg", "--tool", "2", "--at", "1", "1", "3", "--unit", "mm"]
    assert "chop lines" in enter(*arguments, "--set", "_chipwise_chop_size=12", text="36,58,22,-6.5,1\n")[2]
    assert "chop lines" not in enter(*arguments, text="36,58,22,-6.5,1\n")[2]


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["G79", "-o", "/nowhere/a.svg"], "there is no folder /nowhere"),
        (["G79", "-o", "a.bmp"], ".bmp is not a known kind of picture"),
        (["M253", "-o", "a.svg"], "M253 has nothing to draw; leave -o out"),
        (["G79", "-o", "a.svg", "--at", "0", "nan", "0"], "--at is not a position"),
        (["G79", "-o", "a.svg", "--tool", "-1"], "--tool -1 is not the number of a tool"),
        (["G79", "-o", "a.svg", "--set", "x"], "--set x is not a parameter and its value"),
    ],
)
def test_wrong_options_of_a_drawing(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = enter(*arguments, text="179,-8\n")
    assert status == 2 and out == "" and words in err and err.count("\n") == 1 and not list(tmp_path.iterdir())


def test_nothing_of_the_users_is_overwritten(tmp_path):
    program = tmp_path / "part.svg"
    program.write_text(POCKET.read_text())
    status, _, err = enter("G79", "--program", program, "-o", program, text="179,-8\n")
    assert (
        status == 2 and "is the program itself; name another file" in err and program.read_text() == POCKET.read_text()
    )


def test_one_line_is_drawn(tmp_path):
    status, out, err = enter("M250", "-o", tmp_path / "a.svg", text="0,0,-5,10,10,5\n0,0,-5,20,20,5\n")
    assert status == 2 and out == "M250 P0 Q0 R-5 I10 J10 K5\n" and "-o and --run are for one line" in err
    assert "10 mm x 10 mm x 5 mm" in (tmp_path / "a.svg").read_text()


def test_run_without_linuxcnc_and_with_a_position():
    status, out, err = enter("M253", "--run", "--at", "0", "0", "5", text="1\n")
    assert (status, out) == (
        2,
        "",
    ) and "--run takes program, tool and position from LinuxCNC; leave --program, --tool and --at out" in err
