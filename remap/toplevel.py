# SPDX-License-Identifier: GPL-2.0-or-later
"""Named by [PYTHON]TOPLEVEL: what LinuxCNC's interpreter imports when it starts.  `remap` holds the codes."""

import remap  # noqa: F401  looked up by REMAP=... python=name
