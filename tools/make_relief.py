#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Make nc_files/relief.stl, the model of nc_files/relief.ngc: a rosette of 40 x 40 mm, 3 mm high, on a plate; by
hand."""

import struct
from pathlib import Path

import numpy as np

GRID = np.linspace(0.0, 40.0, 33)


def heights():
    """(33, 33) mm, white at Z0: six leaves that end in a level rim."""
    x, y = np.meshgrid(GRID - 20.0, GRID - 20.0)
    r, angle = np.hypot(x, y), np.arctan2(y, x)
    return -3.0 + 3.0 * np.exp(-((r / 11.0) ** 4)) * (0.65 + 0.35 * np.cos(6.0 * angle) * np.minimum(r / 6.0, 1.0))


def main():
    x, y = np.meshgrid(GRID, GRID)
    p = np.stack([x, y, heights()], axis=2)
    a, b, c, d = (part.reshape(-1, 3) for part in (p[:-1, :-1], p[:-1, 1:], p[1:, 1:], p[1:, :-1]))
    triangles = np.concatenate([np.concatenate([a, b, d], axis=1), np.concatenate([b, c, d], axis=1)])
    records = np.zeros(len(triangles), np.dtype([("normal", "<f4", 3), ("corners", "<f4", 9), ("attribute", "<u2")]))
    records["corners"] = triangles
    path = Path(__file__).resolve().parents[1] / "nc_files" / "relief.stl"
    path.write_bytes(
        b"rosette of tools/make_relief.py".ljust(80) + struct.pack("<I", len(triangles)) + records.tobytes()
    )


if __name__ == "__main__":
    main()
