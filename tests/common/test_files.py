# SPDX-License-Identifier: GPL-2.0-or-later
"""remap/chipwise/host/files.py, and what reads with it, tried on FIFOs, devices, folders, endless and odd files."""

import faulthandler
import os
import random
import socket
import sys

import pytest
from support.random_cases import random_count, random_seed

from chipwise import settings
from chipwise.tool_data import geometry
from chipwise.errors import CycleError
from chipwise.host.files import printable, read_bytes
from chipwise.stock import reasons, store

LONGEST_S = 600.0  # of a test, on a busy computer: what waits for a FIFO waits for ever


def fifo(path):
    os.mkfifo(path)


def folder(path):
    os.mkdir(path)


def unix_socket(path):
    socket.socket(socket.AF_UNIX).bind(os.path.relpath(path))


def link_to(target):
    def make(path):
        os.symlink(target, path)

    make.__name__ = "link to " + target
    return make


def huge(path):
    with open(path, "wb") as file:
        file.truncate(1 << 40)


ODD = [
    fifo,
    folder,
    unix_socket,
    link_to("/dev/zero"),
    link_to("/dev/tty"),
    link_to("/dev/full"),
    link_to("/dev/stdin"),
    link_to("."),
    huge,
    link_to("no such file"),
    link_to("itself"),
]


@pytest.fixture(params=ODD, ids=lambda make: make.__name__)
def odd(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "itself"
    request.param(path)
    return str(path)


@pytest.fixture(autouse=True)
def in_time():
    """No test here waits for anything.  Not by a signal: xdist does not always run tests in the main thread (execnet
    1.9)."""
    faulthandler.dump_traceback_later(LONGEST_S, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


def test_no_file_where_one_should_be(odd):
    with pytest.raises(OSError) as caught:
        read_bytes(odd, 1000)
    assert caught.value.strerror


def test_a_stock_file_that_is_none(odd):
    with pytest.raises(store.StoreError) as caught:
        store.read(odd, 100_000)
    assert caught.value.reply in (reasons.DISK, reasons.NO_FILE, reasons.TOO_LARGE)


def test_a_tool_file_that_is_none(odd):
    for _ in range(2):  # the second time from the cache
        with pytest.raises(CycleError, match="cannot be read"):
            geometry.load_tools(odd)


def test_an_ini_file_that_is_none(odd):
    with pytest.raises(CycleError, match="INI file"):
        settings.load_settings(odd)


def test_just_as_large_as_allowed(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x" * 1000)
    assert read_bytes(path, 1000) == b"x" * 1000
    with pytest.raises(OSError, match="1000 bytes, more than 999"):
        read_bytes(path, 999)


def test_a_zero_in_the_name():
    for read in (lambda name: read_bytes(name, 10), geometry.load_tools, store.read):
        with pytest.raises((OSError, CycleError, store.StoreError)):
            read("a\0b")


def test_printable():
    assert printable(os.fsdecode(b"/home/m\xfcller")) == "/home/m\\udcfcller" and printable("\u00fc") == "\u00fc"


# --- the tool geometry file -------------------------------------------------------------------------------------

BROKEN = [
    "tool = 1",
    "[tool]\n1 = 2",
    "[[tool]]\n",
    "[tool.1]\nshape = []",
    "[tool.1]\nshape = {a = 1}",
    "[tool.1]\nflutes = true",
    "[tool.1]\nflutes = 2.0",
    "[tool.1]\nflutes = 1" + "0" * 400,
    "[tool.1]\nflutes = 1" + "0" * 5000,
    "[tool.1]\nflutes = 0x1" + "0" * 5000,
    "[tool.1]\nflute_length = nan",
    "[tool.1]\nflute_length = inf",
    "[tool.1]\nflute_length = 1e999",
    "[tool.1]\nflute_length = 1979-05-27",
    "[tool." + "9" * 5000 + "]\n",
    "[tool.1]\n[tool.01]\n",
    "[tool.-1]\n",
    "[tool.1.5]\nflutes = 2",
    "x = " + "[" * 100_000,
    "[tool.1]\nx = " + "{a=" * 20_000,
    "\0",
    '[tool.1]\nshape = "{x}"',
    '[tool."{0}"]\n',
    '[tool.1]\n"\\u0000" = 1',
    "a." * 3000 + "a = 1",
    "[tool.\u0661]\n",
    '[tool.1]\nshape = "' + "x" * 10_000 + '"',
]


@pytest.mark.parametrize("text", BROKEN, ids=lambda text: repr(text[:24]))
def test_a_broken_tool_file(text):
    with pytest.raises(CycleError) as caught:
        geometry.parse_tools(text, "tools.toml")
    assert str(caught.value).startswith("chipwise: tools.toml") and len(str(caught.value)) < 400
    assert "Traceback" not in str(caught.value)


@pytest.mark.parametrize("data", [b"\xff\xfe", b'[tool.1]\nshape = "m\xfcller"', b"\xef\xbb\xbf[tool.x]"])
def test_a_tool_file_in_another_code(tmp_path, data):
    path = tmp_path / "tools.toml"
    path.write_bytes(data)
    with pytest.raises(CycleError):
        geometry.load_tools(str(path))


def test_a_broken_tool_file_is_read_once(tmp_path, monkeypatch):
    """chipwise-monitor asks fifty times a second."""
    path = tmp_path / "tools.toml"
    path.write_text("[tool.1]\nflutes = 0\n")
    read = []
    monkeypatch.setattr(
        geometry, "parse_tools", lambda *arguments, parse=geometry.parse_tools: read.append(1) or parse(*arguments)
    )
    for _ in range(50):
        with pytest.raises(CycleError, match="flutes = 0"):
            geometry.load_tools(str(path))
    assert len(read) == 1
    path.write_text("[tool.1]\nflutes = 12\n")
    assert geometry.load_tools(str(path))[1].flutes == 12


PIECES = [
    "[",
    "]",
    "[tool.",
    "tool",
    ".",
    "1",
    "=",
    "\n",
    '"',
    "'",
    "{",
    "}",
    ",",
    "shape",
    "bull",
    "flat",
    "flutes",
    "tip_angle",
    "9" * 30,
    "nan",
    "inf",
    "-",
    "1e400",
    "true",
    "#",
    "\\",
    "\0",
    "\u00fc",
    "1979-05-27",
    "0x",
    "_",
    " ",
]


def test_random_tool_files(tmp_path):
    """Tools or a CycleError, nothing else, in time."""
    chance, seed = random.Random(random_seed()), random_seed()
    good = '[tool.1]\nshape = "bull"\ncorner_radius = 0.5\nflutes = 3\n[tool.22]\nshape = "vee"\ntip_angle = 90\n'
    for case in range(random_count(2000)):
        text = good
        for _ in range(chance.randrange(1, 6)):
            at = chance.randrange(len(text) + 1)
            text = (
                text[:at] + chance.choice(PIECES) * chance.choice((1, 1, 1, 5, 300)) + text[at + chance.randrange(3) :]
            )
        try:
            found = geometry.parse_tools(text, "tools.toml")
        except CycleError:
            continue
        except Exception as error:
            raise AssertionError(
                f"CHIPWISE_SEED={seed}, case {case}: {type(error).__name__}: {error}: {text!r}"
            ) from error
        assert all(isinstance(tool, geometry.ToolGeometry) for tool in found.values())


def test_there_is_a_limit_of_digits_here():
    """What two of the broken files are about."""
    assert sys.get_int_max_str_digits() == 4300
