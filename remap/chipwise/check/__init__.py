# SPDX-License-Identifier: GPL-2.0-or-later
"""Whole programs, read by LinuxCNC's interpreter and checked offline.

program/program_file.py                a file that may be a program
program/reader.py + program/reader_runner.py   a program -> blocks of records, from a process of its own
clib/height_map.py                       the stock offline: components/offline/height_sweep.c
simulate.py, times.py          records -> figures of each tool, findings (result.py, findings.py)
part_simulation.py, part.py    the same with a model of the part at the end
run.py                         programs -> results, on several cores
drawing.py, drawn_path.py      what the page draws of the stock and the path
page.py, page_stock.py         one result -> one HTML page
"""
