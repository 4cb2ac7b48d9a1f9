# SPDX-License-Identifier: GPL-2.0-or-later
"""Twenty programs in CAM styles that foreign.py has not, built after the feed law: nothing was tuned with them.

Called by bench/bench_styles.py and tests/machine/test_foreign_styles.py.  Sizes, offsets, angles and rates come from
the seed, as in foreign.py.
"""

import random

from support import styles_outline, styles_shape

BUILDERS = styles_outline.BUILDERS + styles_shape.BUILDERS


def programs(seed=1):
    """{name: foreign_post.Program} of a seed; each has a generator of its own."""
    return {build.__name__: build(random.Random(f"{seed} {build.__name__}")) for build in BUILDERS}
