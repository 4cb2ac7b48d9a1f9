# SPDX-License-Identifier: GPL-2.0-or-later
"""Files, processes, clocks, the shell: what chipwise needs from the computer."""
