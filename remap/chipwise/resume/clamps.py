# SPDX-License-Identifier: GPL-2.0-or-later
"""Clamps that are in force where a program goes on.  Called by run.py and compare.py.

Those of M256: the approach keeps away from them as they are now.  CLAMP comments of the part that is done come into the
head in mm, behind the coordinate system that they have in the program.  Behind the place the moves are the program's
own; the realtime guard looks after them.
"""

from chipwise.clamps import comment as comments
from chipwise.clamps import set_ups
from chipwise.clamps.clamp import Clamp
from chipwise.clamps.distance import bodies, near
from chipwise.clib.height_map import Shape
from chipwise.errors import MM_PER_INCH
from chipwise.program.clamp_places import SYSTEMS, files_of_subs, places_of
from chipwise.program.reader import Unreadable
from chipwise.resume import walk
from chipwise.rewrite.move_text import plain
from chipwise.stock.shape_comment import BOX_KEYS, CYLINDER_KEYS

DIGITS = 5
_SYSTEM_LINES = {f"G{code:g}" for code in SYSTEMS}
NO_TOOL = Shape(0.0)  # of which only the axis is known


def keep_away(job, number, program, first, end, line):
    """Unreadable if moves first .. end - 1 of the new program come nearer to a clamp than CLAMP_CLEARANCE.  number: of
    the set-up, 0 or None without one; line: of the user's program."""
    if not number:
        return
    within = job.settings["CLAMP_CLEARANCE"]
    index, tools = walk.tools_by_move(program, job.geometry)
    for clamp in set_ups.clamps_of(job.settings.path("CLAMPS"), number):
        for move in range(first, end):
            for body in bodies(tools[int(index[move])][3] or NO_TOOL):
                _index, distance, _share = near(clamp, body, program.start(move)[None], program.end[move][None], within)
                if len(distance):
                    raise Unreadable(
                        f"the approach to the place would come nearer than {within:g} mm to {clamp.name}",
                        "take the clamp away and correct the set-up with chipwise clamps, or say where to go on with "
                        "--line N",
                        line,
                    )


def kept(program, line, state, ini):
    """(comments {coordinate system, None: the one in force at the place: [text]} of the part before a line, sentences
    about those that are left out)."""
    found, left = {}, []
    data = program.source.data
    places = places_of(data, files_of_subs(ini)) if comments.of_program(data) else None
    for place in places.places if places else ():
        if not state.clamps_line < place.line < line or place.line in program.blocks.subs:  # a sub is kept as it is
            continue
        why = places.unknown(place, line - 1)
        if why:
            left.append(f"The clamp of line {place.line} is not kept: {why}.")
            continue
        inch = (place.units or ("in" if 200 in state.g else "mm")) == "in"
        low, high, shape = comments.read(place.inside, MM_PER_INCH if inch else 1.0)
        name, values = set_ups.numbers_of(Clamp(shape, 0.0, tuple(low), tuple(high), ""))
        keys = BOX_KEYS if name == "box" else CYLINDER_KEYS
        words = ",".join(f"{key}={plain(value, DIGITS)}" for key, value in zip(keys, values))
        system = next((code for code, number in SYSTEMS.items() if number == place.system), None)
        own = system is None or round(10 * system) in state.g
        found.setdefault(None if own else system, []).append(f"(CLAMP,{name.upper()},{words})")
    return found, left


def with_kept(lines, found, top):
    """The lines of text.head() with the comments of kept(); top: mm, Z of the retract in machine coordinates.  A
    comment counts from the next move on."""
    begin = next(k for k, line in enumerate(lines) if line.startswith("M254"))
    begin += 2 if lines[begin + 1].startswith("M256") else 1
    system = next(k for k in range(begin, len(lines)) if lines[k] in _SYSTEM_LINES)
    others = [
        line
        for code, texts in found.items()
        if code is not None
        for line in (f"G{code:g}", *texts, f"G53 G0 Z{plain(top, DIGITS)}")
    ]
    return [*lines[:begin], *others, *lines[begin : system + 1], *found.get(None, ()), *lines[system + 1 :]]
