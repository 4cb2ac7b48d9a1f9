# SPDX-License-Identifier: GPL-2.0-or-later
"""Units and bounds of removal rates: cm3/min (in3/min in inch programs) where a person types one, mm3/min on pins and
inside.

Called by everything that reads or shows a rate: tool_data/geometry.py, settings.py, glue/volumetric.py, rewrite/run.py,
check/, panel/.
"""

from chipwise.errors import MM_PER_INCH

MM3_PER_CM3 = 1000.0
MM3_PER_IN3 = MM_PER_INCH**3
MAX_RATE = 1e7  # mm3/min: a larger rate is one in another unit
