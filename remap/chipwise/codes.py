# SPDX-License-Identifier: GPL-2.0-or-later
"""One short function per remapped code, named in the INI file's REMAP lines.

Each is called by the interpreter at read-ahead, with the words of its argspec: once in the preview, once in the task.
LinuxCNC looks the functions up in the machine's module `remap`. chipwise's own remap.py takes them from here, and so
does that of a machine with codes of its own: `from chipwise.codes import *`.
"""

from chipwise.glue import (
    barriers,
    clamps,
    contour,
    hole,
    pattern,
    pocket,
    session,
    stations,
    stock_codes,
    surface,
    turning,
    volumetric,
)

__all__ = (
    "g12",
    "g13",
    "g22",
    "g23",
    "g24",
    "g26",
    "g27",
    "g75",
    "g77",
    "g78",
    "g79",
    "m250",
    "m251",
    "m252",
    "m253",
    "m254",
    "m255",
    "m256",
    "feed",
)


def g12(self, **words):
    """G12: circular hole, cut clockwise."""
    yield from session.run_cycle(self, "G12", words, session.Cycle(hole.order_of(ccw=False)))


def g13(self, **words):
    """G13: circular hole, cut counter-clockwise."""
    yield from session.run_cycle(self, "G13", words, session.Cycle(hole.order_of(ccw=True)))


def g22(self, **words):
    """G22: barrier of a lathe on."""
    yield from session.run_steps(self, "G22", words, barriers.on)


def g23(self, **words):
    """G23: all barriers off."""
    yield from session.run_steps(self, "G23", words, barriers.off)


def g24(self, **words):
    """G24: machine a curved surface."""
    yield from session.run_cycle(self, "G24", words, session.Cycle(surface.order))


def g26(self, **words):
    """G26: turn a part from its drawing."""
    yield from session.run_cycle(
        self, "G26", words, session.Cycle(turning.order_of(single=False), turning.check_modes, turning.carry_out)
    )


def g27(self, **words):
    """G27: one step of G26's plan."""
    yield from session.run_cycle(
        self, "G27", words, session.Cycle(turning.order_of(single=True), turning.check_modes, turning.carry_out)
    )


def g75(self, **words):
    """G75: run a sub as a pattern."""
    yield from session.run_cycle(self, "G75", words, session.Cycle(pattern.order, pattern.check_modes))


def g77(self, **words):
    """G77: rough a contour."""
    yield from session.run_cycle(self, "G77", words, session.Cycle(contour.order_of(finish=False)))


def g78(self, **words):
    """G78: finish a contour."""
    yield from session.run_cycle(self, "G78", words, session.Cycle(contour.order_of(finish=True)))


def g79(self, **words):
    """G79: clear a pocket."""
    yield from session.run_cycle(self, "G79", words, session.Cycle(pocket.order, rests=pocket.starts_from_stock))


def m250(self, **words):
    """M250: define the stock."""
    yield from session.run_steps(self, "M250", words, stock_codes.define_stock)


def m251(self, **words):
    """M251: volumetric feed on."""
    yield from session.run_steps(self, "M251", words, volumetric.feed_on)


def m252(self, **words):
    """M252: volumetric feed off."""
    yield from session.run_steps(self, "M252", words, volumetric.feed_off)


def m253(self, **words):
    """M253: save the stock."""
    yield from session.run_steps(self, "M253", words, stock_codes.save_stock)


def m254(self, **words):
    """M254: restore a saved stock."""
    yield from session.run_steps(self, "M254", words, stock_codes.restore_stock)


def m255(self, **words):
    """M255: teach a point of a station."""
    yield from session.run_steps(self, "M255", words, stations.teach)


def m256(self, **words):
    """M256: a set-up of clamps is in force."""
    yield from session.run_steps(self, "M256", words, clamps.put_on)


def feed(self, **words):
    """F: as built in, but known to M251's ceiling."""
    return session.program_feed(self, words)
