# SPDX-License-Identifier: GPL-2.0-or-later
"""A row of HAL and a datagram, and which packets go on to the slave.

A row is what sampler and streamer have with TYPES: number, lower 32 bits of the three counts, upper 32 bits, three steps (slave.h).
"""
import struct
import zlib

TYPES = 'uuuussssss'                # of the columns, as cfg= of sampler and streamer
MAGIC = b'CWL1'
BODY = struct.Struct('!I3I3i3i')
HEAD = struct.Struct('!4sI')        # magic, CRC-32 of the body
SIZE = HEAD.size + BODY.size        # bytes of a datagram
SILENT_S = 1.0                      # a master that was silent for so long may have started anew: its number does not count


def pack(row):
    """10 whole numbers -> bytes."""
    body = BODY.pack(*row)
    return HEAD.pack(MAGIC, zlib.crc32(body)) + body


def unpack(datagram):
    """bytes -> 10 whole numbers; None if it is not one of ours, or damaged."""
    if len(datagram) != SIZE:
        return None
    magic, check = HEAD.unpack_from(datagram)
    body = datagram[HEAD.size:]
    return BODY.unpack(body) if magic == MAGIC and check == zlib.crc32(body) else None


class Order:
    """Lets each packet pass that is newer than all before; counts the others.

    The slave would ignore those too; here they would take a period of its streamer.
    """

    def __init__(self):
        self.newest, self.heard_s = None, float('-inf')
        self.ignored = 0

    def passes(self, number, now_s):
        """Whether a packet with this number goes on, at a time in s."""
        newer = self.newest is None or now_s - self.heard_s > SILENT_S or 0 < (number - self.newest) % 2 ** 32 < 2 ** 31
        self.heard_s = now_s
        if newer:
            self.newest = number
        else:
            self.ignored += 1
        return newer
