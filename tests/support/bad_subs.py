# SPDX-License-Identifier: GPL-2.0-or-later
"""Contour subs that are refused, each with its message.  Called by test_subs.py (all of them) and
test_g77_g78_subs.py."""

NO_PLACE = "is not allowed in a contour sub; a contour sub holds G0 G1 G2 G3 in XY (G40 and F are ignored)"


def sub(*lines):
    return "\n".join(("o100 sub",) + lines + ("o100 endsub", ""))


# name: (sub, message); the sub begins in line 1
BAD_SUBS = {
    "an argument": (
        sub("G0 X0 Y0", "G1 X[#2 + 1]", "#2 = 5"),
        "sub O100, line 3 of program.ngc: #2 is an argument of the sub, "
        "and a contour sub is called without any; set #2 in the sub, or use a named parameter: #<_name>",
    ),
    "two full turns": (
        sub("G0 X0 Y0", "G2 I5 P2"),
        "sub O100, line 3 (after line 2) of program.ngc: an arc of 2 turns runs over itself; leave P out",
    ),
    "gap by G0": (
        sub("G0 X0 Y0", "G1 X9", "G0 Y0.3", "G1 Y9", "X0 Y0"),
        "sub O100 of program.ngc: the contour is not "
        "connected: line 3 ends 0.3 mm from where line 5 starts, more than the 0.01 mm that are closed; "
        "end line 3 at X9 mm Y0.3 mm",
    ),
    "nearly closed": (
        sub("G0 X0 Y0", "G1 X9", "Y9", "X0", "Y0.0512"),
        "sub O100 of program.ngc: the contour is open: line 6 "
        "ends 0.0512 mm from where line 3 starts, more than the 0.01 mm that are closed; end line 6 at X0 mm Y0 mm",
    ),
    "overshoot": (
        sub("G0 X0 Y0", "G1 X9", "Y9", "X0", "Y-2"),
        "sub O100 of program.ngc: the contour runs past its start: "
        "line 6 meets line 3 at X0 mm Y0 mm; end line 6 at X0 mm Y0 mm",
    ),
    "empty": (sub(), "sub O100, line 1 of program.ngc: the sub holds no G1, G2 or G3; put the contour in it"),
    "only rapids": (
        sub("G0 X1 Y1"),
        "sub O100, line 1 of program.ngc: the sub holds no G1, G2 or G3; put the contour in it",
    ),
    "missing": (
        "",
        "there is no sub O100 in program.ngc and no file 100.ngc with it on the SUBROUTINE_PATH; "
        "put the sub between O100 sub and O100 endsub, before or after the program's M2",
    ),
    "no endsub": (
        "o100 sub\nG0 X0 Y0\nG1 X9\n",
        "sub O100 begins in line 1 of program.ngc and has no endsub; end it with a line O100 endsub",
    ),
    "endless": (
        sub("G0 X0 Y0", "o1 while [1]", "#1 = [#1 + 1]", "o1 endwhile", "G1 X5"),
        "sub O100, line 1 of program.ngc: the sub does not end within 1 s of computing time (loops and calls: line 3); "
        "correct the loop's condition, or make the sub simpler",
    ),
    "long line": (
        sub("G0 X0 Y0", "G1 X5", "G1 Y" + "#" * 60000 + "1"),
        "sub O100, line 4 of program.ngc: the line has 60005 characters, more than LinuxCNC's 255; divide the line",
    ),
    "many lines": (
        sub("G0 X0 Y0", *["G1 X5", "G1 X6"] * 100000),
        "sub O100, line 1 of program.ngc: the sub has 200001 lines, "
        "more than 100000; divide the contour, or use a loop",
    ),
    "endless moves": (sub("G0 X0 Y0", "o1 while [1]", "G1 X1", "G1 X2", "o1 endwhile"), None),
    "calls itself": (sub("o100 call"), "sub O100, line 2 of program.ngc: Too many subroutine levels; correct the line"),
    "move in Z": (
        sub("G0 X0 Y0", "G1 X5 Z-1", "G1 Y5"),
        "sub O100, line 3 of program.ngc: a move in Z is not allowed in a "
        "contour sub; a contour lies in XY; heights are the words Z and R of the cycle",
    ),
    "G91": (sub("G0 X0 Y0", "G1 X5", "G91 Y5"), f"sub O100, line 4 of program.ngc: G91 {NO_PLACE}"),
    "G41": (sub("G0 X0 Y0", "G41 D1 G1 X5", "Y5"), f"sub O100, line 3 of program.ngc: G41 {NO_PLACE}"),
    "G0.5": (sub("G0 X0 Y0", "G2.1 X5", "Y5"), f"sub O100, line 3 of program.ngc: G2.1 {NO_PLACE}"),
    "G by expression": (
        sub("G0 X0 Y0", "G1 X5", "G[90 + 1] Y5", "G1 X6"),
        "sub O100, line 4 of program.ngc: a code other than G0 G1 G2 G3 (G91); correct the line",
    ),
    "M8": (sub("G0 X0 Y0", "G1 X5", "M8", "G1 Y5"), f"sub O100, line 4 of program.ngc: M8 {NO_PLACE}"),
    "M2": (sub("G0 X0 Y0", "G1 X5", "M2", "G1 Y5"), f"sub O100, line 4 of program.ngc: M2 {NO_PLACE}"),
    "dwell": (sub("G0 X0 Y0", "G1 X5", "G4 P1", "G1 Y5"), f"sub O100, line 4 of program.ngc: G4 {NO_PLACE}"),
    "other axis": (sub("G0 X0 Y0", "G1 X5 A3"), f"sub O100, line 3 of program.ngc: A3 {NO_PLACE}"),
    "no G-code": (sub("G0 X0 Y0", "G1 X5", "bla &%"), f"sub O100, line 4 of program.ngc: B {NO_PLACE}"),
    "code in a called sub": (
        sub("G0 X0 Y0", "G1 X5", "o2 call", "G1 Y5") + "o2 sub\nG1 X9\nM8\no2 endsub\n",
        "sub O100, line 9 (after line 8) of program.ngc: a code other than G0 G1 G2 G3; correct the line",
    ),
    "Z in a called sub": (
        sub("G0 X0 Y0", "G1 X5", "o2 call") + "o2 sub\nG1 X9\nG1 Z2\no2 endsub\n",
        "sub O100, line 8 (after line 7) of program.ngc: a move in Z is not allowed in a contour sub; "
        "a contour lies in XY; heights are the words Z and R of the cycle",
    ),
    "call of nothing": (
        sub("G0 X0 Y0", "G1 X5", "o2 call", "G1 Y5"),
        "sub O100, line 4 (after line 3) of program.ngc: there is no sub O2; correct the line",
    ),
    "infinity": (
        sub("G0 X0 Y0", "G1 X5", "G1 X[EXP[1000]]"),
        "sub O100, line 4 (after line 3) of program.ngc: Calculation resulted in 'infinity'; correct the line",
    ),
    "not a number": (
        sub("G0 X0 Y0", "G1 X5", "G1 X[[0-1]**0.5]"),
        "sub O100, line 4 (after line 3) of program.ngc: "
        "Attempt to raise negative to non integer power; correct the line",
    ),
    "root of -1": (
        sub("G0 X0 Y0", "G1 X5", "G1 X[SQRT[-1]]"),
        "sub O100, line 4 (after line 3) of program.ngc: Negative argument to sqrt; correct the line",
    ),
    "division by 0": (
        sub("G0 X0 Y0", "G1 X5", "G1 X[1/0]"),
        "sub O100, line 4 (after line 3) of program.ngc: Attempt to divide by zero; correct the line",
    ),
    "parameter unknown": (
        sub("G0 X0 Y0", "G1 X5", "G1 X#<nothing>"),
        "sub O100, line 4 (after line 3) of program.ngc: Named parameter #<nothing> not defined; correct the line",
    ),
    "impossible arc": (sub("G0 X0 Y0", "G1 X9", "G2 X19 Y0 I1 J0"), None),
    "two turns": (
        sub("G0 X0 Y0", "G1 X9", "G2 X19 Y0 I5 J0 P2"),
        "sub O100, line 4 (after line 3) of program.ngc: an arc of 2 turns runs over itself; leave P out",
    ),
    "helix": (sub("G0 X0 Y0", "G1 X9", "G2 X19 Y0 K5"), f"sub O100, line 4 of program.ngc: K5 {NO_PLACE}"),
    "crosses itself": (
        sub("G0 X0 Y0", "G1 X9", "G1 Y9", "G1 X4", "G1 Y-4"),
        "sub O100 of program.ngc: the contour crosses "
        "or touches itself: line 3 meets line 6 at X4 mm Y0 mm; draw them apart",
    ),
    "not connected": (
        sub("G0 X0 Y0", "G1 X9", "G0 Y3", "G1 X4"),
        "sub O100 of program.ngc holds 2 contours (from line 3, line 5), separated by G0; use one sub for each",
    ),
}
