"""Whole programs, read by LinuxCNC's interpreter and judged offline.

    reader.py + reader_runner.py   a program -> blocks of records, from a process of its own
    sweep.py                       the stock offline: components/core/height_sweep.c
    judge.py                       records -> figures of each tool, findings
    run.py                         programs -> results, on several cores
    page.py                        one result -> one HTML page
"""
