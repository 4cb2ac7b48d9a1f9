"""The one error a cycle, a setting or a tool description may raise.

Called by everything below remap/chipwise; caught only in glue/session.py, which prints it in program units.

A message says what is wrong, the value with its unit, the rule and the remedy:

    chipwise: G12: hole radius I2 mm is not larger than the tool radius 3 mm; use I above 3 mm

Pure code knows millimetres only, the operator thinks in the units of his program.  So an error carries a template
and the lengths it speaks of, and the text is made when the unit is known: `text("in")`.
"""

MM_PER_INCH = 25.4


def format_length(value_mm, unit="mm"):
    """Length (mm) -> "2 mm" or "0.07874 in": at most 4 decimals of a mm, 5 of an inch, no trailing zeros."""
    if unit == "in":
        number = f"{value_mm / MM_PER_INCH:.5f}"
    else:
        number = f"{value_mm:.4f}"
    number = number.rstrip("0").rstrip(".")
    if number in ("-0", ""):
        number = "0"
    return f"{number} {unit}"


class CycleError(Exception):
    """A request that cannot be done.

    problem  what, value and rule: a format string, whose {names} are lengths in mm
    remedy   what to do about it, same format; "" where there is none
    lengths  mm, by name
    code     the G-code or M-code concerned, None where not known yet (glue fills it in)

    str() gives the text in mm.
    """

    def __init__(self, problem, remedy="", code=None, **lengths):
        super().__init__(problem)
        self.problem = problem
        self.remedy = remedy
        self.code = code
        self.lengths = lengths

    def text(self, unit="mm"):
        """The whole message, lengths in "mm" or "in"."""
        shown = {name: format_length(value, unit) for name, value in self.lengths.items()}
        parts = ["chipwise"]
        if self.code:
            parts.append(self.code)
        sentence = self.problem.format(**shown)
        if self.remedy:
            sentence += "; " + self.remedy.format(**shown)
        parts.append(sentence)
        return ": ".join(parts)

    def __str__(self):
        return self.text("mm")
