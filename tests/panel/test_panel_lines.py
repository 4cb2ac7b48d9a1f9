# SPDX-License-Identifier: GPL-2.0-or-later
"""Lines that are typed in the page of `chipwise panel`: as `chipwise enter` makes them, planned one at a time, run only
as they were planned."""

import json
import random
import threading
from dataclasses import replace

import pytest

from chipwise import entry
from chipwise.errors import CycleError
from chipwise.entry import mdi
from chipwise.panel import entry as lines, entry_process
from chipwise.panel import server
from support import ROOT
from support.panel_client import request
from support.panel_rig import TOKEN, asking, post, serving
from support.random_cases import random_count, random_seed

MILL = str(ROOT / "configs/mill.ini")
HOLE = "30,20,8,-3,1,,,,,600"


class Mdi:
    """As entry/mdi.py, of a machine that the test sets by hand."""

    State, check, same = mdi.State, staticmethod(mdi.check), staticmethod(mdi.same)

    def __init__(self):
        self.state = mdi.State(tool=1, position=(0.0, 0.0, 5.0))
        self.sent, self.orders = [], 0

    def read(self):
        return self.state

    def send(self, line):
        self.sent.append(line)

    def ask(self, order):
        self.orders += 1
        return asking(self)(order)


@pytest.fixture
def machine():
    return Mdi()


@pytest.fixture
def made(machine, forked_readers):
    return lines.Lines(MILL, machine.ask)


@pytest.fixture
def rig(made):
    with serving(TOKEN, lines=made) as found:
        yield found


# ---- a line and its plan -----------------------------------------------------------------------------------------


def test_the_codes_of_this_machine(made):
    found = {one["code"]: one for one in made.codes(("en",))}
    assert list(found) == [
        code for code in entry.codes("") if code not in ("G22", "G23", "G26", "G27")
    ]  # those are a lathe's
    assert [field["letter"] for field in found["G79"]["fields"]] == [field.letter for field in entry.fields("G79", "")]
    assert found["G79"]["fields"][1] == {
        "letter": "Z",
        "name": "final depth",
        "units": ["mm", "in"],
        "required": True,
        "default": "",
        "choices": [],
    }
    german = {one["code"]: one for one in made.codes(("de",))}
    assert german["G79"]["fields"][1]["name"] == "Endtiefe" and german["G24"]["fields"][4]["choices"][2][0] == 2


def test_a_line_is_that_of_the_terminal(made):
    """Random lines of every code: the same G-code, or the same message at the same field."""
    rng = random.Random(random_seed())
    for _ in range(random_count(300)):
        code = rng.choice(entry.codes(""))
        text = ",".join(
            rng.choice(["", "1", "-8", "2.5", "0", " 3", "41", "1,5", "x", "1;2", "100"])
            for _ in range(rng.randrange(0, 13))
        )
        found = made.line(code, text)
        try:
            assert found == {"line": entry.line(code, text, "")}, (code, text)
        except CycleError as error:
            assert found == {"error": str(error).removeprefix("chipwise: "), "number": error.number}, (code, text)


def test_a_plan(made, machine):
    found = made.plan("G13", HOLE, "dark", ("de",))
    assert (
        found["line"] == "G13 X30 Y20 I8 Z-3 R1 F600"
        and found["refused"] == ""
        and found["plan"] == 1
        and "state" not in found
    )
    assert (
        found["svg"].startswith("<svg ") and "Werkzeug" in found["svg"] and found["figures"][0].startswith("Schnitte: ")
    )
    assert made.plan("M251", "6,1", "light", ("en",))["svg"] == "" and machine.sent == []


@pytest.mark.parametrize(
    "code, text, number, words",
    [
        ("G13", "30,20", 3, "field 3, I (radius): nothing is given"),
        ("G13", "30,20,2,-3", 3, "radius I2 mm is not larger than the tool radius 3 mm"),
        ("G79", "100,-3", 0, "there is no sub O100"),
        ("G99", "", 0, "'G99' is not a code that can be entered"),
        ("G26", "1,,,,5", 0, "has no REMAP for G26"),
        ("../..", "1", 0, "is not a code"),
    ],
)
def test_what_cannot_be_planned(made, machine, code, text, number, words):
    found = made.plan(code, text, "light", ("en",))
    assert set(found) == {"error", "number"} and words in found["error"] and found["number"] == number, found
    with pytest.raises(CycleError, match="not the one that was planned last"):
        made.run(1)
    assert machine.sent == []


def test_a_chop_size(made, machine):
    """It is part of the line, in the plan and in the run; a line without has that of the INI file again."""
    assert made.line("G13", HOLE, " 5.50 ") == {"line": "#<_chipwise_chop_size>=5.5 G13 X30 Y20 I8 Z-3 R1 F600"}
    assert made.line("G79", "100,-3", "5") == {"line": "G79 Q100 Z-3"} and made.line("G13", HOLE, "") == {
        "line": "G13 X30 Y20 I8 Z-3 R1 F600"
    }
    plain, chopped = (made.plan("G13", HOLE, "light", ("en",), chop) for chop in ("", "6"))
    assert any(text.startswith("chop lines: ") for text in chopped["figures"]) and not any(
        text.startswith("chop lines: ") for text in plain["figures"]
    )
    assert (
        made.run(made.plan("G13", HOLE, "light", ("en",))["plan"])
        == made.run(made.plan("G13", HOLE, "light", ("en",), "6")["plan"])
        == {}
    )
    assert (
        made.run(made.plan("G13", HOLE, "light", ("en",))["plan"]) == {}
        and made.run(made.plan("M252", "", "light", ("en",))["plan"]) == {}
    )
    line = plain["line"]
    assert machine.sent == [line, "#<_chipwise_chop_size>=6 " + line, "#<_chipwise_chop_size>=0 " + line, "M252"]
    found = {one["code"]: one["chop"] for one in made.codes(("en",))}
    assert found["G13"] == found["G78"] == ["0", "0"] and found["G79"] is None


@pytest.mark.parametrize(
    "chop, words",
    [
        ("1,5", "chop size: 1,5 is not a number; use digits and a point"),
        ("-1", "chop size: -1 is not 0 or more; give a number 0 or more"),
        ("nan", "is not a number"),
        ("5]G0Z-9[", "is not a number"),
        ("1e3", "is not a number"),
        ("1" * 10, "more than 9 digits"),
        ("5\nG0 Z-9", "is not a number"),
    ],
)
def test_what_is_no_chop_size(made, machine, chop, words):
    for found in (made.line("G13", HOLE, chop), made.plan("G13", HOLE, "light", ("en",), chop)):
        assert words in found["error"] and found["number"] == 0 and "line" not in found
    assert machine.orders == 0


# ---- running it ---------------------------------------------------------------------------------------------------


def test_it_runs_once(made, machine):
    number = made.plan("G13", HOLE, "light", ())["plan"]
    assert made.run(number) == {} and machine.sent == ["G13 X30 Y20 I8 Z-3 R1 F600"]
    for again in (number, number + 1, 0, -1):
        with pytest.raises(CycleError, match="not the one that was planned last"):
            made.run(again)
    assert len(machine.sent) == 1


@pytest.mark.parametrize(
    "change, words",
    [
        ({"estop": True}, "the machine is in E-stop"),
        ({"on": False}, "the machine is off"),
        ({"homed": False}, "not homed"),
        ({"idle": False}, "a program or a command is under way"),
        ({"at_rest": False}, "the machine moves"),
        ({"incremental": True}, "G91 is active"),
        ({"tool": 0}, "no tool is in the spindle"),
        ({"unit": "in"}, "it is in mm and LinuxCNC in in"),
        ({"tool": 2}, "have changed since"),
        ({"position": (0.0, 0.01, 5.0)}, "have changed since"),
        ({"program": "/home/me/other.ngc"}, "have changed since"),
    ],
)
def test_a_machine_that_has_changed(made, machine, change, words):
    number = made.plan("G13", HOLE, "light", ())["plan"]
    machine.state = replace(machine.state, **change)
    found = made.run(number)
    assert words in found["error"] and machine.sent == []
    if "changed" not in words and "unit" not in change and "tool" not in change:
        assert words in made.plan("G13", HOLE, "light", ())["refused"]


def test_an_old_plan(made, machine, monkeypatch):
    number = made.plan("G13", HOLE, "light", ())["plan"]
    then = lines.time.monotonic()
    monkeypatch.setattr(lines.time, "monotonic", lambda: then + lines.VALID_S + 1)
    with pytest.raises(CycleError, match="more than 10 min ago"):
        made.run(number)
    assert machine.sent == []


def blocking(what, begun, going):
    """An `ask` that takes long for one kind of order."""

    def ask(order):
        if order["do"] == what:
            begun.set()
            going.wait(300)
        return {"error": "x", "number": 0} if order["do"] == "plan" else {}

    return ask


@pytest.mark.parametrize(
    "long, refused, served",
    [("plan", ["plan"], ["run", "guard", "tool"]), ("guard", ["run", "guard", "tool"], ["plan"])],
)
def test_one_at_a_time(long, refused, served):
    """A plan that takes long keeps nobody from a run, a guard or a tool; and the other way round."""
    begun, going = threading.Event(), threading.Event()
    made = lines.Lines(MILL, blocking(long, begun, going))
    work = {
        "plan": lambda: made.plan("M252", "", "light", ()),
        "run": lambda: made.run(1),
        "guard": lambda: made.guard("rapid", True),
        "tool": lambda: made.tool(1, {}, ""),
    }
    first = threading.Thread(target=work[long])
    first.start()
    assert begun.wait(300)
    for name in refused:
        with pytest.raises(CycleError, match="another line (or resume )?is being"):
            work[name]()
    for name in served:
        if name == "run":
            with pytest.raises(CycleError, match="not the one that was planned last"):
                work[name]()
        else:
            assert work[name]() in ({}, {"error": "x", "number": 0})
    going.set()
    first.join(300)
    assert work[long]() in ({}, {"error": "x", "number": 0})


def test_a_plan_without_the_token_displaces_none_with_it(made, machine):
    first = made.plan("G13", HOLE, "light", (), by_token=True)
    for _ in range(3):
        other = made.plan("M252", "", "light", ())
    made.run(first["plan"])
    made.run(other["plan"])
    assert machine.sent == [first["line"], other["line"]]


# ---- guards --------------------------------------------------------------------------------------------------------


@pytest.fixture
def switched(monkeypatch):
    """What was set in HAL."""
    found = []
    monkeypatch.setattr(entry_process, "halcmd", lambda *words: found.append(words))
    return found


def test_guards(rig, switched):
    for name, on, value in (("rapid", False, "0"), ("flute", False, "0"), ("rapid", True, "1")):
        assert post(rig, "/guard", {"guard": name, "on": on})[0] == 200
        assert switched[-1] == ("setp", f"chipwise-guard.0.guard-{name}", value)
    assert len(switched) == 3


@pytest.mark.parametrize("change", [{"idle": False}, {"at_rest": False}])
def test_no_guard_is_switched_in_a_cut(rig, machine, switched, change):
    machine.state = replace(machine.state, **change)
    status, _headers, words = post(rig, "/guard", {"guard": "rapid", "on": False})
    assert (
        status == 409 and b"the guard is not switched: a program or a command is under way" in words and switched == []
    )


@pytest.fixture
def parts(monkeypatch):
    """Words of halcmd; the monitor has begun a part by the third look."""
    said = []

    def halcmd(*words):
        said.append(words)
        return "1\n" if sum(word[0] == "getp" for word in said) > 3 else "0\n"

    monkeypatch.setattr(entry_process, "halcmd", halcmd)
    return said


def test_a_new_part(rig, machine, parts):
    """The pin is TRUE until the monitor has counted, and FALSE again."""
    assert post(rig, "/part", {})[0] == 200
    assert [words for words in parts if words[0] == "setp"] == [
        ("setp", "chipwise-monitor.new-part", "1"),
        ("setp", "chipwise-monitor.new-part", "0"),
    ]
    parts.clear()
    machine.state = replace(machine.state, idle=False)
    status, _headers, words = post(rig, "/part", {})
    assert status == 409 and b"no new part: a program or a command is under way" in words and parts == []


def test_a_monitor_that_begins_no_part(rig, machine, monkeypatch):
    said = []
    monkeypatch.setattr(entry_process, "PART_S", 0.0)
    monkeypatch.setattr(entry_process, "halcmd", lambda *words: said.append(words) or "7\n")
    status, _headers, words = post(rig, "/part", {})
    assert (
        status == 409
        and b"has not begun a new part" in words
        and said[-1] == ("setp", "chipwise-monitor.new-part", "0")
    )


@pytest.mark.parametrize("how", [{"token": None}, {"token": "wrong-token"}, {"origin": None}])
def test_no_new_part_without_token_and_origin(rig, parts, how, monkeypatch):
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    assert post(rig, "/part", {}, **how)[0] == 403 and parts == []


@pytest.mark.parametrize(
    "body",
    [
        {},
        {"guard": "rapid"},
        {"guard": "rapid", "on": 0},
        {"guard": "rapid", "on": "false"},
        {"guard": "x", "on": True},
        {"guard": "rapid 1\nsetp x", "on": True},
        {"guard": None, "on": True},
        {"guard": ["rapid"], "on": True},
    ],
)
def test_guards_of_strangers(rig, switched, body):
    assert post(rig, "/guard", body)[0] == 400 and switched == []


@pytest.mark.parametrize(
    "how", [{"token": None}, {"token": "wrong-token"}, {"origin": None}, {"origin": "http://evil.example"}]
)
def test_no_guard_is_switched_without_token_and_origin(rig, switched, how, monkeypatch):
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    assert post(rig, "/guard", {"guard": "rapid", "on": False}, **how)[0] == 403 and switched == []


# ---- the process ----------------------------------------------------------------------------------------------------


def test_the_process():
    found = lines.process({"do": "plan", "ini": MILL, "code": "G13", "text": "1,2", "mode": "light", "language": "en"})
    assert found == {"error": "G13: field 3, I (radius): nothing is given; give the radius", "number": 3}


def test_a_process_that_fails():
    with pytest.raises(CycleError, match=r"sing has failed \(KeyError: 'sing'\); plan it in a terminal"):
        lines.process({"do": "sing"})


def test_a_process_that_does_not_end(monkeypatch):
    monkeypatch.setattr(lines, "PLAN_S", 0.0)
    with pytest.raises(CycleError, match="the plan took more than 0 s, and was ended"):
        lines.process({"do": "sing"})


# ---- requests --------------------------------------------------------------------------------------------------------


def test_requests(rig, machine):
    assert json.loads(request(rig.url, "/line.json?code=G79&text=100%2C-8%2C%2C5")[2]) == {"line": "G79 Q100 Z-8 R5"}
    assert json.loads(request(rig.url, "/codes.json?de")[2])[0]["title"] == "Kreisloch im Uhrzeigersinn"
    planned = json.loads(post(rig, "/plan", {"code": "G13", "text": HOLE}, token=None)[2])
    assert planned["line"] == "G13 X30 Y20 I8 Z-3 R1 F600"
    assert post(rig, "/run", {"plan": planned["plan"]})[0] == 200 and machine.sent == [planned["line"]]
    status, _headers, words = post(rig, "/run", {"plan": planned["plan"]})
    assert status == 409 and b"not the one that was planned last" in words and len(machine.sent) == 1


@pytest.mark.parametrize(
    "how",
    [{"token": None}, {"token": "wrong-token"}, {"token": ""}, {"origin": None}, {"origin": "http://evil.example"}],
)
def test_nothing_runs_without_token_and_origin(rig, machine, how, monkeypatch):
    monkeypatch.setattr(server, "WRONG_TOKEN_S", 0.01)
    number = json.loads(post(rig, "/plan", {"code": "G13", "text": HOLE})[2])["plan"]
    assert post(rig, "/run", {"plan": number}, **how)[0] == 403 and machine.sent == []


@pytest.mark.parametrize("origin", [None, "http://evil.example", "null"])
def test_nothing_is_planned_for_others(rig, machine, origin):
    assert post(rig, "/plan", {"code": "G13", "text": HOLE}, origin=origin)[0] == 403 and machine.orders == 0


@pytest.mark.parametrize(
    "path, body, status",
    [
        ("/plan", {"code": 5}, 400),
        ("/plan", {"text": ["1"]}, 400),
        ("/plan", {"mode": None}, 400),
        ("/plan", {}, 200),
        ("/run", {}, 400),
        ("/run", {"plan": True}, 400),
        ("/run", {"plan": "1"}, 400),
        ("/run", {"plan": 1.0}, 400),
        ("/run", {"plan": 10**30}, 409),
        ("/plan", {"code": "G13", "text": "1" * 3000}, 200),
        ("/plan", {"code": "G13", "text": "1" * 5000}, 413),
        ("/plan", {"code": "G13", "text": "30,20,8,-3\nG0 X100"}, 200),
        ("/plan", {"code": "G13\nG0 X100", "text": ""}, 200),
    ],
)
def test_bodies_of_strangers(rig, machine, path, body, status):
    found, _headers, words = post(rig, path, body)
    assert found == status and machine.sent == [] and machine.orders == 0
    if status == 200:
        assert "error" in json.loads(words)


@pytest.mark.parametrize("query", ["", "code=G13", "a=1&b=2&c=3&d=4", "code=%00&text=%ff", "text=" + "," * 3000])
def test_queries_of_strangers(rig, query):
    status, _headers, words = request(rig.url, "/line.json?" + query)
    assert status == 400 or status == 200 and "error" in json.loads(words)


def test_a_server_without_a_machine():
    with serving(TOKEN) as rig:
        status, _headers, words = request(rig.url, "/codes.json")
        assert status == 409 and b"start LinuxCNC again" in words
