# SPDX-License-Identifier: GPL-2.0-or-later
"""Random parts with one to six tools of both hands, default steps, judged by an r(z) judge written apart.

CHIPWISE_RANDOM_COUNT=200 CHIPWISE_SEED=40 tools/test tests/turning/test_turning_rz.py
"""

import random
import re

import pytest

from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.settings import load_settings
from chipwise.turning import nc
from chipwise.turning.plan import make_plan
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_request
from support import ROOT
from support.random_cases import random_count, random_seed, write_replay
from support.turning_hands import random_part
from support.turning_rz import Judge

CLEARANCE = 1.0
TRUE_REASONS = (
    "faces down to X",
    "parts off down to X",
    "would enter a barrier",
    "more than the drill's flutes",
    "boring bar would touch the far side",
)


def machine_of(part, folder, beside=None):
    """Machine with the tools of a part, and a TRAVERSE_CLEARANCE (mm)."""
    (folder / "lathe.tbl").write_text("".join(t.line() for t in part.tools))
    (folder / "lathe_tools.toml").write_text("".join(t.table() for t in part.tools))
    setting = "" if beside is None else f"\n[CHIPWISE]\nTRAVERSE_CLEARANCE = {beside}\n"
    (folder / "lathe.ini").write_text(
        (ROOT / "configs" / "lathe.ini").read_text().replace("\n[CHIPWISE]\n", setting or "\n[CHIPWISE]\n")
    )
    path = str(folder / "lathe.ini")
    return Machine(Ini(path), load_settings(path), path)


def planned(part, folder, beside=None):
    """(plan, written program, mm of a unit) of a part, with the machine's default steps."""
    machine = machine_of(part, folder, beside)
    (folder / "part.ngc").write_text(part.text)
    request = read_request(part.text, machine.startup)
    plan = make_plan(
        make_order(job_of(str(folder / "part.ngc"), request, machine), part.text, request, machine, machine.steps)
    )
    return plan, nc.program(plan, request, "random"), request.scale


@pytest.mark.parametrize("k", range(random_count(4)))
def test_parts_of_both_hands(k, tmp_path):
    """No gouge above 0.001 mm, no rapid or holder in the stock, no rapid nearer to it than 0.2 mm, no tool within 1 mm
    of a barrier, and no refusal without a true reason."""
    seed = f"hands {random_seed()} {k}"
    part = random_part(random.Random(seed))
    replay = write_replay(
        "turning_" + seed.replace(" ", "_"),
        {"seed": seed, "text": part.text, "tools": [t.line() + t.table() for t in part.tools]},
    )
    try:
        plan, text, unit = planned(part, tmp_path)
    except CycleError as error:
        assert any(reason in str(error) for reason in TRUE_REASONS), f"{seed}: {error}\n{replay}"
        print(f"refused: {error}")
        return
    judge = Judge(part, CLEARANCE)
    worst = judge.judge(text, unit)
    said = f"{seed}: {worst} {judge.where} {replay}"
    assert worst["gouge"] <= 0.001, said
    assert worst["contact"] <= 0.002 and worst["holder"] <= 0.001, said
    assert worst["barrier"] <= 0.001, said
    assert worst["near"] <= 1e-6, said
    assert plan.steps
    print(f"steps {sum(s.needed for s in plan.steps)} of {len(part.tools)} tools; {judge.left():.3f} mm left at most")
    replay.unlink()


def test_a_plunge_is_left_beside_its_wall(tmp_path):
    """The rapid away from a plunge rises three times as fast as it goes aside: the wall behind its end was 0.11 mm from
    its middle."""
    part = random_part(random.Random("hands 4427 110"))
    _, text, unit = planned(part, tmp_path)
    judge = Judge(part, CLEARANCE)
    assert judge.judge(text, unit)["near"] <= 1e-6, judge.where


@pytest.mark.parametrize("beside", (0.0, 0.5, 1.2))
def test_rapids_keep_the_setting(beside, tmp_path):
    """TRAVERSE_CLEARANCE of the machine; with 0 what is near is in contact."""
    judged = 0
    for k in range(random_count(2)):
        part = random_part(random.Random(f"beside {random_seed()} {k}"))
        try:
            _, text, unit = planned(part, tmp_path, beside)
        except CycleError as error:
            assert any(reason in str(error) for reason in TRUE_REASONS), f"{k}: {error}"
            continue
        judge, judged = Judge(part, CLEARANCE, beside), judged + 1
        worst = judge.judge(text, unit)
        assert (
            worst["near"] <= (1e-6 if beside else 0.002)
            and worst["gouge"] <= 0.001
            and worst["contact"] <= 0.002
            and worst["holder"] <= 0.001
        ), (k, worst, judge.where)
    assert judged


@pytest.fixture(scope="module")
def right(tmp_path_factory):
    """(part, its program, mm of a unit, the judge's verdict)."""
    part = random_part(random.Random("wrong 192"))  # its insert has to end at the clearance of a chuck
    _, text, unit = planned(part, tmp_path_factory.mktemp("right"))
    return part, text, unit, Judge(part, CLEARANCE).judge(text, unit)


@pytest.mark.xdist_group("turning_rz_right")
@pytest.mark.parametrize(
    "name, code, shift",
    [
        ("gouge", "123", (-0.004, 0.0)),
        ("gouge", "123", (0.0, -0.003)),
        ("contact", "0", (0.0, -0.7)),
        ("near", "0", (0.0, -0.7)),
        ("near", "0", (-0.25, 0.0)),
        ("barrier", "123", (-0.003, 0.0)),
    ],
)
def test_the_judge_sees_a_wrong_path(name, code, shift, right):
    """Feeds moved into part or barrier, rapids moved into the stock."""
    part, text, unit, verdict = right
    wrong = re.sub(
        rf"^G([{code}]) X(-?[\d.]+) Z(-?[\d.]+)",
        lambda m: f"G{m[1]} X{float(m[2]) + shift[1] / unit:.7f} Z{float(m[3]) + shift[0] / unit:.7f}",
        text,
        flags=re.M,
    )
    assert verdict[name] <= 0.002
    assert Judge(part, CLEARANCE).judge(wrong, unit)[name] > 0.002
