# SPDX-License-Identifier: GPL-2.0-or-later
"""Packets of a master that moves 8 counts in a period; its number wraps, its counts pass 2^32 in the first phase."""

from support.halrig import Stimulus

STEP = 8
START = 2**32 - 300  # counts: the upper half changes soon


class Scene(Stimulus):
    def __init__(self):
        super().__init__({name: [] for name in ("enable", "sequence", "check", "low", "high", "step")})
        self.number, self.counts, self.sent = 2**32 - 60, START, None

    def move(self, step=STEP):
        """The master's next packet."""
        self.number, self.counts = (self.number + 1) % 2**32, self.counts + step
        return {
            "enable": 1,
            "sequence": self.number,
            "check": self.number,
            "low": self.counts % 2**32,
            "high": self.counts >> 32,
            "step": step,
        }

    def send(self, packet, **changes):
        self.sent = {**packet, **changes}
        self.add(self.sent)


def stimulus():
    s = Scene()
    s.phase("off")
    for _ in range(10):
        s.send(s.move(0), enable=0)
    s.phase("even")
    s.send(s.move(0))
    for _ in range(100):
        s.send(s.move())
    s.phase("lost")
    s.move()
    s.send(s.sent)
    for _ in range(30):
        s.send(s.move())
    s.phase("doubled and old")
    old = s.sent
    for _ in range(5):
        s.send(s.move())
    for _ in range(5):
        s.send(s.sent)
    for _ in range(3):
        s.send(old)
    for _ in range(5):
        s.send(s.move())
    s.phase("being written")
    packet = s.move()
    s.send(packet, sequence=s.number - 1)
    s.send(packet)
    for _ in range(20):
        s.send(s.move(0))
    s.phase("dead")
    for _ in range(60):
        s.send(s.sent)
    s.phase("again")
    s.send(s.move(), enable=0)
    for _ in range(30):
        s.send(s.move(-STEP))
    s.phase("corrupt")
    s.send(s.move(), step=STEP + 1)
    for _ in range(200):
        s.send(s.move(0))
    return s
