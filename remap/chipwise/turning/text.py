# SPDX-License-Identifier: GPL-2.0-or-later
"""A plan as the operator reads it, and as data.  Called by cli/turn.py and g26_plan.py."""

from collections.abc import Iterator

from chipwise.turning.blocks import feed_of, spindle_line
from chipwise.turning.plan import Plan, total_length
from chipwise.turning.request import Request
from chipwise.turning.times import Times

NOTHING = "nothing to do: the blank is the part"


def report(plan: Plan, request: Request, spent: Times) -> Iterator[str]:
    """Lines of text; lengths in program units, X as the program gives it.  spent: times.Times."""
    scale, unit = 1.0 / request.scale, request.unit
    for number, step in enumerate(plan.steps, 1):
        if not step.needed:
            yield f"{number:2} {step.name:15} not needed: {step.why}"
            continue
        yield f"{number:2} {step.name:15} T{step.used_tool.number}  {step.why}"
        yield (
            f"{'':18} {step.direction}, Z{step.z1 * scale:.3f} to Z{step.z0 * scale:.3f}; feed "
            f"{total_length([step]) * scale:.1f} {unit}, "
            f"{spent.steps[number - 1]:.1f} s, removes {step.removed * scale**2:.4g} {unit}2, "
            f"{spindle_line(request, step)} F{feed_of(step, request) * scale:.4g}"
        )
        if step.transverse:
            yield f"{'':18} transverse: " + ", ".join(
                f"Z{z1 * scale:.3f} to Z{z0 * scale:.3f}" for z0, z1 in step.transverse
            )
    needed = [s for s in plan.steps if s.needed]
    if not needed:
        yield NOTHING
    yield (
        f"{len(needed)} of {len(plan.steps)} steps, feed {total_length(needed) * scale:.1f} {unit}, "
        f"{spent.total:.1f} s" + _apart(spent)
    )
    yield f"residue: {len(plan.residue)}" + (
        f", {_area(sum(r.area for r in plan.residue), request)}" if plan.residue else ""
    )
    for r in plan.residue:
        lines = ("line " if len(r.lines) == 1 else "lines ") + ", ".join(map(str, r.lines)) if r.lines else "no line"
        yield (
            f"   {'inside' if r.inside else 'outside'} Z{r.z1 * scale:.3f} to Z{r.z0 * scale:.3f}  "
            f"{_area(r.area, request)}  "
            f"{r.height * scale:.3f} {unit} at most  {lines}"
        )


def _area(mm2: float, request: Request) -> str:
    """An area in the program's unit: 0.0001 mm2, and as fine in inch."""
    return f"{mm2:.4f} mm2" if request.unit == "mm" else f"{mm2 / request.scale**2:.7f} in2"


def _apart(spent: Times) -> str:
    """Text for what the time does not have."""
    if not spent.changes:
        return ""
    changes = f"{spent.changes} tool change" + "s" * (spent.changes > 1)
    return f"; without {changes}" + ("" if spent.travel is not None else " and the travel to them")


def summary(plan: Plan, request: Request, spent: Times) -> str:
    """One line: the needed steps, their time and what stays.  spent: times.Times."""
    needed = [(n, s) for n, s in enumerate(plan.steps, 1) if s.needed]
    if not needed:
        return NOTHING
    area = sum(r.area for r in plan.residue) / request.scale**2
    return (
        ", ".join(f"{n} {s.name} T{s.used_tool.number}" for n, s in needed)
        + f"; {spent.total:.0f} s{_apart(spent)}"
        + (f"; {area:.4g} {request.unit}2 stay" if plan.residue else "")
    )


def data(plan: Plan, request: Request, spent: Times) -> dict[str, object]:
    """Plan for --json: lengths mm, areas mm2, times s; feeds mm a minute or a revolution."""
    return {
        "time_s": spent.total,
        "tool_changes": spent.changes,
        "travel_s": spent.travel,
        "steps": [
            {
                "number": n,
                "name": s.name,
                "needed": s.needed,
                "why": s.why,
                "tool": s.used_tool.number if s.needed else None,
                "direction": s.direction,
                "z": [s.z0, s.z1] if s.needed else None,
                "transverse": [list(r) for r in s.transverse],
                "feed_length_mm": total_length([s]),
                "spindle": spindle_line(request, s) if s.needed else "",
                "feed": feed_of(s, request) if s.needed else 0.0,
                "time_s": spent.steps[n - 1],
                "removed_mm2": s.removed,
            }
            for n, s in enumerate(plan.steps, 1)
        ],
        "residue": [
            {
                "z": [r.z0, r.z1],
                "area_mm2": r.area,
                "height_mm": r.height,
                "side": "inside" if r.inside else "outside",
                "lines": list(r.lines),
            }
            for r in plan.residue
        ],
    }
