# SPDX-License-Identifier: GPL-2.0-or-later
"""Parameters that a sub reads and the program may have set: turn, contour and patterns run the sub without its program.

Called by cli/turn.py, cli/contour.py and pattern/library.py.  LinuxCNC reads a numbered parameter that nobody has set
as 0, which would be another part without a word.
"""

import re

from chipwise.program.find_sub import find_sub, o_word, plain_text

ARGUMENTS = 30  # #1 .. #30 are a sub's own: contour_sub/check.py
OWN = 5000  # LinuxCNC sets the parameters from this number on itself, such as the position


def check(job, most=10_000):
    """Raise CycleError if the sub of a Job reads a parameter from #31 to `most` that neither it nor the Job has set."""
    found = find_sub(job)
    known = {number for number, _ in job.numbered}
    for number, text in _lines(found):
        plain = plain_text(text)
        for name in re.findall(r"#(\d+|\[)", re.sub(r"#\d+=", "", plain)):
            if name == "[" or ARGUMENTS < int(name) <= most and int(name) not in known:
                raise found.fault(
                    number,
                    f"#{name} has its value only when the program runs",
                    f"give it with --set {name if name != '[' else '100'}=30, or write numbers",
                )
        known |= set(map(int, re.findall(r"#(\d+)=", plain)))


def hint_set(error):
    """The remedy of a CycleError names --set if a global parameter is missing, which the program would have set."""
    unset = re.search(r"Named parameter #<(_[^>]+)> not defined", error.problem)
    if unset:
        error.remedy = f"give it with --set {unset[1]}=value, or set it in the sub"


def _lines(found):
    """[(line number, text)] of the sub; if it calls others, then those of all subs of its file, too."""
    if not any(word and word[1] == "call" for word in (o_word(text) for _, text in found.body)):
        return found.body
    inside, lines = None, []
    for number, text in enumerate(found.lines, 1):
        word = o_word(text)
        if inside is None and word and word[1] == "sub":
            inside = word[0]
        elif word == (inside, "endsub"):
            inside = None
        elif inside is not None:
            lines.append((number, text))
    return lines
