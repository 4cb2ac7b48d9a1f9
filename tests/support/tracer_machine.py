# SPDX-License-Identifier: GPL-2.0-or-later
"""configs/tracer.ini in the real LinuxCNC, with every servo period of the trace as a row.  Lengths in machine units
(mm)."""

import numpy as np

from support import operate

# column of the record: pin
COLUMNS = {
    "state": "tracer.0.state",
    "follow": "tracer-offset.0.state",
    "fault": "tracer.0.fault-code",
    "astray_fault": "tracer-offset.0.fault-code",
    "x": "joint.0.pos-cmd",
    "y": "joint.1.pos-cmd",
    "z": "joint.2.pos-cmd",
    "offset_x": "axis.x.eoffset",
    "offset_y": "axis.y.eoffset",
    "offset_z": "axis.z.eoffset",
    "to_x": "tracer.0.pos-cmd-x",
    "to_z": "tracer.0.pos-cmd-z",
    "deflection": "tracer-model.0.true-deflection",
    "lead": "tracer-offset.0.lead",
    "behind": "tracer-offset.0.behind",
    "astray": "tracer-offset.0.astray",
    "in_contact": "tracer.0.in-contact",
    "ball_x": "tracer.0.ball-x",
    "ball_y": "tracer.0.ball-y",
    "ball_z": "tracer.0.ball-z",
}
LETTERS = {"state": "s", "follow": "s", "fault": "s", "astray_fault": "s", "in_contact": "b"}
DEPTH = 400000  # periods the sampler keeps: the whole session


def sampler(path):
    """A HAL file whose halsampler writes the columns to `path`; pins that have a signal are taken from it."""
    signals = {
        "x": "tracer-true-x",
        "y": "tracer-true-y",
        "z": "tracer-true-z",
        "offset_x": "tracer-offset-x",
        "offset_y": "tracer-offset-y",
        "offset_z": "tracer-offset-z",
        "to_x": "tracer-to-x",
        "to_z": "tracer-to-z",
    }
    lines = [f"loadrt sampler depth={DEPTH} cfg={''.join(LETTERS.get(name, 'f') for name in COLUMNS)}"]
    for k, (name, pin) in enumerate(COLUMNS.items()):
        lines.append(f"net {signals.get(name, f'sampled-{k}')} {'' if name in signals else pin} sampler.0.pin.{k}")
    return "\n".join([*lines, "addf sampler.0 servo-thread", f"loadusr halsampler {path}", ""])


def rows_of(path):
    """(n,) structured array of what halsampler has written."""
    wide = len(COLUMNS)
    text = [line.split() for line in path.read_text().splitlines()]
    assert not any("overrun" in line for line in text), "the sampler has lost periods"
    rows = [tuple(float(word) for word in line) for line in text[:-1] if len(line) == wide]
    return np.array(rows, dtype=[(name, float) for name in COLUMNS])


def trace(tmp_path, steps, settings=None, hal="", **options):
    """Homes and does the steps (operate.py); settings: {(section, key): value} of tracer.ini, hal: more lines at the
    end.
    -> (answers, rows)"""
    record = tmp_path / "trace.log"
    (tmp_path / "sampler.hal").write_text(hal + sampler(record))
    edits = [f"/^HALFILE = .*head_sim/a HALFILE = {tmp_path}/sampler.hal"]
    edits += [
        f"/^.{section}.$/,/^$/s#^{key} = .*#{key} = {value}#" for (section, key), value in (settings or {}).items()
    ]
    answers = operate.operate(tmp_path, steps, ini="tracer.ini", edit="' -e '".join(edits), **options)
    return answers, rows_of(record)
