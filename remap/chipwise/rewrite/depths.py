# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether a program cuts deeper than the flutes are long, proved: components/offline/depth_proof.c from Python.

Called by run.py.  Lengths mm, machine coordinates of the tool's tip.
"""

import ctypes as C
import math
from dataclasses import dataclass

import numpy as np

from chipwise.check import records
from chipwise.check.reader import Unreadable
from chipwise.check.sweep import CYLINDER
from chipwise.rewrite import cutting
from chipwise.stock import layout
from chipwise.stock.core import library

ROOM = 2_000_000            # witnesses of one stock that are found: a long program has one in every few moves before it is repeated
MOST = 200_000              # those of them that count: the deepest
SQUARES = 300_000_000       # looked at for one stock: minutes
CELLS_ACROSS = 16           # of the smallest tool, of the proof's map
MOST_CELLS = 4_000_000
UNLIMITED = 1e30
APART_MM = 0.02             # of two needles

MOVE, TOOL, FOUND = (np.dtype(kind) for kind in (layout.ProofMove, layout.ProofTool, layout.ProofFound))


@dataclass(frozen=True)
class Witness:
    """A place of stock that a feed move cuts too deep: number of the stock, x, y (mm), depth (mm), tool: cutting.Tool, line,
    place (3,): of the tip."""

    stock: int
    x: float
    y: float
    depth: float
    tool: cutting.Tool
    line: int
    place: tuple


@dataclass
class _Stock:
    """A height map's shape, and the moves in it: tools, [(first, end, index of the tool, limit)]."""

    map: object
    tools: list
    parts: list


def _stocks(program, geometry, cell, over):
    """[_Stock] of a program."""
    found = []
    for section, stock in cutting.in_stock(program, cutting.sections(program, geometry), cell):
        if not found or found[-1].map is not stock:
            found.append(_Stock(stock, [], []))
        limit = cutting.finite_room(section.tool.flute_length) + over
        found[-1].parts.append((section, len(found[-1].tools), limit))
        found[-1].tools.append(section.tool)
    return found


def _moves(program, stock):
    """(ProofMove records, number of the program's move of each)."""
    index = np.concatenate([np.arange(s.first, s.end, dtype=np.int32) for s, _, _ in stock.parts])
    moves, at = np.zeros(len(index), MOVE), 0
    for section, tool, limit in stock.parts:
        first, end = section.first, section.end
        own = moves[at:at + end - first]
        own["to"], own["from"][0], own["from"][1:], own["tool"] = program.end[first:end], program.start(first), program.end[first:end - 1], tool
        feed = program.kind[first:end] != records.RAPID
        own["limit"] = np.where(feed & math.isfinite(limit), min(limit, UNLIMITED), UNLIMITED)
        at += end - first
    return moves, index


def _shape(stock):
    """ProofStock of a HeightMap."""
    turn = math.radians(stock.turn)
    (x0, y0, z0), (x1, y1, z1) = stock.low, stock.high
    return layout.ProofStock((x0 + x1) / 2, (y0 + y1) / 2, (x1 - x0) / 2, (y1 - y0) / 2, math.cos(turn), math.sin(turn), z0, z1,
                             int(stock.shape == CYLINDER), 0)


def _tools(tools):
    table = np.zeros(len(tools), TOOL)
    for row, tool in zip(table, tools):
        row["radius"], row["corner"] = tool.shape.diameter / 2, min(tool.shape.corner_radius, tool.shape.diameter / 2)
        row["half_angle"] = math.radians(tool.shape.tip_angle) / 2
    return table


def too_deep(program, geometry, cell, over):
    """[Witness] of a Program: places where a feed move cuts deeper than the flutes are long, and `over` (mm).

    No contact is missed but stock thinner than CHIP_PROOF_SKIN at the tool's side, or smaller than CHIP_PROOF_LEAST.
    Raises Unreadable, MemoryError.
    """
    result = []
    for number, stock in enumerate(_stocks(program, geometry, cell, over)):
        moves, index = _moves(program, stock)
        if not (moves["limit"] < UNLIMITED).any():
            continue
        shape, tools = _shape(stock.map), _tools(stock.tools)
        wide = max(1e-3, (stock.map.nx * stock.map.cell) * (stock.map.ny * stock.map.cell))
        own = max(float(tools["radius"].min()) * 2 / CELLS_ACROSS, math.sqrt(wide / MOST_CELLS))
        found, squares = np.zeros(ROOM, FOUND), C.c_int64(SQUARES)
        count = library().chip_prove_depths(C.byref(shape), tools.ctypes.data, len(tools), moves.ctypes.data, len(moves), own,
                                            C.addressof(squares), found.ctypes.data, ROOM)
        if count < 0:
            raise MemoryError
        if squares.value <= 0 and not count:
            raise Unreadable("the depth of the cuts cannot be proved, there are too many walls", "rewrite the program in parts",
                             int(program.line[index[-1]]))
        for one in _deepest(found[:count], moves):
            move = int(one["move"])
            begin, end = moves["from"][move], moves["to"][move]
            place = begin + one["at"] * (end - begin)
            result.append(Witness(number, float(one["x"]), float(one["y"]), float(one["height"] - place[2]), stock.tools[moves["tool"][move]],
                                  int(program.line[index[move]]), tuple(place.tolist())))
    return result


def _deepest(found, moves):
    """ProofFound records: MOST of them, those that are deepest over their limits, in their order."""
    if len(found) <= MOST:
        return found
    own = moves[found["move"]]
    tip = own["from"][:, 2] + found["at"] * (own["to"][:, 2] - own["from"][:, 2])
    over = found["height"] - tip - own["limit"]
    return found[np.sort(np.argpartition(-over, MOST)[:MOST])]


def with_needles(needles, found):
    """{number of the stock: places (n, 2)} with those of Witnesses besides; of places nearer than APART_MM one stays."""
    result = dict(needles)
    for number in {witness.stock for witness in found}:
        places = np.array([(w.x, w.y) for w in found if w.stock == number])
        if number in needles:
            places = np.concatenate((needles[number], places))
        _, kept = np.unique(np.round(places / APART_MM), axis=0, return_index=True)
        result[number] = places[np.sort(kept)]
    return result
