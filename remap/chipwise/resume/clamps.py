# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps of M256 that are in force where a program goes on: the approach keeps away from them as they are now.  Called by compare.py.

Behind the place the moves are the program's own; the realtime guard looks after them.
"""

from chipwise.clamps import set_ups
from chipwise.clamps.distance import bodies, near
from chipwise.clib.height_map import Shape
from chipwise.program.reader import Unreadable
from chipwise.resume import walk

NO_TOOL = Shape(0.0)        # of which only the axis is known


def keep_away(job, number, program, first, end, line):
    """Unreadable if moves first .. end - 1 of the new program come nearer to a clamp than CLAMP_CLEARANCE.  number: of the set-up, 0 or None without one;
    line: of the user's program."""
    if not number:
        return
    within = job.settings["CLAMP_CLEARANCE"]
    index, tools = walk.tools_by_move(program, job.geometry)
    for clamp in set_ups.clamps_of(job.settings.path("CLAMPS"), number):
        for move in range(first, end):
            for body in bodies(tools[int(index[move])][3] or NO_TOOL):
                _index, distance, _share = near(clamp, body, program.start(move)[None], program.end[move][None], within)
                if len(distance):
                    raise Unreadable(f"the approach to the place would come nearer than {within:g} mm to {clamp.name}",
                                     "take the clamp away and correct the set-up with chipwise clamps, or say where to go on with --line N", line)
