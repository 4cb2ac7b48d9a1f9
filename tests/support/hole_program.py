# SPDX-License-Identifier: GPL-2.0-or-later
"""One hole in every notation, and programs round it.  Called by tests/interpreter/test_g12_g13*.py."""

# One hole, the same in every notation: centre 10 -5, 20 mm, tool 2 mm, H 8, three passes, from 0 0 20.
MM = "X10 Y-5 I10 Z-6 R2 J3 F600 E200"
INCH = "X{:.9f} Y{:.9f} I{:.9f} Z{:.9f} R{:.9f} J{:.9f} F{:.9f} E{:.9f}".format(
    *(v / 25.4 for v in (10, -5, 10, -6, 2, 3, 600, 200))
)
START = {
    "G21": "G21 G0 X0 Y0 Z20\n#<_chipwise_chop_size> = 8\n",
    "G20": "G20 G0 X0 Y0 Z[20/25.4]\n#<_chipwise_chop_size> = [8/25.4]\n",
}


def program(line, unit="G21", before="", after=""):
    """A program around one line; comments mark what it did."""
    return f"T1 M6\n{before}\n{START[unit]}(begin)\n{line}\n(end)\n{after}\nM2\n"
