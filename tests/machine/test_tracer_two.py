# SPDX-License-Identifier: GPL-2.0-or-later
"""Two whole LinuxCNCs, each in a sandbox: configs/tracer_slave.ini follows what configs/tracer.ini traces, mirrored,
through a network that loses, doubles, delays and damages datagrams.  The master's packets then end while it moves.

Both write a row for every servo period; rows belong together by the number of the packet.
"""

import threading

import numpy as np
import pytest

from support import ROOT, halrig, operate
from support.bad_network import BadNetwork
from support.random_cases import random_seed

pytestmark = pytest.mark.machine

LENT, PORT = 7134, 7135  # of the loopback of each sandbox
PER_MM = 100000  # counts of the HAL files
# A busy computer has pauses of up to 28 s, and does the periods of a pause at once behind it: packets that nobody
# fetches meanwhile are lost, more than 2 mm of travel in a row, and a slave without packets for so long would be dead.
# So dead-periods is DEAD_PERIODS only from the sender's end on.
WAITING, AWAKE_PERIODS, DEAD_PERIODS = 10000, 1000000, 6000
BEHIND = 100 * PER_MM
PERIOD_S, A_MM_S2 = 0.001, 500.0  # MAX_ACCELERATION x OFFSET_AV_RATIO of both
# a slave that catches up while the master turns back leaves its place by (2 x 15 mm/s)^2 / 2 A: within max-behind of
# tracer-offset, 1 mm
FEED_MM_S, FASTEST_MM_S, CATCH_UP_MM_S = 8.0, 10.0, 5.0
FOLLOW, DEAD, NO_MASTER, HOLD = 1, 4, 4, 0  # states of tracer-offset and tracer-slave, fault-code of the slave
TRACE, BACK, FOLLOWING = (
    (ROOT / "nc_files/tracer" / name).read_text() for name in ("trace.ngc", "back.ngc", "follow.ngc")
)
MASTER = {
    "number": "tracer.0.sequence",
    "low_x": "tracer.0.count-low-0",
    "high_x": "tracer.0.count-high-0",
    "low_y": "tracer.0.count-low-1",
    "high_y": "tracer.0.count-high-1",
    "low_z": "tracer.0.count-low-2",
    "high_z": "tracer.0.count-high-2",
    "follow": "tracer-offset.0.state",
}
SLAVE = {
    "number": "tracer-slave.0.sequence",
    "state": "tracer-slave.0.state",
    "follow": "tracer-offset.0.state",
    "to_x": "tracer-slave.0.pos-x",
    "to_y": "tracer-slave.0.pos-y",
    "to_z": "tracer-slave.0.pos-z",
    "x": "joint.0.pos-cmd",
    "y": "joint.1.pos-cmd",
    "z": "joint.2.pos-cmd",
    "missing": "tracer-offset.0.behind",
    "silent": "silent",
}
SIGNALS = {
    "tracer-slave.0.sequence": "tracer-number",
    "tracer-slave.0.pos-x": "tracer-to-x",
    "tracer-slave.0.pos-y": "tracer-to-y",
    "tracer-slave.0.pos-z": "tracer-to-z",
    "silent": "tracer-silent",
}  # the last one is set by hand
OFF_PLACE = "tracer-offset.0.off"  # a busy task may begin a program later than "finish" waits for it
UNSIGNED, SIGNED = ("number", "low_x", "low_y", "low_z"), ("high_x", "high_y", "high_z", "state", "follow")
MIRROR = np.array([-1.0, 1.0, 1.0])


def recorder(columns, path, channel, signals):
    """(cfg= of a sampler, HAL lines) that write the columns to a file; `signals`: names of pins that have one."""
    letters = "".join("u" if name in UNSIGNED else "s" if name in SIGNED else "f" for name in columns)
    lines = [
        f"net {signals.get(pin, f'seen-{k}')} {'' if pin in signals else pin} sampler.{channel}.pin.{k}"
        for k, (name, pin) in enumerate(columns.items())
    ]
    return letters, [*lines, f"addf sampler.{channel} servo-thread", f"loadusr halsampler -c {channel} {path}"]


def rows_of(path, columns):
    text = [line.split() for line in path.read_text().splitlines()]
    assert not any("overrun" in line for line in text), "the sampler has lost periods"
    rows = [tuple(float(word) for word in line) for line in text[:-1] if len(line) == len(columns)]
    return np.array(rows, dtype=[(name, float) for name in columns])


def files(folder):
    """The HAL files of both: those of hal/ with sockets that the network between the sandboxes has, and with
    recorders."""
    lend = f"loadusr -w /usr/bin/python3 {halrig.SUPPORT}/lend_socket {folder}/{{}} {LENT}\n"
    master, slave = ((ROOT / "hal" / f"tracer_link_{name}.hal").read_text() for name in ("master", "slave"))
    known = {pin: name for name, pin in (line.split()[1:3] for line in master.splitlines() if line.startswith("net "))}
    letters, lines = recorder(MASTER, folder / "master.log", 1, known)
    master = master.replace("depth=1000 cfg=uuuussssss", f"depth=1000,200000 cfg=uuuussssss,{letters}").replace(
        "loadusr -Wn", lend.format("in") + "loadusr -Wn"
    )
    (folder / "master.hal").write_text("\n".join([master, *lines, ""]))
    slave = (
        slave.replace("depth=300", f"depth={WAITING + 100}")
        .replace("--waiting 200", f"--waiting {WAITING}")
        .replace("loadusr -Wn", lend.format("out") + "loadusr -Wn")
    )
    (folder / "slave.hal").write_text(
        slave + f"setp tracer-slave.0.dead-periods {AWAKE_PERIODS}\nsetp tracer-slave.0.max-behind {BEHIND}\n"
        f"setp tracer-slave.0.catch-up {CATCH_UP_MM_S * PERIOD_S * PER_MM:.0f}\n"
    )
    letters, lines = recorder(SLAVE, folder / "slave.log", 0, SIGNALS)
    (folder / "slave_seen.hal").write_text("\n".join([f"loadrt sampler depth=400000 cfg={letters}", *lines, ""]))


# the slave begins where the master rests; the master traces two lines, is aborted, rests, goes back, rests, and traces
# again until its packets end
WAIT = "for i in $(seq 2000); do [ -e {{0}}/{} ] && exit 0; sleep 0.1; done; exit 1"
# the slave follows the place where the master rests: it has got its last packet, or a later one; the last line of the
# log may not be complete
CAUGHT_UP = (
    "n=$(halcmd getp tracer.0.sequence); for i in $(seq 2000); do tail -n 2 {0}/slave.log | head -n 1 | awk -v n=$n "
    "'{exit !($1 >= n && $2 == 2)}' && sleep 1"
    " && exit 0; sleep 0.1; done; exit 1"
)
MASTER_STEPS = [
    ["mdi", "G53 G0 X50 Y46 Z12"],
    ["pins", "tracer.0.sequence"],
    ["program", "touch", "{0}/ready"],
    ["program", "sh", "-c", WAIT.format("there")],
    ["start", TRACE],
    ["until", "tracer.0.lines", ">", 1],
    ["abort"],
    ["sleep", 3],
    ["pins", "tracer.0.sequence"],
    ["program", "sh", "-c", CAUGHT_UP],
    ["start", BACK],
    ["until", OFF_PLACE, "=", 0],
    ["finish"],
    ["sleep", 2],
    ["pins", "tracer.0.sequence"],
    ["program", "sh", "-c", CAUGHT_UP],
    ["start", TRACE],
    ["until", "tracer.0.lines", "=", 0],
    ["until", "tracer.0.lines", ">", 0],
    ["sleep", 0.3],
    ["program", "pkill", "-9", "-f", "[c]hipwise link send"],
    ["program", "touch", "{0}/silent"],
    ["sleep", 1],
    ["abort"],
]
SLAVE_STEPS = [
    ["mdi", "G53 G0 X200 Y60 Z30"],
    ["program", "sh", "-c", WAIT.format("ready")],
    ["start", FOLLOWING],
    ["until", "tracer-slave.0.state", "=", 2],
    ["program", "touch", "{0}/there"],
    ["program", "sh", "-c", WAIT.format("silent")],
    ["program", "halcmd", "setp", "tracer-slave.0.dead-periods", str(DEAD_PERIODS)],
    ["program", "halcmd", "sets", "tracer-silent", "1"],
    ["finish"],
    ["sleep", 1],
    [
        "pins",
        "tracer-slave.0.last-fault",
        "tracer-slave.0.lost",
        "chipwise-link.passed",
        "chipwise-link.ignored",
        "chipwise-link.refused",
        "chipwise-link.dropped",
        "tracer-offset.0.state",
        "tracer-offset.0.last-fault",
    ],
    ["start", BACK],
    ["until", OFF_PLACE, "=", 0],
    ["finish"],
    ["position"],
]


def with_folder(steps, folder):
    return [
        [word.replace("{0}", str(folder)) if isinstance(word, str) and len(word) < 200 else word for word in step]
        for step in steps
    ]


def edits_of(folder):
    """{name: (INI file, steps, sed's commands for it)} of both machines."""
    return {
        "master": (
            "tracer.ini",
            MASTER_STEPS,
            [
                f"/^HALFILE = .*head_sim/a HALFILE = {folder}/master.hal",
                f"$a [TRACER_LINK]\\nSLAVE = 127.0.0.1:{LENT}",
                f"s#^FEED = .*#FEED = {FEED_MM_S}#",
                f"s#^MAX_LINEAR_VELOCITY = .*#MAX_LINEAR_VELOCITY = {FASTEST_MM_S}#",
                f"s#^RETURN_VEL = .*#RETURN_VEL = {FASTEST_MM_S}#",
            ],
        ),
        "slave": (
            "tracer_slave.ini",
            SLAVE_STEPS,
            [
                f"s#^HALFILE = .*tracer_link_slave.*#HALFILE = {folder}/slave.hal#",
                f"s#^LISTEN = .*#LISTEN = 127.0.0.1:{PORT}#",
                f"/^HALFILE = .*tracer_offset/a HALFILE = {folder}/slave_seen.hal",
            ],
        ),
    }


@pytest.fixture(scope="module")
def followed(tmp_path_factory):
    """-> (answers of master and slave, their rows, the network)."""
    folder = tmp_path_factory.mktemp("two")
    folder.chmod(0o777)
    files(folder)
    network = BadNetwork(folder, PORT, random_seed(), lost=0.02, doubled=0.02, delayed=0.02, damaged=0.01)
    network.start()
    edits = edits_of(folder)
    done = {}

    def run(name):
        ini, steps, edit = edits[name]
        own = folder / (name + "_answers")
        own.mkdir()
        try:
            done[name] = operate.operate(own, with_folder(steps, folder), ini=ini, edit="' -e '".join(edit), speed=1)
        except operate.Stopped as stopped:
            done[name] = stopped

    both = [threading.Thread(target=run, args=(name,)) for name in edits]
    for one in both:
        one.start()
    for one in both:
        one.join()
    network.ends = True
    for name, answers in done.items():
        assert not isinstance(answers, operate.Stopped), (name, answers.answers, str(answers))
    return (
        done["master"],
        done["slave"],
        rows_of(folder / "master.log", MASTER),
        rows_of(folder / "slave.log", SLAVE),
        network,
    )


def counts_of(master):
    """{number of a packet: the master's counts (3,)}."""
    axes = [master["high_" + axis] * 2**32 + master["low_" + axis] for axis in "xyz"]
    return dict(zip(master["number"].astype(int).tolist(), np.column_stack(axes).astype(np.int64)))


def following(slave):
    """The rows from the first packet on until the slave has stopped."""
    begin = np.flatnonzero((slave["state"] == 2) | (slave["state"] == 3))
    return slave[begin[0] : begin[-1] + 1]


def three(rows, name=""):
    return np.column_stack([rows[name + axis] for axis in "xyz"])


@pytest.mark.together("two machines")
def test_the_network_was_bad(followed):
    _master, slave, _rows, _slave_rows, network = followed
    _fault, lost, passed, ignored, refused, dropped, *_offset = map(float, slave[10])
    print(
        f"{dict(network.counts)}; slave: {passed:.0f} passed, {lost:.0f} lost, {ignored:.0f} ignored, {refused:.0f} "
        f"refused"
    )
    assert network.counts["all"] > 8000 and lost > 100 and ignored > 50 and refused > 40 and dropped == 0


@pytest.mark.together("two machines")
def test_packets_cost_time_never_position(followed):
    """Where the slave follows it is at the master's counts of its packet, mirrored, to the count; while it catches up
    it is late, and nowhere else."""
    _master, _slave, master, slave, _network = followed
    counts, rows = counts_of(master), following(slave)
    zero = counts[int(rows["number"][0])]
    exact = rows["state"] == 2
    expected = np.array([counts[int(number)] - zero for number in rows["number"][exact]]) * MIRROR
    off = np.abs(three(rows[exact], "to_") * PER_MM - expected)
    print(
        f"{exact.sum()} periods that follow, {(~exact).sum()} that catch up; counts off {off.max():.3f}; travel "
        f"{np.ptp(expected, axis=0) / PER_MM} mm"
    )
    assert exact.sum() > 5000 and (~exact).sum() > 100 and off.max() < 0.01
    assert np.ptp(expected, axis=0).min() > 0.4 * PER_MM and np.ptp(expected[:, 0]) > 15 * PER_MM


@pytest.mark.together("two machines")
def test_at_rest_the_axes_are_where_the_master_is(followed):
    """After an abort of the master within a line, and after its return: machine coordinates of the slave's joints."""
    master_said, _slave, master, slave, _network = followed
    counts, rows = counts_of(master), following(slave)
    zero, start = counts[int(rows["number"][0])], three(rows)[0]
    places = []
    for answer in (master_said[8], master_said[14]):
        number = int(answer[0])
        caught_up = rows[(rows["number"] >= number) & (rows["state"] == 2)]
        away = [(counts[packet] != counts[number]).any() for packet in caught_up["number"].astype(int)]
        rest = caught_up[: away.index(True)]
        assert len(rest) > 100  # while the master rests; at first the axes still move
        row = rest[-1]
        places.append((counts[number] - zero) * MIRROR / PER_MM)
        off = np.abs(np.array([row[axis] for axis in "xyz"]) - start - places[-1]).max()
        print(f"at rest {places[-1]}: {off:.2e} mm off")
        assert off < 2e-5
    assert np.abs(places[0] - places[1]).max() > 1.0
    travelled = (
        counts[int(master_said[14][0])] - counts[int(master_said[1][0])]
    ) / PER_MM  # the first packet may be older: a late network keeps it
    assert travelled == pytest.approx([2, 1, -2], abs=1e-4)  # from X50 Y46 Z12 to where the trace began


@pytest.mark.together("two machines")
def test_the_axes_stay_near_the_masters_path(followed):
    """A slave that waits brakes with A, so it leaves its place by v^2 / 2 A at most; the path is the master's, but for
    what it has never heard of until it has caught up: where many packets in a row are lost it takes the short cut."""
    _master, _slave, master, slave, _network = followed
    counts, rows = counts_of(master), following(slave)
    zero, start = counts[int(rows["number"][0])], three(rows)[0]
    heard, arrived = np.unique(rows["number"].astype(int), return_index=True)
    settled = np.maximum.accumulate(np.where(rows["state"] == 2, np.arange(len(rows)), 0))[
        arrived[1:] - 1
    ]  # the last row that nothing was missing in
    lost = [
        sum(np.abs(counts[k + 1] - counts[k]).sum() for k in range(a, b)) if b - a > 1 else 0
        for a, b in zip(heard[:-1], heard[1:])
    ]
    unheard = np.bincount(settled, lost).max() / PER_MM
    path = np.array([place for number, place in sorted(counts.items()) if number >= rows["number"][0]])
    path = (path - zero) * MIRROR / PER_MM
    path = path[np.concatenate([[True], np.abs(np.diff(path, axis=0)).max(axis=1) > 0])]
    joints = three(rows)[::7] - start
    far = max(np.sqrt(((path - place) ** 2).sum(axis=1).min()) for place in joints)
    moved = np.abs(np.diff(three(rows), n=2, axis=0)).max() / PERIOD_S**2
    print(
        f"joints at most {far:.4f} mm off the master's path, {unheard:.4f} mm of it not heard of, acceleration at most "
        f"{moved:.0f} mm/s2"
    )
    assert far < (FASTEST_MM_S + CATCH_UP_MM_S) ** 2 / (2 * A_MM_S2) + unheard and moved < A_MM_S2 + 20


@pytest.mark.together("two machines")
def test_a_dead_master_stops_the_slave(followed):
    """The packets end while the master moves: the slave stops, its program says so, and back.ngc brings it back."""
    _master, said, master, slave, _network = followed
    fault, *_rest, offset, offset_fault = map(int, said[10])
    assert (fault, offset, offset_fault) == (NO_MASTER, HOLD, 0)
    assert any("the slave has stopped and rests where it is" in text for text in said[8]), said[8]
    end = np.flatnonzero(slave["state"] == DEAD)[0]
    last = int(slave["number"][end])
    news = np.flatnonzero(slave["number"] == last)[0]
    known = np.flatnonzero(slave["silent"])[0]  # from here on DEAD_PERIODS are in force, if not some periods before
    assert end - news >= DEAD_PERIODS and end <= max(news + DEAD_PERIODS, known) + 2, (end, news, known)
    counts = counts_of(master)
    assert (
        max(np.abs(place - counts[last]).max() for number, place in counts.items() if number > last) > PER_MM
    )  # the master went on
    place = three(slave)
    moving = np.flatnonzero(np.abs(place[news:end] - place[end]).max(axis=1) > 1e-5)  # 1e-5 is a count
    rests = news + (moving[-1] + 1 if len(moving) else 0)
    missing_s = np.abs(three(slave, "to_")[end] - three(slave, "to_")[news]).max() / CATCH_UP_MM_S
    assert rests - news < missing_s / PERIOD_S + 200 and np.abs(place[rests : end + 500] - place[end]).max() < 1.5e-5, (
        rests,
        news,
        end,
    )
    assert said[13] == [] and said[14] == pytest.approx([200, 60, 30], abs=1e-5)
