# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise check on programs that name no stock, or no tool: what it takes them to be for."""

import random

import pytest

from chipwise.check.assume import halves
from support.check_runs import chipwise_check, mill_with_tools
from support.random_cases import random_count
from support.survey_oracle import stock_of


@pytest.fixture(name="machine")
def make_machine(tmp_path):
    return mill_with_tools(tmp_path)


def checked(tmp_path, text, *options, machine=None):
    """-> (exit status, stdout, the program's JSON)."""
    status, out, _err, report = chipwise_check(tmp_path, {"part.nc": text}, *options, machine=machine)
    return status, out, report["programs"][0]


DIAMETERS = {1: 6, 2: 6, 6: 10}  # of check_runs.TABLE


def random_program(rng):
    """(text, moves as stock_of() wants them): lines down, up, across and slanted, of one to three tools."""
    lines, moves = ["G21 G90 G94 G17"], []
    base = rng.choice([0.0, 0.0, 20.0, 5.37])  # Z of the part's top
    at = [0.0, 0.0, base + 15.0]
    for tool in rng.sample(sorted(DIAMETERS), rng.randint(1, 3)):
        diameter = DIAMETERS[tool]
        lines += [f"T{tool} M6", "S8000 M3", f"G0 Z{at[2]:.3f}"] if moves else [f"T{tool} M6", f"G0 Z{base + 15:.3f}"]
        moves.append((False, tuple(at), diameter))
        for _ in range(rng.randint(2, 7)):
            at = [rng.uniform(-60, 60), rng.uniform(-40, 40), at[2]]
            lines.append(f"G0 X{at[0]:.3f} Y{at[1]:.3f}")
            moves.append((False, tuple(round(value, 3) for value in at), diameter))
            for _ in range(rng.randint(0, 4)):
                kind = rng.choice("daas")
                if kind == "d":
                    at[2] = base - rng.uniform(-1, 6)
                elif kind == "a":
                    at[:2] = rng.uniform(-60, 60), rng.uniform(-40, 40)
                else:
                    at = [rng.uniform(-60, 60), rng.uniform(-40, 40), base - rng.uniform(-3, 6)]
                lines.append(f"G1 X{at[0]:.3f} Y{at[1]:.3f} Z{at[2]:.3f} F{rng.randint(100, 900)}")
                moves.append((True, tuple(round(value, 3) for value in at), diameter))
            if rng.random() < 0.7:
                at[2] = base + rng.uniform(1, 9)
                lines.append(f"G0 Z{at[2]:.3f}")
                moves.append((False, tuple(round(value, 3) for value in at), diameter))
    return "\n".join([*lines, "M2", ""]), moves


@pytest.mark.parametrize("seed", range(7411, 7411 + random_count(12)))
def test_the_stock_of_a_path_is_the_one_walked(tmp_path, machine, seed):
    text, moves = random_program(random.Random(seed))
    (tmp_path / "case.ngc").write_text(text)
    _status, out, program = checked(tmp_path, text, machine=machine)
    wanted = stock_of(moves)
    if wanted is None:
        assert program["error"], (seed, out)
        return
    assert program["stock"] and program["stock"]["source"] == "assumed", (seed, out)
    assert program["stock"]["min"] == pytest.approx(wanted[0], abs=0.02) and program["stock"]["max"] == pytest.approx(
        wanted[1], abs=0.02
    ), (seed, out)


def test_the_line_that_is_said_gives_the_same_judgement(tmp_path, machine):
    text = "G21 G90\nT1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG1 Z-12 F200\nX110 F400\nG0 X50 Y35\nG0 Z5\nM2\n"
    status, out, first = checked(tmp_path, text, machine=machine)
    said = next(line for line in out.splitlines() if "--stock" in line).partition("--stock ")[2].split()
    again, out_again, second = checked(tmp_path, text, "--stock", *said, machine=machine)
    assert status == again == 1 and "on an assumed stock" in out and "on an assumed stock" not in out_again
    assert first["tools"] == second["tools"] and first["stock"]["source"] == "assumed" and not second["notes"]
    assert [one["text"] for one in first["findings"]] == [one["text"] for one in second["findings"]]


def test_the_progress_of_two_readings():
    """A program of 100 lines: 0 to 50 in the first reading, 50 to 100 in the second."""
    seen = []
    first, second = halves(seen.append)
    for line in (10, 60, 100):
        first(line)
    for line in (10, 100):
        second(line)
    assert seen == [5, 30, 50, 55, 100] and halves(None) == (None, None)


def test_work_coordinates(tmp_path, machine):
    """The stock is said in those of the first move, turned and moved ones too."""
    body = "T1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG1 Z-2 F200\nX50 F400\nG0 Z5\nM2\n"
    for head in (
        "G21 G90\n",
        "G21 G90\nG10 L2 P1 X17 Y-3 Z40 R30\nG54\n",
        "G21 G90\nG10 L2 P2 X100 Z-7\nG55\nG92 X3 Y4 Z5\nG0 Z9\n",
    ):
        _status, out, program = checked(tmp_path, head + body, machine=machine)
        assert program["stock"]["min"] == pytest.approx([-13, 27, -2], abs=1e-3) and program["stock"][
            "max"
        ] == pytest.approx([53, 33, 0], abs=1e-3), out
        assert program["tools"][0]["volume_mm3"] == pytest.approx((60 * 6 + 28.27) * 2, rel=0.01), out


def test_coordinates_that_are_chosen_after_the_first_move(tmp_path, machine):
    """A post goes to machine zero first: Z0 is that of the feeds, and the line that is said still gives the same
    judgement."""
    text = (
        "G21 G90\nT1 M6\nS8000 M3\nG53 G0 Z0\nG10 L2 P2 X100 Y20 Z-70 R{}\nG55\nG0 X-10 Y30\nZ5\nG1 Z-2 F200\n"
        "X50 F400\nG0 Z5\nM2\n"
    )
    _status, out, program = checked(tmp_path, text.format(0), machine=machine)
    assert program["stock"]["min"] == pytest.approx([87, 47, -72]) and program["stock"]["max"] == pytest.approx(
        [153, 53, -70]
    ), out
    assert program["tools"][0]["volume_mm3"] == pytest.approx((60 * 6 + 28.27) * 2, rel=0.01), out
    _status, out, turned = checked(tmp_path, text.format(20), machine=machine)
    assert (turned["stock"]["min"][2], turned["stock"]["max"][2]) == pytest.approx((-72, -70)), out
    assert turned["tools"][0]["volume_mm3"] == pytest.approx((60 * 6 + 28.27) * 2, rel=0.01), out


PLAIN = "G90 G94 G17\nG21\nS8000 M3\nG54\nG0 X-10 Y30\nZ15\nG1 Z2 F1000\nG1 Z-5 F300\nX85 F800\nG0 Z15\nM5\nM30\n"


def test_a_tool_of_the_comments(tmp_path, machine):
    """Fusion's, without M6 and with its traverses as feeds; T3 of the tool table has another diameter than the comment,
    so its geometry is not this tool's."""
    head = (
        "%\n(1001)\n(T6 D=6. CR=3. - ZMIN=-5. - BALL END MILL)\n"
        "(WHEN USING FUSION 360 FOR PERSONAL USE, THE FEEDRATE OF RAPID)\n"
    )
    status, out, program = checked(tmp_path, head + PLAIN + "%\n", machine=machine)
    (tool,) = program["tools"]
    assert status == 1 and (tool["tool"], tool["diameter_mm"], tool["shape"], tool["flute_length_mm"]) == (
        6,
        6,
        "ball",
        None,
    )
    assert "tool 6 of the tool table has 10 mm and is another one" in out and "its traverses are G1" in out
    same, _out, program = checked(
        tmp_path, PLAIN.replace("S8000", "(T1 D=6. CR=0. - ZMIN=-5. - FLAT END MILL)\nS8000"), machine=machine
    )
    assert same == 0 and program["tools"][0]["flute_length_mm"] == 10


def test_what_is_missing_is_said_at_once(tmp_path, machine):
    status, out, program = checked(tmp_path, PLAIN, machine=machine)
    assert status == 2 and program["error"] == (
        "no tool is in the spindle (tool 0), and the program's comments name none; call one with T.. M6 before, "
        "or name it with --tool N or --tool-diameter D"
    )
    assert program["error_line"] == 7 and program["extents_mm"] == {"min": [-10, 30, -5], "max": [85, 30, 15]}
    assert "it feeds from X-10 Y30 Z-5 to X85 Y30 Z15" in out and program["tools"][0]["planned_s"] > 10
    for options in (("--tool", "1"), ("--diameter", "6"), ("--tool", "4", "--diameter", "6")):
        status, out, program = checked(tmp_path, PLAIN, *options, machine=machine)
        assert (
            status == ("4" in options)
            and program["stock"]["min"] == [-13, 27, -5]
            and program["tools"][0]["diameter_mm"] == 6
        ), out
        assert ("\n  tool 4: the tool is not in [CHIPWISE]TOOL_GEOMETRY" in out) == ("4" in options)
    for options in (("--tool", "4"), ("--tool", "77")):
        status, out, program = checked(tmp_path, PLAIN, *options, machine=machine)
        assert status == 2 and "has no diameter in the tool table" in out
    status, out, _program = checked(
        tmp_path, "(T1 D=6. CR=0. - ZMIN=-5. - A)\n(T2 D=8. CR=0. - ZMIN=-5. - B)\n" + PLAIN, machine=machine
    )
    assert status == 2 and "comments name several: T1 6 mm, T2 8 mm" in out


def test_two_things_that_are_missing_are_one_message(tmp_path, machine):
    status, _out, program = checked(tmp_path, "G21 G90\nF300\nG0 X0 Y0 Z0\nG1 X40 Y7\nM2\n", machine=machine)
    assert status == 2 and program["error"] == (
        "no tool is in the spindle (tool 0), and the program's comments name none, and no stock is defined, and the "
        "program feeds at one height only: its depth "
        "is not known; call one with T.. M6 before, or name it with --tool N or --tool-diameter D, and add M250, or "
        "name the stock with --stock X0 Y0 Z0 X1 Y1 Z1"
    )
    assert program["error"].count("; ") == 1 and program["extents_mm"] == {"min": [0, 0, 0], "max": [40, 7, 0]}


def test_a_program_of_one_height_has_no_stock(tmp_path, machine):
    for z in ("-1", "0", "3"):
        text = f"G21 G90\nT1 M6\nG0 Z{z}\nG0 X0 Y0\nG1 X50 F400\nM2\n"
        status, out, program = checked(tmp_path, text, machine=machine)
        assert (
            status == 2
            and "its depth is not known; add M250, or name the stock with --stock X0 Y0 Z0 X1 Y1 Z1" in out
            and program["stock"] is None
        ), out


STOCKS = {
    "carbide": (
        "(stockMin:-20.00mm, 0.00mm, -12.70mm)\n(stockMax:100.00mm, 60.00mm, 0.00mm)\n",
        [-20, 0, -12.7],
        [100, 60, 0],
        "comment",
    ),
    "kiri": ("; Stock X:120 Y:70 Z:12\n", [0, 0, -12], [120, 70, 0], "comment"),
    "makera": ("(Stock Height: 8 mm)\n", [-13, 27, -8], [88, 33, 0], "comment"),
    "elsewhere": (
        "(stockMin:500.00mm, 0.00mm, -12.70mm)\n(stockMax:600.00mm, 60.00mm, 0.00mm)\n",
        [-13, 27, -5],
        [88, 33, 0],
        "assumed",
    ),
}


@pytest.mark.parametrize("name", STOCKS)
def test_a_stock_of_the_comments(tmp_path, machine, name):
    comment, low, high, source = STOCKS[name]
    _status, out, program = checked(tmp_path, comment + PLAIN, "--tool", "1", machine=machine)
    assert program["stock"] == {"min": pytest.approx(low), "max": pytest.approx(high), "source": source}, out


def test_a_stock_of_the_program_wins(tmp_path, machine):
    text = "G21 G90\nM250 P0 Q0 R-20 I100 J60 K20\n" + PLAIN
    status, out, program = checked(tmp_path, text, "--diameter", "6", machine=machine)
    assert status == 0 and program["stock"] is None and "assumed" not in out
    assert program["tools"][0]["volume_mm3"] == pytest.approx(6 * 85 * 5 + 28.27 / 2 * 5, rel=0.01)
