# SPDX-License-Identifier: GPL-2.0-or-later
"""What became of a request to save or restore a stock: the numbers of chipwise-monitor.reply and their meaning.

Who calls it: glue/stock_codes.py (M253, M254), glue/clamps.py (M256), stock/store.py, cli/monitor.py.
"""

SLOTS = 10  # M253 P0..P9
TURNED = SLOTS  # of M254 with R180: the stock that turn_request.py names
SET_UPS = 1000  # M256 P0..P999

IDLE, BUSY, DONE = 0, 1, 2
(
    NO_STOCK,
    NO_FILE,
    BROKEN,
    OTHER_VERSION,
    TOO_LARGE,
    DISK,
    NO_ANSWER,
    BAD_SLOT,
    NO_CLAMPS,
    NOT_TAKEN,
    NOTHING_LEFT,
    TOO_FAR,
) = range(3, 15)
REASONS = {  # reply: (what, remedy)
    NO_STOCK: ("no stock is defined", "define it with M250 before"),
    NO_FILE: ("nothing has been saved there", "save a stock with M253 before, or see [CHIPWISE]STOCK_DIR"),
    BROKEN: ("the file is damaged or none of chipwise's", "delete it and save again"),
    OTHER_VERSION: ("the file is of another version of chipwise", "define the stock with M250 and save again"),
    TOO_LARGE: (
        "the stock in the file has more cells than the map",
        "enlarge [CHIPWISE]MAP_SIZE, or use a smaller CELL",
    ),
    DISK: (
        "the file cannot be read or written",
        "see the message in the log, [CHIPWISE]STOCK_DIR, and room on the disk",
    ),
    NO_ANSWER: (
        "the stock tracker does not hand over its map",
        "switch the machine on; see whether the servo thread runs",
    ),
    BAD_SLOT: ("there is no such slot", "use P0 to P9"),
    NO_CLAMPS: ("chipwise-monitor cannot read the set-up", "see the message in the log, and `chipwise clamps show`"),
    NOT_TAKEN: (
        "the stock tracker does not take its clamps over",
        "see whether the servo thread runs; install components and chipwise of one version",
    ),
    NOTHING_LEFT: ("nothing is left of the stock", "take the slot of the part that was turned over"),
    TOO_FAR: ("the turned stock would be too far from machine zero", "take a corner nearer to it"),
}


def kept_remedy(reply: int) -> str:
    """What to do if the stock of the last run was not restored: there is no other file, and the next start can try this
    one again."""
    if reply in (TOO_LARGE, DISK):
        return REASONS[reply][1] + ", before you switch the machine on"
    return "define it with M250"
