# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise_inputs: other components' pins, read wherever they are connected.

A streamer's pins under the names of motion's replace motion. Row k of it has the value k (or what is made of k) in
every pin; while the rows pass, other HAL lines connect and disconnect the pins.
"""

import numpy as np
import pytest

from support import halrig

ROWS = 4000
HOLD = 1  # periods a value may be kept when its pin is connected
TURN_AT, BACK_AT, DEFINE_AT = 500, 1500, 2500
PINS = {  # pin of motion: (streamer's type, output of chipwise-inputs.0)
    "axis.x.pos-cmd": ("f", "pos-x"),
    "axis.y.pos-cmd": ("f", "pos-y"),
    "axis.z.pos-cmd": ("f", "pos-z"),
    "motion.tooloffset.x": ("f", "tool-offset-x"),
    "motion.tooloffset.y": ("f", "tool-offset-y"),
    "motion.tooloffset.z": ("f", "tool-offset-z"),
    "motion.distance-to-go": ("f", "distance-to-go"),
    "motion.requested-vel": ("f", "requested-vel"),
    "motion.current-vel": ("f", "current-vel"),
    "spindle.0.speed-out-rps": ("f", "spindle-speed"),
    "motion.motion-type": ("s", "motion-type"),
    "motion.program-line": ("s", "program-line"),
    "motion.coord-mode": ("b", "coord-mode"),
    "spindle.0.index-enable": ("b", "index-enable"),
    "motion.motion-enabled": ("b", "motion-enabled"),
}
NAMES = list(PINS)
CONNECT = ["axis.x.pos-cmd", "motion.tooloffset.z", "motion.motion-type", "motion.coord-mode"]
TIMES = 12  # each of these is connected and disconnected


def value(kind, row):
    return int(row // 7 % 2) if kind == "b" else int(row) if kind == "s" else 0.25 * row


def script(churn):
    kinds = "".join(kind for kind, _name in PINS.values())
    lines = [
        "loadrt threads name1=servo period1=1000000",
        f"loadrt streamer depth={ROWS + 100} cfg={kinds}fb",
        *(f"alias pin streamer.0.pin.{i} {pin}" for i, pin in enumerate(NAMES)),
        f"alias pin streamer.0.pin.{len(NAMES)} axis.a.pos-cmd",
        "loadrt chipwise_inputs",
        f"loadrt sampler depth={ROWS + 100} cfg={kinds}b",
        "addf streamer.0 servo",
        "addf chipwise-inputs.0 servo",
        "addf sampler.0 servo",
        *(
            f"net out-{i} chipwise-inputs.0.{name} => sampler.0.pin.{i}"
            for i, (_kind, name) in enumerate(PINS.values())
        ),
        f"net turned chipwise-inputs.0.turned => sampler.0.pin.{len(NAMES)}",
        f"net define streamer.0.pin.{len(NAMES) + 1} => chipwise-inputs.0.define",
        "loadusr -w halstreamer stimulus.txt",
        f"loadusr halsampler -c 0 -n {ROWS} trace.txt",
        "start",
    ]
    for i in range(TIMES if churn else 0):
        lines += [f"net theirs-{k}-{i} {pin}" for k, pin in enumerate(CONNECT)]
        lines += ["loadusr -w sleep 0.05"]
        lines += [f"unlinkp {pin}" for pin in CONNECT]
        lines += ["loadusr -w sleep 0.05"]
    return "\n".join(lines + ["loadusr -w sh ./wait"]) + "\n"


@pytest.fixture(scope="module")
def traces(tmp_path_factory):
    """{churn: array of rows}; column order as PINS, then turned."""
    found = {}
    for churn in (False, True):
        where = tmp_path_factory.mktemp("inputs")
        rows = []
        for k in range(ROWS):
            turned_axis = 30.0 if TURN_AT <= k < BACK_AT else 0.0
            rows.append(
                " ".join(repr(value(kind, k)) for kind, _name in PINS.values())
                + f" {turned_axis} {int(DEFINE_AT <= k < DEFINE_AT + 2)}\n"
            )
        (where / "stimulus.txt").write_text("".join(rows))
        (where / "wait").write_text(f"until [ $(wc -l <trace.txt) -ge {ROWS} ]; do sleep 0.1; done\n")
        (where / "test.hal").write_text(script(churn))
        done = halrig.halrun(["-f", "test.hal"], where)
        assert done.returncode == 0, done.stdout
        found[churn] = np.array(
            [[float(word) for word in line.split()] for line in (where / "trace.txt").read_text().splitlines()[:ROWS]]
        )
    return found


def stale_rows(trace, column, kind):
    """How many rows are not of their period; each must be of HOLD periods before at most."""
    wanted = np.array([value(kind, k) for k in range(ROWS)], float)
    stale = np.flatnonzero(trace[:, column] != wanted)
    for row in stale:
        assert trace[row, column] in wanted[row - HOLD : row], (row, trace[row, column], wanted[row])
    return len(stale)


def test_every_input_is_motions_pin_of_the_same_period(traces):
    for column, (kind, name) in enumerate(PINS.values()):
        assert stale_rows(traces[False], column, kind) == 0, name


def test_pins_that_are_connected_meanwhile_are_followed(traces):
    """Both orders: connected before, after, and taken off again."""
    for column, (pin, (kind, name)) in enumerate(PINS.items()):
        stale = stale_rows(traces[True], column, kind)
        assert stale <= (2 * TIMES * HOLD if pin in CONNECT else 0), name


def test_the_checker_sees_an_old_value(traces):
    for rows, allowed in ((1, True), (2, False)):
        late = traces[False].copy()
        late[100 + rows - 1, 0] = late[99, 0]
        if allowed:
            assert stale_rows(late, 0, "f") == 1
        else:
            with pytest.raises(AssertionError):
                stale_rows(late, 0, "f")


@pytest.mark.parametrize("churn", [False, True])
def test_an_axis_beside_xyz_that_turns_is_said_until_the_stock_is_defined_again(traces, churn):
    """Also when it comes back: what was cut meanwhile is not in the map."""
    turned = traces[churn][:, -1]
    k = np.arange(ROWS)
    assert np.array_equal(turned, ((k >= TURN_AT) & (k < DEFINE_AT)).astype(float))


def test_a_machine_without_these_pins_reads_zeros(tmp_path):
    (tmp_path / "test.hal").write_text(
        f"loadrt threads name1=servo period1=1000000\nloadrt chipwise_inputs\naddf chipwise-inputs.0 servo\n"
        f"{halrig.COUNT_PERIODS}start\n"
        "loadusr -w sh $(SUPPORT)/wait_periods 4\ngetp chipwise-inputs.0.pos-x\ngetp chipwise-inputs.0.turned\n"
    )
    done = halrig.halrun(["-f", "test.hal"], tmp_path)
    assert done.returncode == 0, done.stdout
    assert [line for line in done.stdout.splitlines() if line in ("0", "FALSE")] == ["0", "FALSE"], done.stdout
