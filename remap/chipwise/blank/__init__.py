# SPDX-License-Identifier: GPL-2.0-or-later
"""The real blank, such as a casting or a sawn bar, from touched points.  heights.py computes the heights that the stock may have."""
