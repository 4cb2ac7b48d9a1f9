# SPDX-License-Identifier: GPL-2.0-or-later
"""Three of the twenty-four programs of bench/bench_shadow.py: the machine moves the same with SHADOW and without, in
every servo period."""

import numpy as np
import pytest

from support import cam_programs
from support.shadow_runs import canonical, run, strange

pytestmark = pytest.mark.machine

NAMES = "fusion_personal_profile", "mastercam_drill", "estlcam_engrave"


def test_servo_rows_and_calls(tmp_path):
    """A stock or a sentence for each, no row and no call that is not there without it; one row that is off by 1e-6 mm
    would be seen."""
    texts = {name: cam_programs.programs()[name] for name in NAMES}
    off, on = (run(tmp_path / word, texts, "metric", word == "yes") for word in ("no", "yes"))
    for name in NAMES:
        (errors, without, _, _), (errors_on, with_it, said, pins) = off[name], on[name]
        assert errors == errors_on == [] and without is not None and with_it is not None, (
            "servo periods lost: no verdict"
        )
        assert len(with_it) > 5000 and strange(with_it, without) == 0, (name, len(with_it), len(without))
        assert ("no stock is assumed" if name == "estlcam_engrave" else "a stock is assumed") in said[-1] and pins[
            1
        ] == "FALSE"
        assert (pins[0] == "TRUE" and float(pins[2]) > 1000) or name == "estlcam_engrave"
        calls = canonical(tmp_path, texts[name], "metric", "no")
        assert calls == canonical(tmp_path, texts[name], "metric", "yes") and calls.count("\n") > 30
        other = with_it.copy()
        other[len(other) // 2, 0] += 1e-6
        assert (
            strange(other, without) == 1
            and strange(with_it[1:], without) == len(with_it) - 1
            and np.isfinite(with_it).all()
        )


def test_the_programs_are_of_twelve_manners():
    one, other = cam_programs.programs(1), cam_programs.programs(2)
    assert (
        len(one) == 24
        and len({name.rpartition("_")[0] for name in one}) == 12
        and all(one[name] != other[name] for name in one)
    )
