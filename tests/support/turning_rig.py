# SPDX-License-Identifier: GPL-2.0-or-later
"""Random turned parts planned with a tool table of their own.  Called by tests/turning and bench/bench_turning.py."""

from dataclasses import replace

from chipwise.turning import nc
from chipwise.turning.plan import make_plan
from chipwise.turning.read_part import job_of, make_order
from chipwise.turning.request import read_request
from chipwise.turning.state import ORDER
from chipwise.turning.state import Drive
from chipwise.turning.times import Motion
from support.turning_oracle import Insert
from support.turning_random import INSERTS

ROLES = {"rough": (1, 7), "finish": (2, 7), "drill": (5,)}
GEOMETRY = """
[lathe.1]
edge_length = 12
depth = 4
holder = [0, 25, 8]
[lathe.2]
edge_length = 11
depth = 2
holder = [0, 25, 10]
[lathe.5]
edge_length = 80
depth = 6
point_angle = 118
[lathe.7]
edge_length = 7
bar = 5
holder = [0.3, 60, 2]
"""


class Machine:
    """What make_order() needs of a machine."""

    ini, unit_mm, close_gap, motion, barrier_clearance, traverse_clearance, drive = (
        "",
        1.0,
        0.01,
        Motion(),
        0.0,
        0.2,
        Drive(),
    )

    def __init__(self, folder, insert):
        self.table, self.geometry = str(folder / "lathe.tbl"), str(folder / "tools.toml")
        front, back = INSERTS[insert]
        (folder / "tools.toml").write_text(GEOMETRY)
        (folder / "lathe.tbl").write_text(
            f"T1 P1 D0.8 I85 J5 Q2\nT2 P2 D0.8 I{front} J{back} Q2\nT5 P5 D12 Q7\nT7 P7 D0.4 I275 J328 Q3\n"
        )
        self.tools = {
            1: Insert(0.8, 85, 5, 2, (0, 25, 8)),
            2: Insert(0.8, front, back, 2, (0, 25, 10)),
            5: Insert(12, 0, 0, 7, point=118),
            7: Insert(0.4, 275, 328, 3, (0.3, 60, 2)),
        }


def planned(case, folder, clearance=0.0):
    """(plan, request, machine, G-code) of a case; clearance: mm from barriers."""
    (folder / "part.ngc").write_text(case.text)
    machine = Machine(folder, case.insert)
    machine.barrier_clearance = clearance
    request = read_request(case.text)
    request.roles = ROLES
    plan = make_plan(make_order(job_of(str(folder / "part.ngc"), request, machine), case.text, request, machine, ORDER))
    return plan, request, machine, nc.program(plan, request, "random")


def with_margins(tool):
    """The tool with the relief of its edges and the 0.2 mm that the holder keeps, above it and on a side that goes
    beyond the nose."""
    left, right, up = tool.holder
    nose = tool.d / 2
    return replace(tool, relief=2.0, holder=(left - 0.2 * (left < -nose), right + 0.2 * (right > nose), up - 0.2))
