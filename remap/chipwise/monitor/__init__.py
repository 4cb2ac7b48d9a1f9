# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise-monitor: informs the HAL components and the operator.

supervisor.py       two processes: one owns the HAL pins, the other works and is replaced if it dies
takeover.py         a new monitor continues on the signals of one that was killed
component.py        the HAL pins
watcher.py          LinuxCNC's task: status, commands, the operator
worker.py           the work: tool, faults, override, guards
hints.py            what the realtime side lacks: the path ahead, time
tool_shape.py       a tool as the pins describe it
messages.py         messages of faults and guards
stock_files.py      M253, M254 and [CHIPWISE]KEEP_STOCK
clamps_in_force.py  M256, and the clamps of the loaded program, in front of the guard
clamp_request.py    clamps on their path into the table: due, asked for, answered
comment_clamps.py   CLAMP comments of a program
live_stock.py       [CHIPWISE]KEEP_STOCK while the machine works
loaded_program.py   what is wrong with a program as soon as it is opened
limits.py           the limits of chip, power and torque: material, spindle, tool
shadow.py           [CHIPWISE]SHADOW: the stock that is assumed for a program
set_up.py           a program that a person has set up
tool_place.py       where the tool is, from the servo thread's pins
set_up_time.py      how long a program would take set up
known.py            whether the loaded program has been read, and whose the stock is, for a display
answering.py        a process that reads the loaded program for these two
saying.py           what these two and limits.py have for the operator, when it is quiet
"""
