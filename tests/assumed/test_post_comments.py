# SPDX-License-Identifier: GPL-2.0-or-later
"""Comments of CAM systems' programs, in their forms: tools and stock."""

import random

import pytest

from chipwise.program import post_comments
from chipwise.program.post_comments import SaidTool
from support.random_cases import random_seed


def read(tmp_path, text, unit_mm=1.0, encoding="utf-8"):
    path = tmp_path / "part.nc"
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return post_comments.read(str(path), unit_mm)


TOOLS = {
    "fusion": ("(T3 D=6. CR=0. - ZMIN=-5.5 - flat end mill)\nG21\n", {3: SaidTool(3, 6)}),
    "fusion with a name": (
        "(T12  6MM CARBIDE D=6.35 CR=0.5 - ZMIN=-1. - bullnose end mill)\n",
        {12: SaidTool(12, 6.35, 0.5)},
    ),
    "fusion ball": ("(T5 D=3. CR=1.5 - ZMIN=-1. - ball end mill)\n", {5: SaidTool(5, 3, 1.5)}),
    "fusion chamfer": ("(T7 D=10. CR=0. TAPER=45deg - ZMIN=-1.2 - chamfer mill)\n", {7: SaidTool(7, 10, 0, 90)}),
    "fusion inch": (
        "(T1 D=0.25 CR=0. - ZMIN=-0.2 - flat end mill)\nG20\n(T2 D=0.5 CR=0. - ZMIN=-0.2 - flat end mill)\n",
        {1: SaidTool(1, 6.35), 2: SaidTool(2, 12.7)},
    ),
    "carbide": ("(TOOL/MILL,3.175,0.000,20.000,0.0)\nG21\nM6 T102\n", {102: SaidTool(102, 3.175)}),
    "carbide vee without a call": ("(TOOL/MILL,6.35, 0.0, 12.0, 30)\nG21\n", {None: SaidTool(None, 6.35, 0, 60)}),
    "vectric": ("(1 = End Mill {6 mm})\nG21\n", {1: SaidTool(1, 6)}),
    "vectric inch": ("(T3 = Ball Nose {0.125 inch})\n", {3: SaidTool(3, 3.175)}),
    "freecad": ("(begin toolchange)\n( M6 T4 )\n(Compensated Tool Path. Diameter: 5.0)\nG20\n", {4: SaidTool(4, 5)}),
    "cambam": ("( T2 : 3.0 )\nG21\n", {2: SaidTool(2, 3)}),
    "kiri": (
        "; tool#=6 flute=1.5 len=12 unit=metric\n; tool#=7 flute=0.25 len=1 unit=imperial\n",
        {6: SaidTool(6, 1.5), 7: SaidTool(7, 6.35)},
    ),
    "mastercam": (
        "( T2 | 10 FLAT ENDMILL | H2 | D2 | TOOL DIA. - 10. )\n(T3|DRILL|H3|TOOL DIA. - 4.2)\n",
        {2: SaidTool(2, 10), 3: SaidTool(3, 4.2)},
    ),
    "a comment of somebody": ("(TOOL 3 IS 6 MM, D=6)\n; t5 is broken\nT#<t3> = 4\n", {}),
    "impossible": ("(T3 D=0. CR=0. - ZMIN=-5. - x)\n(T4 D=99999. CR=0. - ZMIN=-5. - x)\n", {}),
}


@pytest.mark.parametrize("name", TOOLS)
def test_tools(tmp_path, name):
    text, wanted = TOOLS[name]
    for form in (text, text.replace("\n", "\r\n"), "%\n" + text + "M30\n%\n"):
        found = read(tmp_path, form).tools
        assert found.keys() == wanted.keys()
        for number, tool in wanted.items():
            one = found[number]
            assert (one.number, one.tip_angle) == (tool.number, tool.tip_angle)
            assert (one.diameter, one.corner_radius) == pytest.approx((tool.diameter, tool.corner_radius))


STOCKS = {
    "workpiece": (
        "(WORKPIECE,BOX,XMIN=0,YMIN=-1.5,ZMIN=-20,XMAX=100,YMAX=60,ZMAX=0)\n(stockMin:0.00mm, 0.00mm, -1mm)\n"
        "(stockMax:1.00mm, 6.00mm, 0.00mm)\n",
        (0, -1.5, -20),
        (100, 60, 0),
    ),
    "workpiece, round, inch": (
        "G20\n( workpiece, cylinder, axis=z, x=1, y=2, zmin=-.5, zmax=0, diameter=2 )\n",
        (0, 25.4, -12.7),
        (50.8, 76.2, 0),
    ),
    "carbide corners": (
        "(stockMin:0.00mm, -1.50mm, -12.70mm)\n(stockMax:100.00mm, 60.00mm, 0.00mm)\n",
        (0, -1.5, -12.7),
        (100, 60, 0),
    ),
    "carbide corners inch": (
        "G21\n(stockMin: 0.0in, 0.0in, -0.5in)\n(stockMax: 4.0in, 2.0in, 0.0in)\n",
        (0, 0, -12.7),
        (101.6, 50.8, 0),
    ),
    "block": ("G21\n(STOCK/BLOCK,100.0,60.0,12.7,50.0,30.0,12.7)\n", (-50, -30, -12.7), (50, 30, 0)),
    "block on the table, inch": ("G20\n(STOCK/BLOCK, 4, 2, 0.5, 0, 0, 0)\n", (0, 0, 0), (101.6, 50.8, 12.7)),
    "vectric": (
        "( Material Size )\n( X= 300.000, Y= 200.000, Z= 18.000)\n(Z Origin for Material = Material Surface)\n"
        "(XY Origin for Material = Bottom Left Corner)\nG21\n",
        (0, 0, -18),
        (300, 200, 0),
    ),
    "vectric centre": (
        "(Material Size)\n(X= 12, Y= 8, Z= 0.75)\n(Z Origin for Material = Table Surface)\n"
        "(XY Origin for Material = Center)\nG20\n",
        (-152.4, -101.6, 0),
        (152.4, 101.6, 19.05),
    ),
}


@pytest.mark.parametrize("name", STOCKS)
def test_stock(tmp_path, name):
    text, low, high = STOCKS[name]
    said = read(tmp_path, text)
    assert said.low == pytest.approx(low) and said.high == pytest.approx(high)


@pytest.mark.parametrize(
    "text",
    [
        "(WORKPIECE,BOX,XMIN=0,YMIN=0,ZMIN=-20,XMAX=100,YMAX=60)",
        "(WORKPIECE,BOX,XMIN=9,YMIN=0,ZMIN=-20,XMAX=1,YMAX=60,ZMAX=0)",
        "(WORKPIECE,CYLINDER,X=1,Y=2,ZMIN=-5,ZMAX=0)",
        "(WORKPIECE,BALL,X=1,DIAMETER=4)",
        "(WORKPIECE)",
        "(WORKPIECE,BOX,XMIN=[1+2])",
    ],
)
def test_a_workpiece_that_is_not_complete(tmp_path, text):
    assert read(tmp_path, text + "\n").low is None


def test_sizes_without_a_place(tmp_path):
    assert read(tmp_path, "; Stock X:100 Y:60.5 Z:12\nG21\n").size == (100, 60.5, 12)
    assert read(tmp_path, "(Stock Height: 0.5 in)\n").size == (None, None, 12.7)
    said = read(tmp_path, "(Material Size)\n(X= 100, Y= 60, Z= 12)\nG21\n")
    assert said.size == (100, 60, 12) and said.low is None
    for text in (
        "; Stock X:0 Y:60 Z:12\n",
        "(STOCK/BLOCK,-100,60,12,0,0,0)\n",
        "(stockMin:0.00mm, 0.00mm, 0.00mm)\n",
        "(X= 1, Y= 2, Z= 3)\n",
    ):
        said = read(tmp_path, text)
        assert said.low is None and said.size is None, text


def test_units_and_calls(tmp_path):
    assert read(tmp_path, "G0 X1\n").unit_mm == 1.0 and read(tmp_path, "G0 X1\n", 25.4).unit_mm == 25.4
    assert read(tmp_path, "(G20)\nG90G21\nG20\n", 25.4).unit_mm == 1.0
    assert read(tmp_path, "g020 g90\n").unit_mm == 25.4 and read(tmp_path, "G20.1\nG200\n").unit_mm == 1.0
    assert read(tmp_path, "T3 M6\nN7t05m6\nM6 T3\n#<t8> = 1\n").calls == [3, 5]
    assert read(tmp_path, "(When using Fusion 360 for Personal Use, the feedrate of rapid)\n").rapids_are_feeds


def test_any_bytes(tmp_path):
    """Nothing in a file ends the reading, or takes long."""
    rng = random.Random(seed := random_seed())
    pieces = [text.encode() for text, *_ in (*TOOLS.values(), *STOCKS.values())]
    for _ in range(300):
        data = bytearray(b"".join(rng.sample(pieces, 4)))
        for _ in range(rng.randrange(1, 60)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        said = read(tmp_path, bytes(data))
        assert all(
            0.01 <= tool.diameter <= 1000 and 0 <= tool.corner_radius <= tool.diameter / 2
            for tool in said.tools.values()
        ), f"seed {seed}"
        assert said.low is None or all(a < b for a, b in zip(said.low, said.high)), f"seed {seed}"
    assert read(tmp_path, b"(" * 3_000_000 + b"T1 D=" * 1000 + b"\n(T3 D=6. CR=0. - ZMIN=-5. - x)\n").tools.keys() == {
        3
    }
    assert (
        len(read(tmp_path, "".join(f"(T{n} D=6. CR=0. - ZMIN=-5. - x)\n" for n in range(5000))).tools)
        == post_comments.MAX_TOOLS
    )
