# SPDX-License-Identifier: GPL-2.0-or-later
"""Tells a reader of whole programs what the codes of the preview would have done in step with motion.

Called by glue/stock_codes.py, glue/volumetric.py and glue/clamps.py where there is no machine, and by glue/session.py
for contours; listened to by program/reader_runner.py.  In LinuxCNC's own preview nobody listens.
"""

# an object with the methods stock(), restored(), volume(), clamp_set_up() and target(), and wants_targets, whether it
# wants the last
listener = None


def stock(line, low, high, shape, turn):
    """M250: the stock, mm, machine coordinates (glue/workpiece.py: stock_of)."""
    if listener is not None:
        listener.stock(line, low, high, shape, turn)


def restored(line, slot=-1):
    """M254: a stock of a file that only the machine has; slot: -1: not as it was saved."""
    if listener is not None:
        listener.restored(line, slot)


def volume(line, mode, target=0.0, lower=0.0, ceiling=None):
    """M251 and M252: mode, mm3/min, mm/min."""
    if listener is not None:
        listener.volume(line, mode, target, lower, ceiling)


def clamps(line, number):
    """M256: number of the set-up of clamps, 0: none."""
    if listener is not None:
        listener.clamp_set_up(line, number)


def wants_targets():
    """Whether somebody wants the contours of G77, G78 and G79."""
    return listener is not None and listener.wants_targets


def target(line, loops):
    """The contour of a cycle: loops of points (x, y, z), mm, work coordinates."""
    listener.target(line, loops)
