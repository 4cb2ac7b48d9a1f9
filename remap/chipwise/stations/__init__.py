# SPDX-License-Identifier: GPL-2.0-or-later
"""Stations: coordinate systems of fixtures, taught with M255.

    frame.py    points -> the station's coordinate system; what is wrong with them, how far they are off
    store.py    the file of the stations

Called by glue/stations.py (M255, and G75 with P) and cli/stations.py.
Source: the patent abstract on robot programming in work-station coordinates: a program is taught once in the
coordinates of a station and runs at any station whose place in space is known.
"""

ORIGIN, ON_X, ON_Y = 1, 2, 3  # numbers of the points that make a station
