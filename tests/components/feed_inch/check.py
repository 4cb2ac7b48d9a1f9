# SPDX-License-Identifier: GPL-2.0-or-later
"""As feed_law: the override has no unit."""

import numpy as np

from support.halrig import SCENES, load_module

law = load_module(SCENES / "feed_law/check.py")
check = law.check

SABOTAGE = dict(
    law.SABOTAGE,
    **{
        "velocity taken as mm": lambda t: t.but(adaptive_feed=lambda f: np.minimum(1.0, 25.4 * f)),
        "areas taken as square inch": lambda t: t.but(adaptive_feed=lambda f: f / 25.4**2),
    },
)
