# SPDX-License-Identifier: GPL-2.0-or-later
"""Changes of the tool geometry file: it keeps everything else, is never wrong afterwards, and is changed only as it was
seen."""

import os
import random
import re
import stat
import threading
import tomllib

import pytest

from chipwise.tool_data import editor
from chipwise.errors import CycleError
from chipwise.tool_data.geometry import KEYS, MATERIALS, OLD_RATE, SHAPES, load_tools, parse_tools
from support.random_cases import random_count, random_seed, write_replay
from support.tool_files import FILE, written


def change(path, number, values, seen=None):
    editor.change(str(path), seen or editor.checksum(path.read_bytes()), number, values)
    return path.read_bytes().decode()


@pytest.mark.parametrize(
    "number, values, old, new",
    [
        (1, {"flute_length": 21.5}, "flute_length = 20\n", "flute_length = 21.5\n"),
        (
            1,
            {"shape": "vee", "tip_angle": 90},
            'shape = "flat"    # new in May\nflute_length = 20\n',
            'shape = "vee"    # new in May\nflute_length = 20\ntip_angle = 90\n',
        ),
        (1, {"flute_length": None}, "flute_length = 20\n", ""),
        (1, {"flute_length": 20, "flutes": None, "shape": "flat"}, "", ""),
        (2, {"max_rate": 1_000, "shape": "ball"}, "", ""),
        (2, {"max_rate": 9.5, "flutes": 3}, "  max_rate = 1_000\t# steel\n", "  max_rate = 9.5\t# steel\nflutes = 3\n"),
        (10, {"flutes": 2, "stick_out": 0.25}, "[tool.10]\n", "[tool.10]\nflutes = 2\nstick_out = 0.25\n"),
        (
            7,
            {"shape": "bull", "corner_radius": 0.5, "flutes": None},
            "# the end\n",
            '# the end\n\n[tool.7]\nshape = "bull"\ncorner_radius = 0.5\n',
        ),
    ],
)
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_one_change(tmp_path, number, values, old, new, line_end):
    path = written(tmp_path, FILE.replace("\n", line_end))
    assert FILE.count(old) == 1 or not old
    assert (
        change(path, number, values) == FILE.replace(old, new).replace("\n", line_end)
        if old
        else FILE.replace("\n", line_end)
    )


OLD = "[tool.1]\nflutes = 3\nmax_removal_rate = 12_000  # mm3/min; steel\n\n# next\n[tool.2]\nmax_removal_rate = 500\n"


@pytest.mark.parametrize(
    "values, new",
    [
        ({"flutes": 4}, "flutes = 4\nmax_rate = 12  # cm3/min; steel\n"),
        ({}, "flutes = 3\nmax_rate = 12  # cm3/min; steel\n"),
        ({"max_rate": 12}, "flutes = 3\nmax_rate = 12  # cm3/min; steel\n"),
        ({"max_rate": 7.5}, "flutes = 3\nmax_rate = 7.5  # cm3/min; steel\n"),
        ({"max_rate": None}, "flutes = 3\n"),
    ],
)
def test_the_old_key_of_the_rate(tmp_path, values, new):
    """A tool that is changed has its rate in cm3/min, in the line of the old key; the other tools keep theirs."""
    path = written(tmp_path, OLD)
    assert editor.listed(str(path))["tools"] == {"1": {"flutes": 3, "max_rate": 12}, "2": {"max_rate": 0.5}}
    assert change(path, 1, values) == OLD.replace(OLD[9 : OLD.index("\n# next")], new)
    with pytest.raises(CycleError, match="max_removal_rate is not a key of a tool"):
        change(path, 1, {"max_removal_rate": 5})


@pytest.mark.parametrize(
    "rate, values, new",
    [
        (9, {}, "max_rate = 9 # a\n"),
        (90, {}, "max_rate = 12 # a\n"),
        (90, {"max_rate": 5}, "max_rate = 5 # a\n"),
        (90, {"max_rate": None}, ""),
        (90, {"max_rate": 90}, "max_rate = 90 # a\n"),
    ],
)
def test_both_keys_of_the_rate(tmp_path, rate, values, new):
    path = written(tmp_path, f"[tool.1]\nmax_removal_rate = 12000\nmax_rate = {rate} # a\nflutes = 3\n")
    assert editor.listed(str(path))["tools"]["1"]["max_rate"] == min(rate, 12)
    assert change(path, 1, values) == f"[tool.1]\n{new}flutes = 3\n"


@pytest.mark.parametrize(
    "text, new",
    [
        ("", "[tool.3]\nflutes = 2\n"),
        ("[tool.1]", "[tool.1]\n\n[tool.3]\nflutes = 2\n"),
        ("[tool]\n", "[tool]\n\n[tool.3]\nflutes = 2\n"),
        ("# only words", "# only words\n\n[tool.3]\nflutes = 2\n"),
        ("[tool.03]", "[tool.03]\nflutes = 2\n"),
        ("[tool.3]\r\nstick_out = 9", "[tool.3]\r\nstick_out = 9\r\nflutes = 2\r\n"),
        ("[tool.3]\nstick_out = 9\n\n# next\n[tool.4]", "[tool.3]\nstick_out = 9\nflutes = 2\n\n# next\n[tool.4]"),
    ],
)
def test_another_tool(tmp_path, text, new):
    assert change(written(tmp_path, text), 3, {"flutes": 2}) == new


@pytest.mark.parametrize(
    "text",
    [
        "tool.3.flutes = 2\n",
        "[tool]\n3.flutes = 2\n",
        "[tool]\n3 = {flutes = 2}\n",
        "tool = {3 = {flutes = 2}}\n",
        '[tool."3"]\nflutes = 2\n',
        '[tool.3]\n"flutes" = 2\n',
        "[tool.3]\nflutes = 0x2\nflutes2.x = 1\n",
        '["tool".3]\nflutes = 2\n',
        '[tool.3]\nshape = """flat"""\n"flutes" = 2\n',
        '[lathe.1]\nx = """\n[tool.3]\nflutes = 2\n"""\n[tool.3]\nflutes = 2\n',
        "[lathe.1]\nx = '''\n[tool.3]\n'''\n[tool.4]\n",
    ],
)
def test_other_forms_are_refused_or_right(tmp_path, text):
    """Whatever the form: the file means the same with the change, or it is as it was."""
    path = written(tmp_path, text)
    before = path.read_bytes()
    try:
        change(path, 3, {"flutes": 5})
    except CycleError as error:
        assert (
            "is written in a form that is not changed here; change it with an editor" in str(error)
            or "is not TOML" in str(error)
            or "is not a key" in str(error)
        )
        assert path.read_bytes() == before and os.listdir(tmp_path) == ["tools.toml"]
    else:
        assert tomllib.loads(path.read_text())["tool"]["3"]["flutes"] == 5


@pytest.mark.parametrize(
    "number, values, message",
    [
        (1, {"flutes": 0}, "tools.toml: tool 1: flutes = 0 is not a whole number from 1 to 100; correct the value"),
        (1, {"flutes": 2.5}, "flutes = 2.5 is not a whole number"),
        (1, {"flutes": True}, "flutes = True is not a whole number"),
        (1, {"shape": "bull"}, "shape bull needs corner_radius; add corner_radius = ..."),
        (1, {"shape": "cone"}, "shape = 'cone' is unknown; use one of flat, ball"),
        (1, {"shape": 'ball"\nflutes = 9 #'}, "is unknown; use one of"),
        (1, {"shape": "\ud800"}, "is not TOML"),
        (1, {"flute_length": "20\nflutes = 3"}, "is not a length above 0 mm"),
        (1, {"flute_length": float("nan")}, ""),
        (1, {"flute_length": float("inf")}, ""),
        (1, {"flute_length": 1e9}, "is not a length above 0 mm"),
        (1, {"colour": "red"}, "colour is not a key of a tool; use shape, corner_radius"),
        (1, {"shape\n[tool.9]": "flat"}, "is not a key of a tool"),
        (-1, {}, "-1 is not a tool number"),
        (10**9, {}, "is not a tool number; use a whole number of at most 9 digits"),
        (10**4000, {}, "is not a tool number"),
    ],
)
def test_wrong_values(tmp_path, number, values, message):
    path = written(tmp_path)
    with pytest.raises(CycleError) as caught:
        change(path, number, values)
    assert (
        message in str(caught.value) and path.read_bytes() == FILE.encode() and os.listdir(tmp_path) == ["tools.toml"]
    )


def test_a_file_that_somebody_has_changed(tmp_path):
    path = written(tmp_path)
    seen = editor.listed(str(path))["checksum"]
    path.write_text(FILE + "# mine\n")
    with pytest.raises(
        CycleError, match="tools.toml has changed since this page has read it; look at it, and change it again"
    ):
        change(path, 1, {"flutes": 3}, seen)
    assert path.read_text() == FILE + "# mine\n" and os.listdir(tmp_path) == ["tools.toml"]


def test_the_file_of_the_morning_is_kept(tmp_path):
    path = written(tmp_path)
    path.chmod(0o640)
    change(path, 1, {"flutes": 3})
    change(path, 1, {"flutes": 4})
    change(path, 1, {"flutes": 4})
    (kept,) = (name for name in os.listdir(tmp_path) if name != "tools.toml")
    assert re.fullmatch(r"tools\.toml\.\d{4}-\d\d-\d\d\.bak", kept) and (tmp_path / kept).read_text() == FILE
    assert stat.S_IMODE(path.stat().st_mode) == 0o640 and load_tools(str(path))[1].flutes == 4


def test_a_link_stays_one(tmp_path):
    (tmp_path / "own").mkdir()
    path, link = written(tmp_path / "own"), tmp_path / "tools.toml"
    link.symlink_to(path)
    change(link, 1, {"flutes": 3})
    assert link.is_symlink() and load_tools(str(path))[1].flutes == 3


@pytest.mark.parametrize(
    "content, words",
    [
        (b"\xff", "it is not UTF-8"),
        (b"[tool.1]\nflutes = 0\n", "flutes = 0 is not"),
        (b"x" * 300_000, "more than"),
        (b"[tool", "is not TOML"),
    ],
)
def test_a_file_that_is_wrong_already(tmp_path, content, words):
    path = tmp_path / "tools.toml"
    path.write_bytes(content)
    for work in (lambda: editor.listed(str(path)), lambda: change(path, 1, {"flutes": 3})):
        with pytest.raises(CycleError, match=words):
            work()
    assert path.read_bytes() == content


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everything")
def test_a_folder_that_cannot_be_written(tmp_path):
    path = written(tmp_path)
    tmp_path.chmod(0o500)
    with pytest.raises(CycleError, match="cannot be written"):
        change(path, 1, {"flutes": 3})
    tmp_path.chmod(0o700)


def test_a_full_disk(tmp_path, monkeypatch):
    def full(*_values):
        raise OSError(28, "No space left on device")

    path = written(tmp_path)
    monkeypatch.setattr(editor, "write_durable", full)
    with pytest.raises(
        CycleError, match="tools.toml cannot be written: No space left on device; correct the file, its folder"
    ):
        change(path, 1, {"flutes": 3})
    assert path.read_text() == FILE


def test_many_at_once(tmp_path):
    """Of those who have seen the same file one changes it."""
    path, done = written(tmp_path), []
    seen = editor.listed(str(path))["checksum"]

    def one(number):
        try:
            change(path, 1, {"flutes": number}, seen)
            done.append(number)
        except CycleError:
            pass

    threads = [threading.Thread(target=one, args=(number,)) for number in range(1, 9)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(done) == 1 and load_tools(str(path))[1].flutes == done[0]


RANGES = {"chip_load": (0.02, 9.0), "chip_least": (0.001, 0.02), "deflection": (0.001, 9.0)}  # mm


def value_of(key, rng):
    if key == "shape":
        return rng.choice(SHAPES)
    if key == "flutes":
        return rng.randint(1, 9)
    if key in RANGES:
        return round(rng.uniform(*RANGES[key]), 4)
    if key == "material":
        return rng.choice(MATERIALS)
    if key == "tip_angle":
        return rng.choice((60, 90.5, 118))
    return rng.choice((rng.randint(1, 90), round(rng.uniform(0.1, 50), rng.randint(1, 6))))


def random_file(rng):
    """TOML of some tools with comments and blanks wherever they may be."""
    lines = [f"# head {rng.random()}"] * rng.randint(0, 2)
    for number in rng.sample(range(30), rng.randint(0, 6)):
        lines += rng.choice(([], [""], ["", f"# of tool {number}"]))
        lines.append(rng.choice(("[tool.{}]", "[tool.0{}]", " [ tool.{} ]  # a [comment]")).format(number))
        for key in rng.sample((*KEYS, OLD_RATE), rng.randint(0, 6)):
            value = value_of(key, rng)
            text = (
                f'"{value}"'
                if key in ("shape", "material")
                else f"{value:_}"
                if isinstance(value, int) and rng.random() < 0.3
                else str(value)
            )
            lines.append(
                rng.choice(("", "", "  ", "\t"))
                + key
                + rng.choice((" = ", "=", "\t=  "))
                + text
                + rng.choice(("", "", "   # was 7 = 3", " "))
            )
            lines += rng.choice(([], [], ["  # flutes = 99"], [""]))
        if rng.random() < 0.2:
            lines += [f"[lathe.{number}]", "edge_length = 3 # x", "holder = [0,", " [1], 2]"]
    line_end = rng.choice(("\n", "\r\n"))
    return line_end.join(lines) + rng.choice(("", line_end))


def comments(text):
    return sorted(re.findall(r"#[^\r\n]*", text))


def fault_of(text, number, values):
    """What is wrong with a change, "" if nothing is; None if it was refused by the loader's rules."""
    try:
        parse_tools(text)
    except CycleError:
        return None
    document = tomllib.loads(text)
    name = next((one for one in document.get("tool", {}) if int(one) == number), str(number))
    wanted = document.setdefault("tool", {}).setdefault(name, {})
    both = OLD_RATE in wanted and "max_rate" in wanted
    if OLD_RATE in wanted:
        old_rate = float(f"{wanted.pop(OLD_RATE) / 1000:.12g}")
        wanted["max_rate"] = min(wanted.get("max_rate", old_rate), old_rate)
    gone = [key for key, value in values.items() if value is None and key in wanted]
    new = [key for key, value in values.items() if value is not None and key not in wanted]
    other = [key for key, value in values.items() if value is not None and wanted.get(key, value) != value]
    wanted.update(values)
    document["tool"][name] = {key: value for key, value in wanted.items() if value is not None}
    try:
        found = editor.changed(text, "tools.toml", number, dict(values))
    except CycleError as error:
        return f"{error}" if "in a form" in str(error) or "is not TOML" in str(error) else None
    if tomllib.loads(found) != document:
        return f"{tomllib.loads(found)}, expected {document}"
    old, lines_now = text.split("\n"), found.split("\n")
    if len([line for line in lines_now if line not in old]) > len(new) + len(other) + 4:
        return "other lines have changed"
    if not gone and not both and comments(found) != comments(text):
        return "comments have changed"
    if name not in tomllib.loads(text).get("tool", {}):
        return "" if found.startswith(text) else "the file does not begin as it was"
    rest = [
        [line for line in some if not re.match(rf"[ \t]*({'|'.join([*values, 'max_rate', OLD_RATE])})[ \t]*=", line)]
        for some in (old, lines_now)
    ]
    if "".join(rest[0]).strip() != "".join(rest[1]).strip():
        return "lines without these keys have changed"
    ends = {line[-1:] == "\r" for line in old[:-1]}
    return "line ends have changed" if len(old) > 2 and ends != {line[-1:] == "\r" for line in lines_now[:-1]} else ""


def run(count, seed):
    """(fault, how many changes were made) of so many random ones."""
    rng, made = random.Random(seed), 0
    for number in range(count):
        text, tool = random_file(rng), rng.randint(0, 30)
        values = {
            key: rng.choice((None, value_of(key, rng), value_of(key, rng)))
            for key in rng.sample(KEYS, rng.randint(1, 8))
        }
        fault = fault_of(text, tool, values)
        if fault:
            path = write_replay(
                "tool_editor", {"seed": seed, "number": number, "text": text, "tool": tool, "values": values}
            )
            return f"seed {seed}, change {number}, {path}: {fault}", made
        made += fault == ""
    return "", made


def test_random_changes():
    count = random_count(600)
    fault, made = run(count, random_seed())
    assert not fault, fault
    assert made > 0.15 * count


@pytest.mark.parametrize(
    "name, other",
    [
        ("_table", lambda lines, number, table=editor._table: (table(lines, number)[0], len(lines))),
        ("_KEY", re.compile(editor._KEY.pattern.replace("(?P<after>", "(?P<after>)(?:").replace("$", "") + ".*$")),
        ("_HEADER", re.compile(r"[ \t]*\[[ \t]*tool[ \t]*\.[ \t]*(\d)")),
        ("_ended", lambda lines, line_end: lines),
        ("_change_lines", lambda lines, first, end, values: first),
    ],
)
def test_the_checker_sees_a_fault(monkeypatch, name, other):
    monkeypatch.setattr(editor, name, other)
    assert run(600, 5)[0]
