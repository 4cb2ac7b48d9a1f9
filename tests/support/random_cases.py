# SPDX-License-Identifier: GPL-2.0-or-later
"""How many random cases, from which seed, and where a failing one is kept.

CHIPWISE_RANDOM_COUNT and CHIPWISE_SEED in the environment decide, else the defaults do.
"""
import json
import os

from support import ROOT

DEFAULT_SEED = 7134


def random_count(default):
    """How many random cases: CHIPWISE_RANDOM_COUNT, else the test's own default."""
    return int(os.environ.get("CHIPWISE_RANDOM_COUNT") or default)


def random_seed():
    """Seed of the random tests: CHIPWISE_SEED, else fixed."""
    return int(os.environ.get("CHIPWISE_SEED") or DEFAULT_SEED)


def write_replay(name, case):
    """Save a failing case under build/replay; -> its path."""
    path = ROOT / "build" / "replay" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(case, indent=1))
    return path
