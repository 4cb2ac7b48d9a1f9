# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise filter as a GUI calls it: `sh -c`, standard output in a file, standard error in a pipe, standard input
closed."""

import os
import re
import sys

import pytest

from chipwise.filter import verdict as verdicts, work
from support import ROOT
from support.filter_rig import BAD, BINARY, CLEAN, HEAD, HUGE, RAPID, UNKNOWN
from support.filter_runs import mill_ini, run, put
from support.rewrite_rig import check_status

sys.path.insert(0, os.path.join(ROOT, "tools"))

DEEP = HEAD.replace("G0 Z-4\n", "G0 Z-18\n") + "G1 X110 F400\nG0 Z5\nM2\n"  # flutes of 12 mm
LOOP = HEAD.replace("G0 Z-4\n", "G0 Z-18\n") + "o1 repeat [1]\nM66 E0 L0\nG1 X110 F400\no1 endrepeat\nG0 Z5\nM2\n"


@pytest.fixture(name="ini")
def make_ini(tmp_path):
    return mill_ini(tmp_path)


# ---- what goes through -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "data",
    [
        CLEAN.encode(),
        CLEAN.encode().rstrip(),
        CLEAN.replace("\n", "\r\n").encode(),
        CLEAN.replace("M2", "(\u00e4\u20ac) M2").encode(),
        CLEAN.encode().replace(b"M2", b"(Fr\xe4ser \xff\xfe) ; \x80\nM2"),
        b"%\n" + CLEAN.encode() + b"%\n",
        CLEAN.encode() + b"after the end \xff\n" * 2000,
    ],
)
def test_a_clean_program_goes_through_byte_for_byte(data, ini, tmp_path):
    done = run(ini.path, put(tmp_path, data), tmp_path)
    assert (done.status, done.said) == (0, "") and done.data == data


MARK = b"\xef\xbb\xbf"
LEFT_OUT = "its byte order mark is left out, which LinuxCNC refuses"


def test_a_byte_order_mark_is_left_out(ini, tmp_path):
    """LinuxCNC would refuse the program; what is rewritten has none either, and one with an error is not opened."""
    data = CLEAN.replace("\n", "\r\n").encode()
    done = run(ini.path, put(tmp_path, MARK + data), tmp_path)
    assert (done.status, done.data) == (0, data) and done.said.endswith(f"part.nc: {LEFT_OUT}")
    assert (tmp_path / "part.nc").read_bytes() == MARK + data
    done = run(ini.path, put(tmp_path, MARK + UNKNOWN.encode()), tmp_path)
    assert (
        (done.status, done.data) == (0, UNKNOWN.encode())
        and "it is opened unchecked" in done.said
        and LEFT_OUT in done.said
    )
    for wrong, words in (
        (BAD.encode(), "divide by zero; correct the line (line 7)"),
        (MARK + data, "byte order mark, which LinuxCNC refuses; save"),
        (b"", "it is empty"),
    ):
        done = run(ini.path, put(tmp_path, MARK + wrong), tmp_path)
        assert (done.status, done.data) == (2, b"") and words in done.said and LEFT_OUT not in done.said, done.said
    ini("FILTER_REWRITE = flute")
    done = run(ini.path, put(tmp_path, MARK + DEEP.encode()), tmp_path)
    assert (
        done.status == 0 and not done.data.startswith(MARK) and LEFT_OUT in done.said and len(done.data) > len(DEEP)
    ), done.said


def test_names_that_a_shell_or_a_message_could_break(ini, tmp_path):
    for name in ('it\'s $(here) a "part".nc', b"M\xfcller\n.nc"):
        path = os.path.join(os.fsencode(tmp_path), os.fsencode(name))
        with open(path, "wb") as file:
            file.write(BAD.encode())
        done = run(ini.path, os.fsdecode(path), tmp_path)
        assert done.status == 2 and done.said.count("\n") == 0 and "(line 7)" in done.said


REFUSED = {
    "syntax": (BAD, "Attempt to divide by zero; correct the line (line 7)"),
    "binary": (BINARY, "it is not a text file; name a G-code program"),
    "utf16": (CLEAN.encode("utf-16"), "it is not a text file"),
    "empty": (b"", "it is empty"),
    "no end": (CLEAN.replace("M2\n", ""), "end it with M2"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_cannot_be_used_is_not_opened(name, ini, tmp_path):
    content, words = REFUSED[name]
    path = put(tmp_path, content)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (2, b"")
    assert done.said.startswith(f"chipwise: {path}: it is not opened: ") and words in done.said, done.said


def test_what_is_no_program_at_all(ini, tmp_path):
    os.mkfifo(tmp_path / "fifo.nc")
    (tmp_path / "folder.nc").mkdir()
    huge = put(tmp_path, "G1 X1\n" * 1000, "huge.nc")
    os.truncate(huge, HUGE)
    for name, words in (
        ("fifo.nc", "not a regular file"),
        ("folder.nc", "not a regular file"),
        ("none.nc", "No such file"),
        ("huge.nc", "it has 200 MB, more than 100"),
    ):
        done = run(ini.path, tmp_path / name, tmp_path)
        assert (done.status, done.data) == (2, b"") and words in done.said and str(tmp_path / name) in done.said


def test_findings_are_said_and_the_setting_refuses_them(ini, tmp_path):
    path = put(tmp_path, RAPID)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, RAPID.encode())
    assert re.search(rf"{path}: line 7, tool 1: a traverse meets 4 mm of stock", done.said), done.said
    ini("FILTER_REFUSE = findings")
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (1, b"") and "line 7, tool 1: a traverse meets" in done.said


def test_unknown_flutes_are_said_and_are_no_reason_to_refuse(ini, tmp_path):
    (ini.path.parent / "tools.toml").write_text("")
    ini("FILTER_REFUSE = findings")
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and "the depth of tool 1 is not checked" in done.said
    done = run(ini.path, put(tmp_path, RAPID), tmp_path)
    assert done.status == 1 and re.search("part.nc: line 7, tool 1: a traverse.*\n.*the depth of tool 1", done.said), (
        done.said
    )


UNCHECKED = {
    "no stock": (UNKNOWN, "its depth is not known; add M250"),
    "G93": ("G21 G90\nG93\nG1 X1 F2\nG1 X2 F2\nM2\n", "no tool is in the spindle"),
    "probe": ("G21\nG38.2 Z-5 F50\nG0 Z5\nM2\n", "its depth is not known"),
    "loop with an end": ("G21 G90\no1 repeat [3]\nG1 X2 F200\no1 endrepeat\nM2\n", "no stock is defined"),
    "only settings": ("G21\n#1 = 5\nM2\n", "it has no moves"),
}


@pytest.mark.parametrize("name", UNCHECKED)
def test_a_program_that_cannot_be_judged_is_opened_as_it_is(name, ini, tmp_path):
    content, words = UNCHECKED[name]
    path = put(tmp_path, content)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, content.encode())
    assert f"{path}: it is opened unchecked: " in done.said and words in done.said and "--" not in done.said, done.said


def test_the_setting_refuses_what_cannot_be_judged(ini, tmp_path):
    ini("FILTER_REFUSE = unchecked")
    done = run(ini.path, put(tmp_path, UNKNOWN), tmp_path)
    assert (done.status, done.data) == (2, b"") and "no stock is defined" in done.said


def test_a_broken_setting_or_machine_opens_the_program_unchecked(ini, tmp_path):
    ini("FILTER_REFUSE = often")
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and "[CHIPWISE]FILTER_REFUSE = often is not" in done.said
    done = run(tmp_path / "none.ini", put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and "none.ini" in done.said


def test_no_advice_of_the_command_line_reaches_the_screen():
    """Every message of the check that names an option is one that for_screen() changes."""
    import message_source

    found = [
        text
        for message in message_source.messages()
        for text in [f"{message[0]}; {message[1]}"]
        if re.search("--stock|with --(?:tool|diameter)", text)
    ]
    assert len(found) >= 4
    for text in found:
        if not text.startswith("--"):
            assert "--" not in verdicts.for_screen(text), text


@pytest.mark.parametrize("tool, status", [(0, 2), (1, 0)])
def test_a_program_may_count_on_the_tool_in_the_spindle(tool, status, ini, tmp_path, monkeypatch):
    """G13 with the tool that an operator has loaded before."""
    monkeypatch.setenv("INI_FILE_NAME", str(ini.path))
    monkeypatch.setattr(work, "spindle_tool", lambda: tool)
    path = put(tmp_path, HEAD.replace("T1 M6\n", "") + "F400\nG13 X50 Y30 I20 Z-5 R1\nM2\n")
    verdict = work.judged(
        str(path), str(ini.path), {"cpu_s": 60, "quiet_s": 10}, str(tmp_path), False, lambda share: None
    )
    assert verdict.status == status and (status or not verdict.notes), verdict.notes


# ---- rewriting ---------------------------------------------------------------------------------------------------


def test_rewriting_for_the_flutes(ini, tmp_path):
    ini("FILTER_REWRITE = flute")
    path = put(tmp_path, DEEP)
    done = run(ini.path, path, tmp_path)
    assert (
        done.status == 0 and done.data != DEEP.encode() and f"{path}: it is rewritten: line 7 in 2 levels" in done.said
    ), done.said
    assert check_status(put(tmp_path, done.data, "new.ngc"), ini.path)[0] == 0
    assert "cuts 18 mm deep" not in done.said and "rewritten.ngc" not in done.said
    assert run(ini.path, put(tmp_path, CLEAN), tmp_path).data == CLEAN.encode()


def test_a_program_that_cannot_be_rewritten_is_opened_as_it_is_or_refused(ini, tmp_path):
    ini("FILTER_REWRITE = flute")
    path = put(tmp_path, LOOP)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, LOOP.encode())
    assert "M66 there cannot be written out" in done.said and "cuts 18 mm deep" in done.said, done.said
    ini("FILTER_REFUSE = findings")
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (1, b"") and "not rewritten" in done.said


def test_rewriting_for_a_removal_rate(ini, tmp_path):
    ini("FILTER_REWRITE = feed")
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (
        0,
        CLEAN.encode(),
    ) and "[CHIPWISE]FILTER_RATE is 0; give a removal rate" in done.said
    ini("FILTER_RATE = 4.8", "FILTER_CEILING = 1000")
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert done.status == 0 and "it is rewritten: F of 1 of 1 feed moves changed" in done.said
    feeds = [float(text) for text in re.findall(rb"F([\d.]+)", done.data.partition(b"G0 Z-4")[2])]
    assert max(feeds) <= 1000 and any(abs(feed - 200) < 4 for feed in feeds), feeds  # 4.8 cm3/min over 24 mm2


# ---- what each GUI can take --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "display, bar, heard",
    [("axis", "1", True), ("gmoccapy", "1", False), ("qtvcp qtdragon", None, True), ("/usr/bin/axis -x", "1", True)],
)
def test_standard_error_is_silent_where_a_line_of_it_breaks_the_gui(display, bar, heard, ini, tmp_path):
    ini.path.write_text(ini.path.read_text().replace("DISPLAY = axis", f"DISPLAY = {display}"))
    for text in (BAD, RAPID):
        done = run(ini.path, put(tmp_path, text), tmp_path, environment={"AXIS_PROGRESS_BAR": bar} if bar else None)
        assert bool(done.said) == heard and (heard or not done.progress)


# ---- what a program does not name ------------------------------------------------------------------------------------

ASSUMED = (
    "(T1 D=6. CR=0. - ZMIN=-2. - flat end mill)\nG21 G90\nG0 X0 Y0 Z5\nG1 Z-2 F100\nG1 X40 F300\nG0 Y10\n"
    "G1 Y20\nG0 Z5\nM2\n"
)


def test_a_program_without_stock_and_tool_is_judged_on_what_is_assumed(ini, tmp_path):
    done = run(ini.path, put(tmp_path, ASSUMED.encode()), tmp_path)
    assert (done.status, done.data) == (0, ASSUMED.encode())
    assert (
        "the stock is assumed from its path" in done.said
        and "from a comment" in done.said
        and "unchecked" not in done.said
    )
    assert "(on what is assumed)" in done.said and "--stock" not in done.said  # the traverse through the stock


def test_who_asks_for_certainty_gets_no_assumption(tmp_path):
    path = mill_ini(tmp_path)("FILTER_REFUSE = unchecked")
    done = run(path, put(tmp_path, ASSUMED.encode()), tmp_path)
    assert done.status == 2 and "it is judged on what is assumed only" in done.said
    (tmp_path / "other").mkdir()
    path = mill_ini(tmp_path / "other")("FILTER_REFUSE = findings")
    assert run(path, put(tmp_path, ASSUMED.encode()), tmp_path).status == 0
