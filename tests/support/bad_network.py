# SPDX-License-Identifier: GPL-2.0-or-later
"""A network between two sandboxes that loses, doubles, delays (so reorders) and damages datagrams, seeded.

Each sandbox has a network of its own and lends a socket of it (lend_socket): what arrives at the first one goes out of
the second.
"""

import collections
import random
import select
import socket
import threading
import time


class BadNetwork(threading.Thread):
    """Carries from the socket lent at `folder`/in to `port` of the sandbox whose socket is lent at `folder`/out; shares
    of the datagrams are 0..1.  counts: what it has done."""

    def __init__(self, folder, port, seed, lost=0.0, doubled=0.0, delayed=0.0, damaged=0.0, delay_s=0.005):
        super().__init__(daemon=True)
        self.lenders = {}
        for name in ("in", "out"):
            self.lenders[name] = socket.socket(socket.AF_UNIX)
            self.lenders[name].bind(str(folder / name))
            (folder / name).chmod(0o777)
            self.lenders[name].listen()
        self.to, self.random, self.delay_s = ("127.0.0.1", port), random.Random(seed), delay_s
        self.shares = dict(lost=lost, doubled=doubled, delayed=delayed, damaged=damaged)
        self.counts, self.waiting, self.ends = collections.Counter(), [], False

    def lent(self, name):
        """The socket that a sandbox lends; None if the test has ended before."""
        while not self.ends:
            if select.select([self.lenders[name]], [], [], 0.1)[0]:
                with self.lenders[name].accept()[0] as lender:
                    return socket.socket(fileno=socket.recv_fds(lender, 1, 1)[1][0])
        return None

    def run(self):
        came_in, goes_out = self.lent("in"), self.lent("out")
        while not self.ends:
            if select.select([came_in], [], [], 0.001)[0]:
                self.carry(came_in.recv(4096), goes_out)
            while self.waiting and self.waiting[0][0] < time.monotonic():
                goes_out.sendto(self.waiting.pop(0)[1], self.to)

    def carry(self, datagram, goes_out):
        self.counts["all"] += 1
        done = {name for name, share in self.shares.items() if self.random.random() < share}
        self.counts.update(done)
        if "lost" in done:
            return
        if "damaged" in done:
            place = self.random.randrange(len(datagram))
            datagram = datagram[:place] + bytes([datagram[place] ^ 16]) + datagram[place + 1 :]
        if "delayed" in done:
            self.waiting.append((time.monotonic() + self.delay_s, datagram))
        else:
            for _ in range(2 if "doubled" in done else 1):
                goes_out.sendto(datagram, self.to)
