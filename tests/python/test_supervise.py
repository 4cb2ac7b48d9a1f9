"""The parent of chipwise-monitor (cli/supervise.py) as a process of its own: stopped and going on, asked to end."""

import os
import signal
import subprocess
import sys
import time

import pytest

WORK = '''
import sys, time
from chipwise.cli.supervise import Supervisor
def work(reason):
    print("work", reason, flush=True)
    while True:
        time.sleep(0.02)
Supervisor(work, time.monotonic).run()
print("end", flush=True)
'''
LONGER_S = 1.5      # than chipwise.cli.supervise.LOOK_S


@pytest.fixture
def parent():
    root = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'remap')
    with subprocess.Popen([sys.executable, '-c', WORK], env=dict(os.environ, PYTHONPATH=root), text=True, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == 'work \n'
        yield process
        process.kill()


@pytest.mark.parametrize('moment', [0.0, 0.1, 0.3])
def test_stopped_for_longer_than_it_waits_for_a_signal(parent, moment):
    """SIGSTOP and SIGCONT are no reason to end, whenever they come."""
    time.sleep(moment)
    parent.send_signal(signal.SIGSTOP)
    time.sleep(LONGER_S)
    parent.send_signal(signal.SIGCONT)
    with pytest.raises(subprocess.TimeoutExpired):
        parent.wait(0.5)
    parent.send_signal(signal.SIGTERM)
    assert parent.wait(20) == 0 and parent.stdout.read() == 'end\n'
