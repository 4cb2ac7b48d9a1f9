# SPDX-License-Identifier: GPL-2.0-or-later
"""Master and slave (slave.h): lag, packets that are lost, doubled, late or wrong, pulses, scaling.  Millions of periods
through a bad channel: test_slave.c."""

import ctypes as C
import math

import numpy as np
import pytest

from chipwise.clib import core, layout
from support.random_cases import random_count, random_seed

STATE, FAULT = layout.SlaveState, layout.SlaveFault
SETTINGS = dict(
    scale_numerator=(1, 1, 1),
    scale_divisor=(1, 1, 1),
    most_counts=30,
    catch_up_counts=3,
    max_behind_counts=1000,
    silence_periods=10,
    tick_count=40,
)


class Master:
    """Sends what its position in counts makes."""

    def __init__(self):
        self.master = layout.Master()
        self.at((0, 0, 0))

    def at(self, position, counts_per_mm=(100.0,) * 3):
        """-> packet of this period; position in mm"""
        core.library().chip_master_step(
            C.byref(self.master), (C.c_double * 3)(*position), (C.c_double * 3)(*counts_per_mm)
        )
        return layout.Packet.from_buffer_copy(self.master.packet)


class Slave:
    def __init__(self, first, **settings):
        self.settings, self.slave = layout.SlaveSettings(), layout.Slave()
        for name, value in {**SETTINGS, **settings}.items():
            if isinstance(value, tuple):
                getattr(self.settings, name)[:] = value
            else:
                setattr(self.settings, name, value)
        self.step(first, 0)

    def step(self, packet, enabled=1):
        """-> counts of this period"""
        core.library().chip_slave_step(C.byref(self.slave), C.byref(self.settings), C.byref(packet), enabled)
        return list(self.slave.step_counts)

    def pulses(self, parts=40):
        """(parts, 3) of this period"""
        pulse, all_ = (C.c_int * 3)(), []
        for _ in range(parts):
            core.library().chip_slave_pulse(C.byref(self.slave), pulse)
            all_.append(list(pulse))
        return np.array(all_)

    @property
    def position(self):
        return list(self.slave.position_counts)


def pair(**settings):
    master = Master()
    slave = Slave(layout.Packet.from_buffer_copy(master.master.packet), **settings)
    slave.step(master.at((0, 0, 0)))
    assert slave.slave.state_number == STATE.FOLLOW
    return master, slave


def test_one_period_behind():
    """Counts of a packet are done in its period: at its end the slave is where the master was at its beginning."""
    master, slave = pair()
    for k in range(1, 500):
        x = 5.0 * math.sin(k / 50)
        packet = master.at((x, -x, 0.1 * x))
        slave.step(packet)
        assert slave.position == list(packet.position_counts)
        assert slave.slave.state_number == STATE.FOLLOW
    assert packet.position_counts[0] == math.floor(100 * x + 0.5)


def test_a_lost_packet_costs_time():
    """The period without a packet rests, and what is missing follows at the catch-up rate."""
    master, slave = pair()
    packets = [master.at((0.1 * k, 0, 0)) for k in range(1, 20)]
    for k, packet in enumerate(packets, 1):
        if k != 10:
            assert slave.step(packet)[0] == (10 if k < 10 else 13 if k < 14 else 11 if k == 14 else 10), k
        else:
            assert slave.step(packets[k - 2])[0] == 0
    assert slave.position[0] == 190 and slave.slave.lost_packets == 1


def test_doubled_and_old_packets_change_nothing():
    master, slave = pair()
    packets = [master.at((0.1 * k, 0, 0)) for k in range(1, 6)]
    for packet in packets[:4]:
        slave.step(packet)
    for packet in (packets[3], packets[3], packets[1], packets[0]):
        assert slave.step(packet) == [0, 0, 0]
    slave.step(packets[4])
    assert slave.position[0] == 50 and slave.slave.ignored_packets == 2


def test_never_ahead_of_the_master():
    """A master that goes one direction, any loss: the slave is never beyond it, and gets there."""
    random = np.random.default_rng(random_seed())
    for _ in range(random_count(30)):
        (master, slave), x, loss = pair(), 0.0, random.uniform(0, 0.6)
        last = layout.Packet.from_buffer_copy(master.master.packet)
        for _ in range(300):
            x += 0.01 * random.integers(0, 13)
            packet = master.at((x, 0, 0))
            if random.random() > loss or slave.slave.silent_periods > 7:
                last = packet
            before = slave.position[0]
            slave.step(last)
            assert before <= slave.position[0] <= last.position_counts[0]
            if slave.slave.state_number == STATE.FAULT:
                pytest.fail("too far")
        for _ in range(400):
            slave.step(master.at((x, 0, 0)))
        assert slave.position[0] == round(100 * x) and slave.slave.state_number == STATE.FOLLOW


def test_a_dead_master_stops_it():
    master, slave = pair()
    packet = master.at((0.1, 0, 0))
    moved = [slave.step(packet)[0] for _ in range(30)]
    assert moved[0] == 10 and not any(moved[1:])
    assert slave.slave.state_number == STATE.DEAD and slave.slave.fault_number == FAULT.NO_MASTER
    assert slave.step(master.at((5, 0, 0))) == [0, 0, 0]
    slave.step(packet, 0)
    slave.step(master.at((6, 0, 0)))  # enabled again: where the master is now is the zero
    assert slave.step(master.at((6.1, 0, 0)))[0] == 10 and slave.position[0] == 20
    for periods in (1, 3, 50):
        master, slave = pair(silence_periods=periods)
        packet = master.at((0, 0, 0))
        slave.step(packet)
        count = 0
        while slave.slave.state_number != STATE.DEAD:
            slave.step(packet)
            count += 1
        assert count == periods


def test_a_wrong_packet_is_a_fault():
    for name in ("position_counts", "step_counts"):
        master, slave = pair()
        packet = master.at((0.1, 0, 0))
        getattr(packet, name)[0] += 1
        assert slave.step(packet) == [0, 0, 0]
        assert slave.slave.state_number == STATE.FAULT and slave.slave.fault_number == FAULT.CORRUPT


def test_too_much_missing_is_a_fault():
    master, slave = pair()
    master.at((20.0, 0, 0))
    slave.step(master.at((20.0, 0, 0)))
    assert slave.slave.fault_number == FAULT.TOO_FAR and slave.position[0] == 0


def test_the_slaves_own_acceleration():
    """A packet that claims 95,000 counts moves it by max-change more in each period; an honest master is followed to
    the count, losses included."""
    master, slave = pair(
        most_counts=100000, change_counts=50, catch_up_counts=1000, max_behind_counts=100000, tick_count=0
    )
    packet = master.at((0.2, 0, 0))
    assert slave.step(packet)[0] == 20
    packet.sequence_number += 1000
    packet.position_counts[0] += 95000
    packet.step_counts[0] = 95000
    done = [slave.step(packet)[0] for _ in range(5)]
    assert done[0] == 70 and all(b - a <= 50 for a, b in zip(done, done[1:]))
    for lost in (0, 7):
        master, slave = pair(
            most_counts=100000, change_counts=50, catch_up_counts=1000, max_behind_counts=100000, tick_count=0
        )
        x = v = 0.0
        for k in range(400):
            v = min(v + 0.4, 15.0) if k < 200 else max(v - 0.4, -15.0)
            x += v
            packet = master.at((x, 0, 0))
            if lost and k % 50 < lost:
                continue
            slave.step(packet)
            assert lost or slave.position[0] == packet.position_counts[0], k
        for _ in range(400):
            slave.step(master.at((x, 0, 0)))
        assert slave.position[0] == round(100 * x)


def test_a_reversal_brakes_first():
    master, slave = pair(
        most_counts=100000, change_counts=50, catch_up_counts=100000, max_behind_counts=10000000, tick_count=0
    )
    for k in range(1, 100):
        slave.step(master.at((0.4 * k * (k + 1) / 2, 0, 0)))
    packet, done = master.at((-5000.0, 0, 0)), []
    for _ in range(5):
        done.append(slave.step(packet)[0])
    assert done == [0, -50, -100, -150, -200], done


def test_scale_and_mirror():
    """Counts x scale / divisor, rounded down, after 5,000 random steps to and fro."""
    random = np.random.default_rng(random_seed())
    master, slave = pair(scale_numerator=(-1, 2, 254), scale_divisor=(1, 3, 1000))
    x = np.zeros(3)
    for step in random.integers(-15, 16, (5000, 3)):
        x = x + step / 100
        packet = master.at(x)
        slave.step(packet)
    counts = list(packet.position_counts)
    assert slave.position == [-counts[0], counts[1] * 2 // 3, counts[2] * 254 // 1000]


def test_pulses_are_even():
    """n pulses in 40 parts: exactly n, and no two gaps differ by more than one part, over the borders of periods
    too."""
    for n in (0, 1, 3, 7, 10, 13, 20, 29, -1, -7, -30):
        master, slave = pair()
        seen = []
        for k in range(1, 60):
            slave.step(master.at((n * k / 100, 0, 0)))
            seen.append(slave.pulses()[:, 0])
            assert seen[-1].sum() == n
        at = np.flatnonzero(np.concatenate(seen))
        assert n == 0 or np.ptp(np.diff(at)) <= 1


def test_parts_that_are_missing_come_later():
    """A faster thread that now and then has 38 or 41 parts in a period loses no pulse."""
    random = np.random.default_rng(random_seed())
    (master, slave), total = pair(), 0
    for k in range(1, 2000):
        slave.step(master.at((0.07 * k, 0, 0)))
        total += slave.pulses(int(random.choice([38, 40, 40, 41])))[:, 0].sum()
    for _ in range(3):
        slave.step(master.at((0.07 * k, 0, 0)))
        total += slave.pulses()[:, 0].sum()
    assert total == slave.position[0] == 7 * 1999


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300, 1e17])
def test_a_master_without_a_position_sends_nothing(value):
    master = Master()
    number = master.at((0, 0, 0)).sequence_number
    assert master.at((0, value, 0)).sequence_number == number
    assert master.at((0, 0, 0)).sequence_number == number + 1


def test_settings_that_cannot_be():
    for name, value in (
        ("scale_numerator", (0, 1, 1)),
        ("scale_divisor", (1, 0, 1)),
        ("most_counts", 0),
        ("catch_up_counts", 31),
        ("silence_periods", 0),
        ("tick_count", 30),
        ("max_behind_counts", 0),
    ):
        master = Master()
        slave = Slave(master.at((0, 0, 0)), **{name: value})
        assert slave.step(master.at((1, 1, 1))) == [0, 0, 0]
        assert slave.slave.fault_number == FAULT.SETTINGS, name
