# SPDX-License-Identifier: GPL-2.0-or-later
"""A master and a slave in two sandboxes, each with a HAL of its own, and a bad network between them: the slave ends
where the master does, mirrored, and stops when the master has died."""

import re
import threading

import pytest

from support import ROOT, halrig
from support.bad_network import BadNetwork
from support.random_cases import random_seed

DONE, DEAD, NO_MASTER = 9, 4, 4  # states of tracer and tracer-slave, fault-code of the slave
DEAD_PERIODS = 8000  # a busy computer has pauses of more than 3000
ROWS = 20000  # of the sampler: the sender may have to wait as long
LENT, PORT = 7134, 7135  # of the loopback of each sandbox
LEND = "loadusr -w /usr/bin/python3 {support}/lend_socket {here}/{name} {port}\n"
SCRIPTS = {
    "until_there": "for i in $(seq 6000); do [ -e {here}/there ] && exit; sleep 0.05; done\n",
    "until_dead": "for i in 1 2; do sh {support}/wait_pin tracer-slave.0.state 4 | grep -q . || exit 0; done\n",
}
# The last packets come while the master rests, within the 5 s.
MASTER = """loadusr -w sh {here}/until_there
setp tracer.0.enable 1
loadusr -w sh {support}/wait_pin tracer.0.done TRUE
loadusr -w sleep 5
getp tracer.0.count-low-0
getp tracer.0.count-high-0
getp tracer.0.count-low-2
getp tracer.0.count-high-2
getp sampler.0.overruns
"""
SLAVE = """loadrt threads name1=servo-thread period1=1000000
{link}
setp tracer-slave.0.scale-0 -1
setp tracer-slave.0.dead-periods {periods}
setp tracer-slave.0.max-behind 1000000000
setp tracer-slave.0.enable 1
start
loadusr -w touch {here}/there
loadusr -w sh {here}/until_dead
getp tracer-slave.0.pos-x
getp tracer-slave.0.pos-z
getp tracer-slave.0.fault-code
getp tracer-slave.0.lost
getp chipwise-link.passed
getp chipwise-link.refused
"""


def values(done):
    """The numbers that getp has printed at the end."""
    return [float(line) for line in done.stdout.splitlines() if re.fullmatch(r"-?[0-9.e+-]+", line.strip())]


def link(name, address):
    """HAL file of the link with the address in the place of the INI file's, and with ROWS."""
    text = re.sub(r"\[TRACER_LINK\]\w+", f"127.0.0.1:{address}", (ROOT / "hal" / f"tracer_link_{name}.hal").read_text())
    assert "depth=1000 " in text or name == "slave"
    return text.replace("depth=1000 ", f"depth={ROWS} ")


def signed(low, high):
    return int(high) * 2**32 + int(low)


def put_files(folder):
    """HAL files of both machines, the first with the commands of docs/user/tracer.md, and their scripts."""
    words = dict(here=folder, support=halrig.SUPPORT)
    for name, text in SCRIPTS.items():
        (folder / name).write_text(text.format(**words))
    first = re.findall(r"(?ms)^```\n(.*?)^```", (ROOT / "docs/user/tracer.md").read_text())[0].replace(
        " servo\n", " servo-thread\n"
    )
    first = (
        first.replace("name1=servo ", "name1=servo-thread ")
        .replace("setp tracer.0.enable 1\n", "")
        .replace(
            "start\n",
            LEND.format(name="in", port=LENT, **words)
            + link("master", LENT).replace("depth=1000 ", "depth=50000 ")
            + "start\n",
        )
    )
    (folder / "master.hal").write_text(first + MASTER.format(**words))
    (folder / "slave.hal").write_text(
        SLAVE.format(
            link=LEND.format(name="out", port=LENT, **words) + link("slave", PORT), periods=DEAD_PERIODS, **words
        )
    )


@pytest.mark.xdist_group("hal_tracer_link")
def test_two_machines_and_a_bad_network(tmp_path):
    tmp_path.chmod(0o777)
    network = BadNetwork(tmp_path, PORT, random_seed(), lost=0.02, doubled=0.02, delayed=0.02, damaged=0.01)
    network.start()
    put_files(tmp_path)
    done = {}
    both = [
        threading.Thread(target=lambda name=name: done.update({name: halrig.halrun(["-f", name + ".hal"], tmp_path)}))
        for name in ("slave", "master")
    ]
    for one in both:
        one.start()
    for one in both:
        one.join()
    network.ends = True
    assert done["master"].returncode == 0 and done["slave"].returncode == 0, (
        done["master"].stdout + done["slave"].stdout
    )
    *_rest, low_x, high_x, low_z, high_z, overruns = values(done["master"])
    *_rest, x, z, fault, lost, passed, refused = values(done["slave"])
    print(
        f"{network.counts}; slave: {passed:.0f} packets, {lost:.0f} lost, {refused:.0f} refused; sampler lost "
        f"{overruns:.0f}"
    )
    assert (
        signed(low_x, high_x) != 0
        and round(x * 100000) == -signed(low_x, high_x)
        and round(z * 100000) == signed(low_z, high_z)
    )
    assert fault == NO_MASTER
    assert network.counts["all"] > 5000 and lost > 50 and refused > 20 and overruns == 0
