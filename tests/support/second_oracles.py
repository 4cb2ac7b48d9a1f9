# SPDX-License-Identifier: GPL-2.0-or-later
"""Two offset libraries as second opinions, for tests and benches only.

cavaliercontours-python (exact arcs) and pyclipper (polygons) live in a virtual environment
under build/, made on first use from /usr/bin/python3 with --system-site-packages; nothing
is installed anywhere else.  Where that fails (no network, no wheel for the machine) load()
returns the reason instead, and tests skip showing it.
"""

import fcntl
import importlib
import math
import subprocess
import sys

import numpy as np

from support import ROOT

VENV = ROOT / "build" / "oracles"
PACKAGES = ("cavaliercontours-python", "pyclipper")
MAY_LACK = "opencamlib"  # has no wheel for every Python


def _install():
    """Reason why not, or None; of several processes one installs and the others wait."""
    VENV.parent.mkdir(exist_ok=True)
    with open(VENV.with_suffix(".lock"), "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return _install_alone()


def _install_alone():
    done, failed = VENV / "complete-2", VENV / "failed"
    if done.exists():
        return None
    if failed.exists():
        return f"{failed.read_text().strip()} (remove {failed} to try again)"
    steps = (
        [sys.executable, "-m", "venv", "--system-site-packages", str(VENV)],
        [str(VENV / "bin" / "pip"), "install", "--quiet", "--disable-pip-version-check", "--timeout", "20", *PACKAGES],
    )
    pip = [str(VENV / "bin" / "pip"), "install", "--quiet", "--disable-pip-version-check", "--timeout", "20"]
    for step in steps:
        try:
            subprocess.run(step, check=True, capture_output=True, text=True, timeout=300)
        except (OSError, subprocess.SubprocessError) as error:
            VENV.mkdir(exist_ok=True)
            lines = (getattr(error, "stderr", "") or str(error)).strip().splitlines()
            failed.write_text(lines[-1] if lines else "pip failed")
            return failed.read_text()
    subprocess.run([*pip, "--only-binary", ":all:", MAY_LACK], check=False, capture_output=True, timeout=300)
    done.write_text("")
    return None


def load(name):
    """(module, None) or (None, reason)."""
    reason = _install()
    if reason:
        return None, f"{name} not installable: {reason}"
    for folder in VENV.glob("lib/python3*/site-packages"):
        if str(folder) not in sys.path:
            sys.path.append(str(folder))
    try:
        return importlib.import_module(name), None
    except (ImportError, OSError) as error:
        return None, f"{name} does not load: {error}"


def cavalier_job(module, shape, side, radius):
    """A function of nothing that makes the offset of a closed shape of oracle tuples with
    cavalier_contours, as its polylines; what it takes to say the shape is done already."""
    x, y, bulge = [], [], []
    for el in shape:
        parts = [el]
        if el[0] == "A" and abs(el[7]) > 0.999 * math.pi:  # its arcs end at a half turn
            mid = _point(el, 0.5)
            parts = [
                ("A", el[1], el[2], *mid, el[5], el[6], 0.5 * el[7]),
                ("A", *mid, el[3], el[4], el[5], el[6], 0.5 * el[7]),
            ]
        for p in parts:
            x.append(p[1])
            y.append(p[2])
            bulge.append(math.tan(p[7] / 4.0) if p[0] == "A" else 0.0)
    line = module.Polyline([x, y, bulge], True)
    return lambda: line.parallel_offset(-side * radius, False)


def cavalier_paths(module, shape, side, radius):
    """[(elements, signed area)] of cavalier_contours for a closed shape of oracle tuples."""
    return [(p.vertex_count(), p.get_area()) for p in cavalier_job(module, shape, side, radius)()]


def _point(el, t):
    angle = math.atan2(el[2] - el[6], el[1] - el[5]) + t * el[7]
    r = math.hypot(el[1] - el[5], el[2] - el[6])
    return el[5] + r * math.cos(angle), el[6] + r * math.sin(angle)


CLIPPER_UNIT = 1e6  # its whole numbers per mm


def clipper_job(module, shape, side, radius, chord=5e-4):
    """(function of nothing that makes the offset with Clipper as polygons, whether the shape
    runs counter-clockwise): the shape in chords that stray at most `chord` mm."""
    points = []
    for el in shape:
        if el[0] == "L":
            points.append((el[1], el[2]))
            continue
        r = math.hypot(el[1] - el[5], el[2] - el[6])
        n = max(2, math.ceil(abs(el[7]) / (2.0 * math.acos(max(1.0 - chord / r, 0.0)))))
        points += [_point(el, k / n) for k in range(n)]
    ccw = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1])) > 0.0
    outward = 1.0 if (side > 0) == ccw else -1.0
    whole = [(round(a * CLIPPER_UNIT), round(b * CLIPPER_UNIT)) for a, b in points]

    def work():
        offset = module.PyclipperOffset(2.0, chord * CLIPPER_UNIT)
        offset.AddPath(whole, module.JT_ROUND, module.ET_CLOSEDPOLYGON)
        return offset.Execute(outward * radius * CLIPPER_UNIT)

    return work, ccw


def clipper_area(module, shape, side, radius):
    """Signed area of the offset of the shape in chords."""
    work, ccw = clipper_job(module, shape, side, radius)
    area = sum(module.Area(p) for p in work()) / CLIPPER_UNIT**2
    return area if ccw else -area


def perimeter(shape):
    return float(
        np.sum(
            [
                math.hypot(el[3] - el[1], el[4] - el[2])
                if el[0] == "L"
                else math.hypot(el[1] - el[5], el[2] - el[6]) * abs(el[7])
                for el in shape
            ]
        )
    )
