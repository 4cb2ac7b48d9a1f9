# SPDX-License-Identifier: GPL-2.0-or-later
"""The filter of [FILTER] in the INI file: a program on its way from the operator's file into the GUI.

    work.py        a process of its own checks the program and rewrites it -> a Verdict (verdict.py)
    model.py       a process of its own makes the program that cuts a model or a job file
    process.py     that process: its time, its memory, its end
    loops.py       whether it may have no end
    program_out.py the program to standard output, whole or not at all
    screen.py      messages to the operator, as each GUI can take them

cli/filter.py calls them.  How the GUIs run a filter (read in LinuxCNC 2.9 and 2.10: axis.py,
gladevcp/hal_filechooser.py, qtvcp/qt_action.py):

 1. `sh -c "COMMAND 'FILE'"` with standard output in a file of a temporary folder, which is opened as the program if the
    exit status is 0.  AXIS opens that file again later, at a touch-off, whatever the exit status was.
 2. AXIS waits for the filter without an end and cannot cancel it.  It reads a line of standard error when there is
    something to read, so an unfinished line blocks it, and at the end it reads up to the end of the pipe, which a child
    may hold open.
 3. QtVCP reads one line of standard error every 100 ms.
 4. gmoccapy (gladevcp's file chooser) fails with a TypeError on any line of standard error that comes while the filter
    runs: the program is then not opened, and nothing is said.
"""
