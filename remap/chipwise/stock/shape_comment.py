# SPDX-License-Identifier: GPL-2.0-or-later
"""Boxes and cylinders in a program's comments: WORKPIECE (glue/workpiece.py) and CLAMP (clamps/comment.py).

BOX,XMIN=..,YMIN=..,ZMIN=..,XMAX=..,YMAX=..,ZMAX=..
CYLINDER,AXIS=Z,X=..,Y=..,ZMIN=..,ZMAX=..,DIAMETER=..      AXIS may be left out
"""

import math

from chipwise.errors import CycleError
from chipwise.clib.layout import StockShape

BOX, CYLINDER = map(int, StockShape)
BOX_KEYS = ("XMIN", "YMIN", "ZMIN", "XMAX", "YMAX", "ZMAX")
CYLINDER_KEYS = ("X", "Y", "ZMIN", "ZMAX", "DIAMETER")


def _fields(text, name):
    """ "BOX,XMIN=0,.." -> ("BOX", {"XMIN": 0.0, ..})."""
    shape, _, rest = text.partition(",")
    fields = {}
    for part in filter(None, (piece.strip() for piece in rest.split(","))):
        key, equals, value = (piece.strip().upper() for piece in part.partition("="))
        if key == "AXIS":
            if value != "Z":
                raise CycleError("{name} comment: AXIS={value} is not Z", "use AXIS=Z", name=name, value=value)
            continue
        if key in fields:
            raise CycleError("{name} comment: {key} is given twice", "give it once", name=name, key=key)
        try:
            fields[key] = float(value)
            good = bool(equals) and math.isfinite(fields[key])
        except ValueError:
            good = False
        if not good:
            raise CycleError("{name} comment: {part} is not KEY=number", "correct the comment", name=name, part=part)
    return shape.strip().upper(), fields


def _need(fields, keys, shape, name):
    missing = [key for key in keys if key not in fields]
    unknown = [key for key in fields if key not in keys]
    if missing:
        raise CycleError(
            "{name} comment: {shape} lacks {keys}",
            f"{shape} needs {', '.join(keys)}",
            name=name,
            shape=shape,
            keys=", ".join(missing),
        )
    if unknown:
        raise CycleError(
            "{name} comment: {shape} has the unknown {keys}",
            f"{shape} needs {', '.join(keys)}",
            name=name,
            shape=shape,
            keys=", ".join(unknown),
        )
    return [fields[key] for key in keys]


def parse(text, name, thing):
    """Inside of a comment behind its name -> (low, high, shape) in its own units; of a cylinder the box around it.

    thing: what it describes, for the message.  Raises CycleError for an unknown shape, missing, unknown or unreadable
    keys, and for no extent.
    """
    shape, fields = _fields(text, name)
    if shape == "BOX":
        values = _need(fields, BOX_KEYS, shape, name)
        low, high = values[:3], values[3:]
    elif shape == "CYLINDER":
        x, y, z_low, z_high, diameter = _need(fields, CYLINDER_KEYS, shape, name)
        low, high = [x - diameter / 2, y - diameter / 2, z_low], [x + diameter / 2, y + diameter / 2, z_high]
    else:
        raise CycleError(
            "{name} comment: shape {shape} is unknown", "use BOX or CYLINDER", name=name, shape=shape or "(none)"
        )
    for axis, a, b in zip("XYZ", low, high):
        if not b > a:
            raise CycleError(
                f"{{name}} comment: the {thing} has no extent in {axis} ({a:g} to {b:g})",
                "give a maximum above the minimum",
                name=name,
            )
    return low, high, CYLINDER if shape == "CYLINDER" else BOX
