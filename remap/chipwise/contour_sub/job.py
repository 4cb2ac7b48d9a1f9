# SPDX-License-Identifier: GPL-2.0-or-later
"""A contour sub to be read; read.py has what that gives.  Made by glue/shape.py and cli/contour.py; plain values."""

from dataclasses import dataclass
from typing import Optional, Union

from chipwise.geometry.base.tolerances import CONNECT_MM


@dataclass(frozen=True)
class Job:
    """A sub and what it may read.

    program         path of the program the sub is looked for first; also a tuple of paths: the caller's, its caller's
    sub             O-number
    ini             path of the INI file, "" for none: [RS274NGC]SUBROUTINE_PATH, [DISPLAY]PROGRAM_PREFIX
    unit            "mm" or "in": G21 or G20 where it is called
    incremental     G91; ijk_absolute: G90.1
    position        (x, y, z) mm, work coordinates, of the tool; None: nobody knows it, and the shape must not depend on
                    it
    feed            program units/min
    machine_unit    mm of a machine unit
    tool            (number, diameter in machine units)
    numbered        ((number, value), ..) of numbered parameters
    named           ((name, value), ..) of global named parameters
    close_gap       mm: a G0 of up to this length between two elements joins them
    lathe           the contour lies in ZX (G18); its first coordinate is Z, its second X; diameter: G7 where it is
                    called
    block_delete    lines that begin with / are left out
    """

    program: Union[str, tuple]
    sub: int
    ini: str = ""
    unit: str = "mm"
    incremental: bool = False
    ijk_absolute: bool = False
    position: Optional[tuple] = (0.0, 0.0, 0.0)
    feed: float = 1000.0
    machine_unit: float = 1.0
    tool: tuple = (0, 0.0)
    numbered: tuple = ()
    named: tuple = ()
    close_gap: float = CONNECT_MM
    lathe: bool = False
    diameter: bool = False
    block_delete: bool = False

    @property
    def in_plane(self) -> tuple:
        """The position as first and second coordinate of the contour, and the one along."""
        x, y, z = self.position or (0.0, 0.0, 0.0)
        return (z, x, y) if self.lathe else (x, y, z)

    @property
    def programs(self) -> tuple:
        """Paths of the programs."""
        return (self.program,) if isinstance(self.program, str) else tuple(self.program)
