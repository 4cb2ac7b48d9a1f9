# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise setup on a program of a test.  Called by tests/setup."""

import json
import os

from support import forked
from support.forked import CHIPWISE


def chipwise_setup(folder, text, *options, machine=None, name="part.ngc", environment=None):
    """-> (exit status, stdout, stderr, JSON or None).  text: of the program; None: it is there."""
    path, result = folder / name, folder / "result.json"
    if text is not None:
        path.write_text(text)
    result.unlink(missing_ok=True)
    done = forked.run(
        [CHIPWISE, "setup", str(path), "--json", str(result), *(["--ini", str(machine)] if machine else []), *options],
        timeout=300,
        env={**os.environ, **(environment or {})},
    )
    assert "Traceback" not in done.stdout + done.stderr
    return done.returncode, done.stdout, done.stderr, json.loads(result.read_text()) if result.exists() else None
