# SPDX-License-Identifier: GPL-2.0-or-later
"""How many random cases, from which seed, and where a failing one is kept.

CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED in the environment decide, else the defaults do.  CHIPWISE_RANDOM_SHARE is the
share of a default that is run: a fifth in `make test` and `make test-all`, all in `make test-long` and where a test is
named (tools/test).  The C programs of tests/core run all: they take little time.
"""

import json
import math
import os

from support import ROOT

DEFAULT_SEED = 7134


def random_count(default, least=0):
    """How many random cases: CHIPWISE_RANDOM_COUNT, else the share of the test's own default, rounded up; `least` where
    fewer show nothing."""
    return int(os.environ.get("CHIPWISE_RANDOM_COUNT") or max(least, math.ceil(default * random_share())))


def random_share():
    """CHIPWISE_RANDOM_SHARE, else 1."""
    return float(os.environ.get("CHIPWISE_RANDOM_SHARE") or 1)


def random_seed():
    """Seed of the random tests: CHIPWISE_SEED, else fixed."""
    return int(os.environ.get("CHIPWISE_SEED") or DEFAULT_SEED)


def write_replay(name, case):
    """Save a failing case under build/replay; -> its path."""
    path = ROOT / "build" / "replay" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(case, indent=1))
    return path
