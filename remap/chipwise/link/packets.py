# SPDX-License-Identifier: GPL-2.0-or-later
"""A row of HAL and a datagram that only the owner of the key can make.

A row is what sampler and streamer have with TYPES: number, lower 32 bits of the three counts, upper 32 bits, three
steps (slave.h).  A datagram also has the session of the master, which is new at each start, and the challenge of the
slave, which is new for each session: so a recording of an older one is worth nothing. Without a key the tag is a check
against damage only.
"""

import hashlib
import hmac
import struct

TYPES = "uuuussssss"  # of the columns, as cfg= of sampler and streamer
MAGIC, ASK_MAGIC = b"CWL2", b"CWQ2"
HEAD = struct.Struct("!4s8s8s")  # magic, session, challenge
BODY = struct.Struct("!I3I3i3i")
TOKEN_BYTES, TAG_BYTES = 8, 16
NO_TOKEN = bytes(TOKEN_BYTES)
SIZE = HEAD.size + BODY.size + TAG_BYTES  # bytes of a datagram
ASK_SIZE = HEAD.size + TAG_BYTES  # bytes of a challenge: never more than what it answers


class Codec:
    """Packs and unpacks with a key; b'' without one."""

    def __init__(self, key=b""):
        self.key = key

    def _tag(self, text):
        return hmac.digest(self.key, text, hashlib.sha256)[:TAG_BYTES]

    def _opened(self, datagram, size, magic):
        """The text without its tag; None if it is not ours, or damaged."""
        text = datagram[:-TAG_BYTES]
        if (
            len(datagram) != size
            or text[:4] != magic
            or not hmac.compare_digest(self._tag(text), datagram[-TAG_BYTES:])
        ):
            return None
        return text

    def pack(self, row, session=NO_TOKEN, challenge=NO_TOKEN):
        """10 whole numbers -> bytes."""
        text = HEAD.pack(MAGIC, session, challenge) + BODY.pack(*row)
        return text + self._tag(text)

    def unpack(self, datagram):
        """bytes -> (10 whole numbers, session, challenge); None if it is not ours, or damaged."""
        text = self._opened(datagram, SIZE, MAGIC)
        if text is None:
            return None
        _magic, session, challenge = HEAD.unpack_from(text)
        return BODY.unpack_from(text, HEAD.size), session, challenge

    def ask(self, session, challenge):
        """The slave's challenge to a session, bytes."""
        text = HEAD.pack(ASK_MAGIC, session, challenge)
        return text + self._tag(text)

    def challenge(self, datagram, session):
        """bytes -> the challenge to this session; None if it is something else."""
        text = self._opened(datagram, ASK_SIZE, ASK_MAGIC)
        if text is None:
            return None
        _magic, to, challenge = HEAD.unpack(text)
        return challenge if to == session else None
