"""Puts the package on the path; one place for the random tests' count and seed."""

import json
import os
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
for folder in (ROOT / "remap", ROOT / "tests"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))


def random_count(default):
    """How many random cases: CHIPWISE_RANDOM_COUNT, else the test's own default."""
    return int(os.environ.get("CHIPWISE_RANDOM_COUNT", default))


def random_seed():
    """Seed of the random tests: CHIPWISE_SEED, else fixed."""
    return int(os.environ.get("CHIPWISE_SEED", 7134))


def write_replay(name, case):
    """Save a failing case under build/replay and say where; returns the path."""
    path = ROOT / "build" / "replay" / f"{name}.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(case, indent=1))
    return path


@pytest.fixture
def root():
    """The repository's root."""
    return ROOT
