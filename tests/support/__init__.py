# SPDX-License-Identifier: GPL-2.0-or-later
"""What tests and benchmarks share: oracles, judges, generators of cases, rigs that run HAL and LinuxCNC.

Imported as `support.NAME` with tests/ and remap/ on sys.path: pytest.ini does that for tests, bench/roots.py for
benchmarks, tools/judge for the judges that are run by hand.  Nothing here is collected as a test, no test imports
another test, and tests and benchmarks import nothing from each other.
"""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
