# SPDX-License-Identifier: GPL-2.0-or-later
"""The real blank, such as a casting or a sawn bar, from touched points: points.py reads them, heights.py computes the
heights that the stock may have, stock.py makes the stock, doubt.py keeps how sure it is."""
