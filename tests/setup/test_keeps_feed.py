# SPDX-License-Identifier: GPL-2.0-or-later
"""A tap or M52, in the program or in what it calls, keeps the feed of a set-up at F (setup/keeps_feed.py)."""

import pytest

from chipwise.setup.keeps_feed import COMPUTED, code_of

HEAD = "G21 G90\nT1 M6\nF300 G1 X10\n"
INI = (
    "[DISPLAY]\nPROGRAM_PREFIX = .\n[RS274NGC]\nSUBROUTINE_PATH = subs:more\nREMAP = M6 modalgroup=6 ngc=change\n"
    "REMAP = T prolog=p ngc=pick\n"
)
SUBS = {
    "tap": "o<tap> sub\nG84 X1 Z-3 R1 F2\no<tap> endsub\n",
    "outer": "o<outer> sub\no<tap> call\no<outer> endsub\n",
    "100": "o100 sub\nG 7 4 Z-3\no100 endsub\nM2\n",
    "plain": "o<plain> sub\n(G84) ; M52\nG83 X1 Z-2 R1 Q1\no<plain> endsub\n",
    "own": "o<own> sub\no<own> call\no<own> endsub\n",
    "thread": "o<thread> sub\nG76\nG33 Z-1 K1\nG38.2 Z-3\no<thread> endsub\n",
}


@pytest.fixture(name="kept")
def make_kept(tmp_path):
    """function: text of a program -> its code."""
    (tmp_path / "subs").mkdir()
    (tmp_path / "machine.ini").write_text(INI)
    for name, text in SUBS.items():
        (tmp_path / "subs" / f"{name}.ngc").write_text(text)

    def kept(text, **subs):
        for name, body in subs.items():
            (tmp_path / "subs" / f"{name}.ngc").write_text(body)
        (tmp_path / "part.ngc").write_text(HEAD + text + "M2\n")
        return code_of(str(tmp_path / "part.ngc"), str(tmp_path / "machine.ini"), 1 << 20)

    return kept


@pytest.mark.parametrize(
    "text, code",
    [
        ("G84 Z-3 R1\n", "G84"),
        ("n10 g 074 z-1\n", "G074"),
        ("M52 P1\n", "M52"),
        ("M3 S500 G1 X1 M52P0\n", "M52"),
        ("o<tap> call\n", "G84 in tap.ngc"),
        ("N5 O<Outer> CALL [1] [2]\n", "G84 in tap.ngc"),
        ("/ o0100 call\n", "G74 in 100.ngc"),
        ("M98 P100\n", "G74 in 100.ngc"),
        ("G91 m 98 p100 L2\n", "G74 in 100.ngc"),
        ("o[100+#1] call\n", COMPUTED),
        ("o#5 call\n", COMPUTED),
        ("M98 P[#2]\n", COMPUTED),
    ],
)
def test_it_is_found(kept, text, code):
    assert kept(text) == code


@pytest.mark.parametrize(
    "text",
    [
        "G1 X5 (G84)\n",
        "; o<tap> call\n",
        "G840\n",
        "G84.1\n",
        "M520\n",
        "o<plain> call\n",
        "o<own> call\n",
        "o<nowhere> call\n",
        "o<thread> call\nG33 Z-1 K1\nG38.3 Z1\n",
        "o200 sub\nG1 X1\no200 endsub\no200 call\n",
    ],
)
def test_what_may_rise(kept, text):
    """G33, G76 and G38 go at F in any case."""
    assert kept(text) == ""


def test_bodies_of_remapped_codes(kept):
    """Those that the program uses: M6 and T."""
    assert kept("", change="o<change> sub\nM52 P0\no<change> endsub\n") == "M52 in change.ngc"
    assert kept("", change="", pick="o<pick> sub\no<tap> call\no<pick> endsub\n") == "G84 in tap.ngc"
