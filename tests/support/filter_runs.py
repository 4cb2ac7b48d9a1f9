# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise filter run as a GUI does: `sh -c`, standard output in a file, standard error in a pipe.  Called by
tests/filter/test_filter.py and test_filter_ends.py."""

import os
import subprocess
from types import SimpleNamespace

from support import ROOT
from support.rewrite_rig import make_machine

COMMAND = f"{ROOT / 'bin' / 'chipwise'} filter"
PATIENCE_S = 120  # for what takes seconds on a machine that does nothing else
PIPE_BYTES = 65536


def mill_ini(tmp_path):
    """A mill whose filter has 60 s; more(lines) adds settings."""
    path = make_machine(tmp_path / "machine")

    def more(*lines):
        text = path.read_text()
        path.write_text(text.replace("[CHIPWISE]\n", "[CHIPWISE]\n" + "".join(line + "\n" for line in lines), 1))
        return path

    more("FILTER_TIME = 60")
    more.path = path
    return more


def start(ini, program, out, environment=None):
    clean = {key: value for key, value in os.environ.items() if key not in ("INI_FILE_NAME", "AXIS_PROGRESS_BAR")}
    quoted = os.fspath(program).replace("'", "'\\''")
    with open(out, "wb") as file:
        child = subprocess.Popen(
            ["sh", "-c", f"{COMMAND} --ini {ini} '{quoted}'"],
            stdin=subprocess.PIPE,
            stdout=file,
            stderr=subprocess.PIPE,
            env={**clean, **(environment or {})},
        )
    child.stdin.close()
    return child


def run(ini, program, tmp_path, environment=None):
    """-> status, data on standard output, text on standard error but progress, progress in percent."""
    child = start(ini, program, tmp_path / "out", environment)
    errors = child.stderr.read()  # up to the end of the pipe, as AXIS
    assert len(errors) < PIPE_BYTES and (not errors or errors.endswith(b"\n"))
    lines = errors.decode().splitlines()
    progress = [int(line.partition("=")[2]) for line in lines if line.startswith("FILTER_PROGRESS=")]
    assert len(progress) <= 100 and progress == sorted(set(progress))
    said = "\n".join(line for line in lines if not line.startswith("FILTER_PROGRESS="))
    assert "Traceback" not in said and "internal error" not in said, said
    return SimpleNamespace(
        status=child.wait(PATIENCE_S), data=(tmp_path / "out").read_bytes(), said=said, progress=progress
    )


def put(tmp_path, text, name="part.nc"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path
