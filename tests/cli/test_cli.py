# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise: usage, errors without tracebacks, the demo's comparison program."""

import argparse
import importlib
import os
import re
import shutil
import signal
import subprocess

import pytest

from chipwise import cli
from chipwise.cli import demo

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

VERSION = open(os.path.join(ROOT, "VERSION")).read().strip()


def chipwise(*arguments):
    return subprocess.run(
        [os.path.join(ROOT, "bin", "chipwise"), *arguments],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )


def test_usage():
    assert chipwise("--help").returncode == 0
    assert "demo" in chipwise("--help").stdout
    assert chipwise().returncode == 2
    assert chipwise("no-such-command").returncode == 2


def test_without_arguments_it_says_what_it_is_and_what_to_do():
    done = chipwise()
    for words in ("chipwise " + VERSION, "contour", "demo", "man chipwise", "linuxcnc " + ROOT + "/configs/mill.ini"):
        assert words in done.stdout, words
    assert done.stderr == "" and "monitor" not in done.stdout.replace(ROOT, "")  # not called by people


def test_the_version_has_one_source():
    assert re.fullmatch(r"[0-9]+\.[0-9]+\.[0-9]+", VERSION)
    done = chipwise("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"chipwise {VERSION}\n", "")


@pytest.mark.skipif(not shutil.which("groff"), reason="groff is not installed")
def test_the_man_page_has_every_command_and_option(tmp_path):
    """As man prints it, without a complaint of groff."""
    subprocess.run(
        ["/usr/bin/python3", os.path.join(ROOT, "tools", "make_man.py"), tmp_path / "chipwise.1"], check=True
    )
    done = subprocess.run(
        ["groff", "-man", "-Tutf8", "-ww", "-P-c", tmp_path / "chipwise.1"],
        text=True,
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    text = re.sub(r".\x08", "", done.stdout).replace("\u2010", "-").replace("\u2212", "-")
    assert "chipwise " + VERSION in text
    parser, _modules = cli.build_parser()
    for name, command in next(a.choices for a in parser._actions if a.choices).items():
        assert re.search(rf"^ +{name}$", text, re.MULTILINE), name
        for option in command._option_string_actions:
            assert option in ("-h", "--help") or option in text, (name, option)
    assert done.stderr == ""


@pytest.mark.skipif(not shutil.which("groff"), reason="groff is not installed")
@pytest.mark.parametrize(
    "name, module",
    [("chipwise-sandbox", "chipwise.machine.sandbox"), ("chipwise-headless", "chipwise.headless.display")],
)
def test_the_man_page_of_a_program_without_commands(tmp_path, name, module):
    subprocess.run(
        ["/usr/bin/python3", os.path.join(ROOT, "tools", "make_man.py"), tmp_path / (name + ".1")], check=True
    )
    done = subprocess.run(
        ["groff", "-man", "-Tutf8", "-ww", "-P-c", tmp_path / (name + ".1")],
        text=True,
        check=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    text = re.sub(r".\x08", "", done.stdout).replace("\u2010", "-").replace("\u2212", "-")
    parser = importlib.import_module(module).build_parser()
    for action in parser._actions:
        for option in action.option_strings if action.help != argparse.SUPPRESS else ():
            assert option in ("-h", "--help") or option in text, option
    assert name in text and done.stderr == ""


def test_the_completion_has_every_command_and_option(tmp_path):
    """As bash completes it."""
    script = os.path.join(ROOT, "tools", "make_completion.py")
    subprocess.run(["/usr/bin/python3", script, tmp_path / "chipwise"], check=True)

    def completed(*words):
        done = subprocess.run(
            [
                "bash",
                "-c",
                'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _chipwise; printf "%s\\n" "${COMPREPLY[@]}"',
                tmp_path / "chipwise",
                *words,
            ],
            text=True,
            check=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        return done.stdout.split()

    parser, _modules = cli.build_parser()
    commands = next(a.choices for a in parser._actions if a.choices)
    assert completed("chipwise", "") == [name for name in commands if name not in cli.INTERNAL] + [
        "--help",
        "--version",
    ]
    assert completed("chipwise", "che") == ["check"]
    for name in ("check", "contour", "demo", "try"):
        assert set(completed("chipwise", name, "--")) == {
            o for o in commands[name]._option_string_actions if o.startswith("--")
        }


@pytest.mark.parametrize("ini", [None, "/no/such.ini", ROOT, os.path.join(ROOT, "configs", "mill.ini")])
def test_load_in_a_shell_says_what_it_is_for(ini, tmp_path):
    """In a sandbox of its own: without it the HAL of this machine would be asked."""
    env = {name: value for name, value in os.environ.items() if name != "INI_FILE_NAME"}
    done = subprocess.run(
        [os.path.join(ROOT, "bin", "chipwise-sandbox"), "--", os.path.join(ROOT, "bin", "chipwise"), "load"],
        env={**env, **({"INI_FILE_NAME": ini} if ini else {})},
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert done.returncode == 1 and "Traceback" not in done.stderr
    line = next(line for line in done.stderr.splitlines() if line.startswith("chipwise: "))
    assert ("chipwise.hal" if ini is None or ini.endswith("mill.ini") else "INI file") in line, line


@pytest.mark.parametrize("command", ["monitor", "display"])
def test_what_linuxcnc_calls_ends_in_a_shell_without_linuxcnc(command):
    done = subprocess.run(
        [
            os.path.join(ROOT, "bin", "chipwise-sandbox"),
            "--timeout",
            "60",
            "--",
            os.path.join(ROOT, "bin", "chipwise"),
            command,
        ],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert (
        done.returncode == 1
        and "chipwise: there is no stock tracker in HAL" in done.stderr
        and "Traceback" not in done.stderr
    )


def test_errors_have_no_traceback():
    for status, arguments in (
        (2, ["demo", "/no/such/file.ngc"]),
        (2, ["demo", ROOT]),
        (1, ["demo", "--speed", "-1", __file__]),
    ):
        done = chipwise(*arguments)
        assert done.returncode == status
        assert done.stderr.startswith("chipwise: ")
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", sorted(cli.COMMANDS))
def test_a_wrong_option_is_answered_in_one_line(name):
    done = chipwise(name, "--no-such-option")
    assert done.returncode == 2 and done.stderr.startswith(f"chipwise: {name}: "), done.stderr
    assert done.stderr.endswith(f"; see chipwise {name} --help\n") and done.stderr.count("\n") == 1, done.stderr


FINDER = """import _signal, sys
class Finder:
    def find_spec(name, *_more):
        if name == "{module}":
            try:
                _signal.raise_signal(_signal.SIGINT)
            except BaseException:
                raise {raised}
sys.meta_path.insert(0, Finder)
"""


@pytest.mark.parametrize(
    "module, raised, status",
    [
        ("enum", "", -signal.SIGINT),  # of module signal
        ("chipwise.cli", "", -signal.SIGINT),
        ("chipwise.cli.check", "", 130),
        ("chipwise.cli.check", "ImportError('by an extension') from None", 130),
    ],
)
def test_ctrl_c_while_it_starts(tmp_path, module, raised, status):
    """Also where an extension module that is being imported makes an ImportError of it."""
    (tmp_path / "sitecustomize.py").write_text(FINDER.format(module=module, raised=raised))
    done = subprocess.run(
        [os.path.join(ROOT, "bin", "chipwise"), "check", "none.ngc"],
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # ignored below a background shell
    assert (done.returncode, done.stdout, done.stderr) == (status, "", "")


def test_constant_feed_program():
    text = (
        "G21\nM250\nm251 Q3.6 P2 E3000 (fast, F900)\nN10 G1 X1 F500\nM 251 Q1 ; again F7\nM252\nM2510\n"
        "G13 X1 I5 Z-1 E1200 F 80.5\nG12 I5 E9\n#<_ef>=3\n"
    )
    assert demo.constant_feed(text, 600) == (
        "G21\nM250\nM252 (fast, F900)\nN10 G1 X1 F600.000\nM252 ; again F7\nM252\nM2510\n"
        "G13 X1 I5 Z-1 E600.000 F 600.000\nG12 I5 E9.000\n#<_ef>=3\n"
    )


def test_a_path_that_is_not_utf8(tmp_path):
    """Named with a ? for what cannot be shown; the picture is drawn."""
    folder = os.path.join(os.fsencode(tmp_path), b"caf\xe9")
    os.mkdir(folder)
    program = os.path.join(folder, b"p\xff{d}.ngc")
    with open(program, "w") as file:
        file.write("o100 sub\nG0 X0 Y0\nG1 X9\nY9\nX0\nY0\no100 endsub\nM2\n")
    picture = str(tmp_path / "a.svg")
    done = subprocess.run(
        [
            os.path.join(ROOT, "bin", "chipwise").encode(),
            b"contour",
            program,
            b"--sub",
            b"100",
            b"--tool",
            b"3",
            b"-o",
            picture.encode(),
        ],
        stdin=subprocess.DEVNULL,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith(b"O100 in p?{d}.ngc, tool 3 mm left")
    with open(picture, encoding="utf-8") as file:
        assert "p?{d}.ngc" in file.read()


def test_an_error_nobody_thought_of_is_one_line(monkeypatch, capsys):
    from chipwise import cli
    from chipwise.cli import contour

    monkeypatch.setattr(contour, "run", lambda options: {}["a\nb"])
    monkeypatch.delenv("CHIPWISE_TRACEBACK", raising=False)
    monkeypatch.setattr("sys.stdout.reconfigure", lambda **_: None, raising=False)
    monkeypatch.setattr("sys.stderr.reconfigure", lambda **_: None, raising=False)
    assert cli.main(["contour", "x.ngc", "--sub", "1", "--tool", "3"]) == 1
    said = capsys.readouterr().err
    assert said.startswith("chipwise: internal error: KeyError: 'a") and said.count("\n") == 1


@pytest.mark.parametrize(
    "command",
    [
        ["check", "--stock", "0", "0", "-10", "50", "50", "0"],
        ["rewrite", "--flute", "--stock", "0", "0", "-10", "50", "50", "0", "-o", "out.ngc"],
    ],
)
def test_without_the_core_library(tmp_path, monkeypatch, command):
    """After an update without `make build`: the remedy, not an internal error."""
    (tmp_path / "program.ngc").write_text("G21 G90\nT1 M6\nF300\nG0 X10 Y10 Z5\nG1 Z-2\nG1 X30\nM2\n")
    monkeypatch.setenv("CHIPWISE_CORE", str(tmp_path / "none.so"))
    monkeypatch.chdir(tmp_path)
    done = chipwise(command[0], "program.ngc", *command[1:])
    said = done.stdout + done.stderr
    assert done.returncode and f"core library {tmp_path}/none.so is missing; run `make build`" in said, said
    assert "internal error" not in said and not (tmp_path / "out.ngc").exists()


SLOTS = f"{ROOT}/nc_files/slots.ngc"
STATIONS = f"{ROOT}/configs/robot_stations.toml"


def redirected(line, **environment):
    """(exit status, standard error) of a shell line; Python buffers what it prints, as it does for a user."""
    env = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"} | environment
    done = subprocess.run(
        ["sh", "-c", line.replace("chipwise ", f"{ROOT}/bin/chipwise ")],
        env=env,
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    "command",
    ["--help", "", f"try {SLOTS}", f"check {SLOTS}", f"stations --file {STATIONS}", "enter list"],
    ids=lambda command: command.split(" ")[0].strip("-") or "nothing",
)
def test_output_on_a_full_disk_is_not_done(command):
    status, said = redirected(f"chipwise {command} > /dev/full")
    assert (
        status == 1
        and said.splitlines()[-1]
        == "chipwise: the output cannot be written: No space left on device; it is not complete"
    ), said


@pytest.mark.parametrize("command", [f"try {SLOTS}", f"check {SLOTS}", "--help"])
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", "<&- >&- 2>&-"])
def test_closed_handles(command, closed):
    status, said = redirected(f"chipwise {command} {closed}")
    assert status == 0 and "error" not in said, said


def test_errors_do_not_go_to_the_output_if_their_handle_is_closed():
    done = subprocess.run(
        ["sh", "-c", f"{ROOT}/bin/chipwise contour none.ngc --sub 1 --tool 3 2>&-"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
    )
    assert (done.returncode, done.stdout) == (2, b"")


@pytest.mark.parametrize(
    "command",
    [
        "contour {0} --sub 1 --tool 3",
        "check {1} --ini {0}",
        "try {1} --ini {0}",
        "rewrite {1} --ini {0} --flute -o out.ngc",
    ],
)
def test_a_fifo_is_not_waited_for(tmp_path, command):
    os.mkfifo(tmp_path / "fifo")
    words = command.format(tmp_path / "fifo", SLOTS).split()
    done = subprocess.run(
        [os.path.join(ROOT, "bin", "chipwise"), *words],
        cwd=tmp_path,
        text=True,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
    )
    assert done.returncode == 2 and ("not a regular file" in done.stderr or "does not exist" in done.stderr), (
        done.stderr
    )


def test_a_word_too_many_names_the_command():
    for words, said in (
        (["setup", "a.ngc", "b.ngc"], "chipwise: setup: b.ngc is not understood; see chipwise setup --help\n"),
        (["check", "--cells", "1", SLOTS], "chipwise: check: --cells is not understood; see chipwise check --help\n"),
    ):
        done = chipwise(*words)
        assert (done.returncode, done.stdout) == (2, "") and done.stderr == said, done.stderr
