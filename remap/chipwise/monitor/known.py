# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether chipwise-monitor has done with the loaded program, and whose the stock is: pins for a display that waits for
it (headless/display.py).  Called by worker.py."""

import zlib

PROGRAM_READ, STOCK_SOURCE = "program-read", "stock-source"
PINS = PROGRAM_READ, STOCK_SOURCE
SOURCES = (
    None,
    "program",
    "job",
    "assumed",
)  # values of the second one; a stock of MDI or of M254 counts as the program's
LARGEST_S32 = 0x7FFFFFFF


def checksum(path):
    """Of the path of a program, for a pin."""
    return zlib.crc32(path.encode("utf-8", "replace")) & LARGEST_S32


def show(pins, path, shadow, set_up, comment_clamps):
    """Set the pins.  path: of the loaded program, "" without one."""
    has_read = (
        path and set_up.has_read(path) and (set_up.claims or shadow.has_read(path)) and comment_clamps.has_read(path)
    )
    pins[PROGRAM_READ] = checksum(path) if has_read else 0
    source = None
    if pins["stock-defined"]:
        source = "assumed" if not pins["certain"] else "job" if set_up.has_stock() else "program"
    pins[STOCK_SOURCE] = SOURCES.index(source)
