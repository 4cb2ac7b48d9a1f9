# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's interpreter as a remap sees it, for annotations: what glue/ and known_stock.py use of it.

Read in LinuxCNC 2.9.0~pre1: interpmodule.cc (properties), pyparamclass.cc (params), pyblock.cc (blocks).  Lengths and
feeds in program units, the tool table's in machine units.
"""

from __future__ import annotations

from typing import Any, Iterator, Protocol, Sequence

Words = dict[str, float]  # of a line, by small letter; n: its number
# What a code that may wait is to LinuxCNC: INTERP_EXECUTE_FINISH at each wait, INTERP_OK or INTERP_ERROR at the end
Steps = Iterator[int]
Waits = Iterator[None]  # of a code that waits until the machine has done all that was queued


class Parameters(Protocol):
    """Numbered and global named parameters."""

    def __getitem__(self, name: str | int) -> float: ...

    def __setitem__(self, name: str | int, value: float) -> None: ...

    def globals(self) -> list[str]: ...


class Parameter(Protocol):
    """A named parameter; attr: bits of interp_internal.hh, PA_UNSET and others."""

    attr: int


class NamedParameters(Protocol):
    """Those of a call, by name."""

    def __getitem__(self, name: str) -> Parameter: ...

    def __delitem__(self, name: str) -> None: ...


class Context(Protocol):
    """A call: its file, the line it stands at, its named parameters."""

    filename: str
    sequence_number: int

    @property
    def named_params(self) -> NamedParameters: ...


class Block(Protocol):
    """A line; the flags and numbers of its words are looked up by name."""

    f_number: float
    o_type: int


class Tool(Protocol):
    """A row of the tool table; 0: the tool in the spindle."""

    toolno: int
    diameter: float
    orientation: int


class Interp(Protocol):
    """The interpreter (`self` of a remap)."""

    task: int
    filename: str
    sequence_number: int
    call_level: int
    remap_level: int
    feed_rate: float
    feed_mode: int
    motion_mode: int
    distance_mode: int
    ijk_distance_mode: int
    cutter_comp_side: int
    adaptive_feed: bool
    plane: Any  # emccanon.CANON_PLANE, of a module that only LinuxCNC's own processes have
    length_units: Any  # emccanon.CANON_UNITS
    rotation_xy: float
    current_x: float
    current_y: float
    current_z: float
    axis_offset_x: float
    axis_offset_y: float
    axis_offset_z: float
    origin_offset_x: float
    origin_offset_y: float
    origin_offset_z: float

    @property
    def params(self) -> Parameters: ...

    @property
    def sub_context(self) -> Sequence[Context]: ...

    @property
    def blocks(self) -> Sequence[Block]: ...

    @property
    def tool_table(self) -> Sequence[Tool]: ...

    @property
    def speed(self) -> Sequence[float]: ...

    @property
    def active_g_codes(self) -> Sequence[int]: ...

    @property
    def active_settings(self) -> Sequence[float]: ...

    def execute(self, line: str) -> int: ...

    def set_errormsg(self, text: str) -> None: ...

    def get_errormsg(self) -> str: ...
