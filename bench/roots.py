# SPDX-License-Identifier: GPL-2.0-or-later
"""Puts remap/ (the package) and tests/ (tests/support) on sys.path; the first import of our own in every benchmark."""

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "remap"), str(ROOT / "tests")]
