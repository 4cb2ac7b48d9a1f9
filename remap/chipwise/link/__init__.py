# SPDX-License-Identifier: GPL-2.0-or-later
"""Packets of a master for tracer_slave(9), from one HAL to another by UDP.

    packets.py      a row of HAL <-> a datagram with a tag of the key
    reception.py    which datagrams go on to the slave
    key.py          the key, from the INI file
    transport.py    the two loops, between HAL's streams and a socket

Realtime code makes no system calls: on the master's side LinuxCNC's sampler keeps a row of each servo period, on the
slave's streamer puts one on the pins in each period.  Called by cli/link.py.
"""
