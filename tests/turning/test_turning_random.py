# SPDX-License-Identifier: GPL-2.0-or-later
"""Random parts, planned and written as G-code, judged by an oracle written apart (support/turning_oracle.py)."""

import random
import re
from dataclasses import replace

import numpy as np
import pytest

from support import turning_oracle
from support.computing import least_s
from support.random_cases import random_count, random_seed, write_replay
from support.turning_oracle import judge, inaccessible_area
from support.turning_random import random_case, tailstock_case
from support.turning_rig import planned, with_margins


@pytest.mark.parametrize("k", range(random_count(12)))
def test_random_parts_are_turned_without_gouge_or_collision(k, tmp_path):
    seed = random_seed() * 100_003 + k
    case = random_case(random.Random(seed))
    replay = write_replay(f"turning_{seed}", {"seed": seed, "text": case.text})
    (plan, request, machine, text), spent = least_s(lambda: planned(case, tmp_path), 2.0)
    found, _, _ = judge(text, request.scale, case, machine.tools)
    said = f"seed {seed}, {replay}: {found}"
    assert found["gouge"] <= 0.001, said
    assert found["rapid"] <= 0.002, said
    assert found["holder"] <= 0.001, said
    assert spent < 2.0, said
    replay.unlink()
    assert plan.steps


@pytest.mark.parametrize("k", range(random_count(6)))
def test_nothing_enters_chuck_and_tailstock(k, tmp_path):
    """A box in front of the work, whose sides are wherever the dice say, and in half of the cases a chuck."""
    rng = random.Random(f"tailstock {random_seed()} {k}")
    case = tailstock_case(rng)
    _, request, machine, text = planned(case, tmp_path)
    found, _, _ = judge(text, request.scale, case, machine.tools)
    assert found["gouge"] <= 0.001 and found["rapid"] <= 0.002 and found["holder"] <= 0.001, f"{found}\n{case.text}"


@pytest.mark.parametrize("k", range(min(random_count(3), 100)))
def test_tools_keep_the_clearance_of_a_barrier(k, tmp_path):
    """Chuck and tailstock, 1 mm larger on all sides, are not entered; without the clearance they are."""
    rng = random.Random(f"clearance {random_seed()} {k}")
    case = tailstock_case(rng)
    larger = replace(
        case,
        tailstock=(case.tailstock[0] + 1.0, case.tailstock[1] - 1.0, case.tailstock[2] + 1.0),
        barrier=(case.barrier[0] + 1.0, case.barrier[1] + 1.0) if case.barrier else (),
    )
    _, request, machine, text = planned(case, tmp_path, 1.0)
    found, _, _ = judge(text, request.scale, larger, machine.tools)
    assert found["gouge"] <= 0.001, f"{found}\n{case.text}"


def test_a_clearance_that_is_not_kept_is_seen(tmp_path):
    """Without a clearance an insert goes to the chuck, behind a part that ends there."""
    case = random_case(random.Random(3), "D55", 0.0)
    end = case.outside[-1][0]
    case = replace(
        case,
        text=re.sub(r"G22 .*\n", "", case.text).replace(
            "G26 ", f"G22 X60 Z{(end - 0.1) / (25.4 if 'G20' in case.text else 1.0):.9f}\nG26 "
        ),
    )
    for clearance, kept in ((0.0, False), (1.0, True)):
        _, request, machine, text = planned(case, tmp_path, clearance)
        larger = replace(case, barrier=(25.0, end + 0.9))
        assert (judge(text, request.scale, larger, machine.tools)[0]["gouge"] <= 0.001) == kept


def test_the_library_judges_as_the_text_of_the_oracle_does(tmp_path, monkeypatch):
    case = random_case(random.Random(random_seed()), wide=True)
    _, request, machine, text = planned(case, tmp_path)
    found, bars, _ = judge(text, request.scale, case, machine.tools)
    monkeypatch.setattr(turning_oracle, "_follow", turning_oracle.follow_slowly)
    slow, others, _ = judge(text, request.scale, case, machine.tools)
    assert found.pop("where") == slow.pop("where")
    assert found == pytest.approx(slow, rel=1e-9)
    for side in bars:
        assert all(np.array_equal(a, b) for a, b in zip(bars[side], others[side]))


def test_what_a_second_finish_finds_too_thick_stays(tmp_path):
    """The first one lowers the stock beside the holder, which then reaches stock that roughing could not: the plan was
    refused (part 3614 of seed 20261125)."""
    case = random_case(random.Random(20261125 * 100_003 + 3614))
    plan, request, machine, text = planned(case, tmp_path)
    assert judge(text, request.scale, case, machine.tools)[0]["gouge"] <= 0.001
    assert any(r.height > 3.0 for r in plan.residue)


FAULTS = [("gouge", 123, (-0.02, 0.0)), ("gouge", 123, (0.0, -0.05)), ("rapid", 0, (0.0, -1.5))]


@pytest.mark.parametrize("name, code, shift", FAULTS)
def test_the_oracle_sees_a_wrong_path(name, code, shift, tmp_path):
    """Feeds moved into the part, rapids moved into the stock."""
    case = random_case(random.Random(3), "D55", 0.0)
    _, request, machine, text = planned(case, tmp_path)

    def moved(match):
        return (
            f"G{match.group(1)} X{float(match.group(2)) + shift[1] / request.scale:.6f} "
            f"Z{float(match.group(3)) + shift[0] / request.scale:.6f}"
        )

    wrong = re.sub(rf"^G([{code}]) X(-?[\d.]+) Z(-?[\d.]+)", moved, text, flags=re.M)
    assert judge(text, request.scale, case, machine.tools)[0][name] <= 0.002
    assert judge(wrong, request.scale, case, machine.tools)[0][name] > 0.01


@pytest.mark.parametrize("k", range(min(random_count(2), 20)))
def test_what_stays_is_what_no_tool_reaches(k, tmp_path):
    """The area of residue against closing by maximum and minimum filters on a fine grid."""
    seed = random_seed() * 1_003 + k
    case = random_case(random.Random(seed), allowance=0.0, snap=0.005)
    plan, _, machine, _ = planned(case, tmp_path)
    area = sum(r.area for r in plan.residue if not r.inside)
    exact = inaccessible_area(case, [with_margins(machine.tools[n]) for n in (1, 2)])
    assert area == pytest.approx(exact, abs=0.01), f"seed {seed}: {case.text}"
