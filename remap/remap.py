# SPDX-License-Identifier: GPL-2.0-or-later
"""The codes of a machine that has none of its own; what LinuxCNC looks up for REMAP=... python=name."""

from chipwise.codes import *  # noqa: F401,F403
