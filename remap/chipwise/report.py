"""What the cycles did, for a program that watches a run.

A cycle calls record('hole', chopped=True, largest_piece_mm=7.5); the line goes
to the file named by the environment variable CHIPWISE_REPORT, one JSON object
per line; in a headless run (CHIPWISE_PROGRAM is set) without that variable to
a file in HOME; where chipwise-display runs (begin() .. end()) to a file in HOME, which it reads at the end of each
program; else nowhere.  Called by remap/ while the task reads ahead
(`self.task == 1`), never in the preview; read by bin/chipwise-headless.
"""

import json
import os

VARIABLE = 'CHIPWISE_REPORT'
HEADLESS = 'CHIPWISE_PROGRAM'
DEFAULT = '~/.chipwise-report.jsonl'
DISPLAY = '~/.chipwise-display.jsonl'     # is there while a display wants it
LARGEST = 1 << 20      # bytes of it


def place():
    """-> path of the report, or None where nobody wants one."""
    path = os.environ.get(VARIABLE)
    if not path and os.environ.get(HEADLESS):
        path = os.path.expanduser(DEFAULT)
    if not path and os.path.isfile(os.path.expanduser(DISPLAY)):
        path = os.path.expanduser(DISPLAY)
    return path or None


def begin():
    """A display wants to know from now on."""
    try:
        with open(os.path.expanduser(DISPLAY), 'w'):
            pass
    except OSError:
        pass


def end():
    """Nobody wants to know any more."""
    try:
        os.unlink(os.path.expanduser(DISPLAY))
    except OSError:
        pass


def record(kind, **figures):
    """Append one line; a report that cannot be written never stops a cycle."""
    path = place()
    if path is None:
        return
    try:
        line = json.dumps(dict(figures, kind=kind), default=str) + '\n'
        handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            if os.fstat(handle).st_size < LARGEST:
                os.write(handle, line.encode())
        finally:
            os.close(handle)
    except (OSError, TypeError, ValueError):
        pass


def read(path):
    """-> list of the dicts recorded in a file; [] where there is none, or for None."""
    if path is None:
        return []
    try:
        with open(path) as handle:
            return [json.loads(line) for line in handle if line.strip()]
    except FileNotFoundError:
        return []
