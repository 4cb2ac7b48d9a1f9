# SPDX-License-Identifier: GPL-2.0-or-later
"""Many programs worked at once: on the processors of this computer, and on a cluster."""
