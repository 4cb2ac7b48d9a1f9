# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise check and rewrite --scheduler: a real Dask cluster of two workers on this computer, and clusters that are
not there."""

import json
import os
import signal
import socket
import subprocess
import time

import pytest

from support import ROOT
from support.dask_rig import Cluster, installed, wait_for
from support.rewrite_rig import deep_program, make_machine, rewrite

pytestmark = pytest.mark.xdist_group("dask")

CHIPWISE = str(ROOT / "bin" / "chipwise")
HEAD = "G21 G90 G17 G40 G49 G80 G94\nM250 P0 Q0 R-20 I100 J60 K20\nT1 M6\nS8000 M3\nG0 X-10 Y30 Z5\nG0 Z-4\nF400\n"
BAD = 2
BOUND_S = 240.0  # of a command that cannot reach its cluster, on a busy computer; it waits for 30 s


@pytest.fixture(scope="module", autouse=True)
def dask():
    if not installed():
        pytest.skip("python3-distributed cannot be installed")


@pytest.fixture
def cluster(tmp_path):
    folder = tmp_path / "cluster"
    folder.mkdir()
    found = Cluster(folder)
    yield found
    found.close()


def programs(folder, count=8, moves=4000):
    """Programs of some seconds; one is bad."""
    folder.mkdir()
    for k in range(count):
        text = HEAD + "".join(f"G1 X{60 - n % 71} Y{20 + (n * (k + 3)) % 31}\n" for n in range(moves)) + "G0 Z5\nM2\n"
        (folder / f"p{k}.ngc").write_text(text.replace("G0 Z5", "G1 X@") if k == BAD else text)
    return folder


def checked(folder, out, *options, stdout=subprocess.PIPE):
    """A running command."""
    return subprocess.Popen(
        [CHIPWISE, "check", str(folder), "--json", str(out), *options],
        stdin=subprocess.DEVNULL,
        text=True,
        stdout=stdout,
        stderr=subprocess.PIPE,
    )


def test_the_same_results_with_a_worker_killed_in_mid_run(cluster, tmp_path):
    """Results come as they are ready; a lost worker delays; its process ends with it; one bad program stops nothing."""
    folder = programs(tmp_path / "programs")
    printed = tmp_path / "printed"
    with open(printed, "w") as file:
        command = checked(folder, tmp_path / "cluster.json", "--scheduler", cluster.address, stdout=file)
    wait_for(lambda: printed.read_text() or command.poll(), "the first result")
    victim = cluster.workers[0]
    had = wait_for(lambda: cluster.runners(victim), "a program on the first worker")
    victim.kill()
    _, errors = command.communicate(timeout=600)
    assert command.returncode == 2, errors
    wait_for(lambda: not any(os.path.exists(f"/proc/{pid}") for pid in had), "the end of the killed worker's process")
    local = checked(folder, tmp_path / "local.json", "--jobs", "2")
    said, _ = local.communicate(timeout=600)
    assert local.returncode == 2
    assert json.loads((tmp_path / "cluster.json").read_text()) == json.loads((tmp_path / "local.json").read_text())
    assert sorted(printed.read_text().splitlines()) == sorted(said.splitlines())
    assert [p["status"] for p in json.loads((tmp_path / "local.json").read_text())["programs"]].count(2) == 1


def test_a_program_whose_process_is_killed_is_named(cluster, tmp_path):
    folder = programs(tmp_path / "programs", count=4, moves=20000)
    command = checked(folder, tmp_path / "out.json", "--scheduler", cluster.address)
    pid = wait_for(lambda: [p for w in cluster.workers for p in cluster.runners(w)], "a program on a worker")[0]
    os.kill(pid, signal.SIGKILL)
    out, errors = command.communicate(timeout=600)
    assert command.returncode == 2, errors
    report = json.loads((tmp_path / "out.json").read_text())["programs"]
    killed = [p["error"] for p in report if p["error"] and "ended with status -9" in p["error"]]
    assert len(killed) == 1 and len(report) == 4 and sum(p["status"] < 2 for p in report) >= 2


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
def test_a_scheduler_that_is_gone_ends_the_command(cluster, tmp_path, how):
    """Killed, or alive without an answer."""
    folder = programs(tmp_path / "programs", count=4, moves=200000)
    command = checked(folder, tmp_path / "out.json", "--scheduler", cluster.address)
    wait_for(lambda: [p for w in cluster.workers for p in cluster.runners(w)], "a program on a worker")
    cluster.scheduler.send_signal(how)
    since = time.monotonic()
    _, errors = command.communicate(timeout=BOUND_S)
    print(f"{how.name}: {time.monotonic() - since:.0f} s")
    assert command.returncode == 2
    assert errors.splitlines()[-1].startswith("chipwise: check: the ") and cluster.address in errors


def test_a_cluster_without_workers_ends_the_command(tmp_path, monkeypatch):
    from chipwise.batch import cluster as product

    monkeypatch.setattr(product, "LOST_S", 3.0)
    monkeypatch.setattr(product, "PING_S", 0.5)
    found = Cluster(tmp_path, workers=0)
    try:
        with pytest.raises(product.ClusterError, match="has no worker for 3 s; start dask-worker"):
            list(product.on_cluster(found.address, "check", ["a.ngc"], {}, None))
    finally:
        found.close()


def test_no_scheduler_there(tmp_path):
    """Nothing listens; something listens and says nothing."""
    folder = programs(tmp_path / "programs", count=1, moves=3)
    with socket.create_server(("127.0.0.1", 0)) as silent, socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        for address in (f"tcp://127.0.0.1:{closed.getsockname()[1]}", f"tcp://127.0.0.1:{silent.getsockname()[1]}"):
            command = checked(folder, tmp_path / "out.json", "--scheduler", address)
            out, errors = command.communicate(timeout=BOUND_S)
            assert command.returncode == 2 and out == "", address
            assert errors.startswith(f"chipwise: check: no Dask scheduler answers at {address} within 10 s (")
            assert errors.endswith("start dask-scheduler, or correct the address\n") and errors.count("\n") == 1


@pytest.mark.parametrize("address", ["", "nonsense", "tcp://127.0.0.1", "tcp://127.0.0.1:port"])
def test_no_address(tmp_path, address):
    folder = programs(tmp_path / "programs", count=1, moves=3)
    _, errors = (command := checked(folder, tmp_path / "out.json", "--scheduler", address)).communicate(timeout=BOUND_S)
    assert command.returncode == 2 and errors.count("\n") == 1
    assert errors.endswith("is not the address of a Dask scheduler; use tcp://HOST:PORT\n")


def test_without_the_package(tmp_path):
    (tmp_path / "distributed").mkdir()
    (tmp_path / "distributed" / "__init__.py").write_text("raise ImportError('none')\n")
    folder = programs(tmp_path / "programs", count=1, moves=3)
    done = subprocess.run(
        [CHIPWISE, "check", str(folder), "--scheduler", "tcp://127.0.0.1:1"],
        text=True,
        capture_output=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        stdin=subprocess.DEVNULL,
        timeout=BOUND_S,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == (
        "chipwise: check: --scheduler needs Dask, which is not installed; apt-get install python3-distributed, "
        "or use --jobs\n"
    )
    done = subprocess.run(
        [CHIPWISE, "check", str(folder), "--scheduler", "tcp://127.0.0.1:1", "--jobs", "2"],
        text=True,
        capture_output=True,
        stdin=subprocess.DEVNULL,
        timeout=BOUND_S,
        check=False,
    )
    assert done.returncode == 2 and "--jobs counts processes of this computer" in done.stderr


def test_a_folder_is_rewritten_on_a_cluster(cluster, tmp_path):
    """The same files as with --jobs, with a worker killed in mid-run."""
    ini = make_machine(tmp_path / "mill")
    folder = tmp_path / "programs"
    folder.mkdir()
    for seed in (900, 902, 903, 905, 908):
        (folder / f"{seed}.ngc").write_text(deep_program(seed))
    command = subprocess.Popen(
        [
            CHIPWISE,
            "rewrite",
            str(folder),
            "-o",
            str(tmp_path / "far"),
            "--flute",
            "--ini",
            str(ini),
            "--scheduler",
            cluster.address,
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        text=True,
        stderr=subprocess.PIPE,
    )
    wait_for(lambda: cluster.runners(cluster.workers[0]) or command.poll() is not None, "a program on the first worker")
    cluster.workers[0].kill()
    _, errors = command.communicate(timeout=600)
    assert command.returncode == 0, errors
    here = rewrite(folder, tmp_path / "here", ini, "--flute", "--jobs", "2")
    assert here.status == 0, here.errors
    for seed in (900, 902, 903, 905, 908):
        assert (tmp_path / "far" / f"{seed}.ngc").read_bytes() == (tmp_path / "here" / f"{seed}.ngc").read_bytes()
