# SPDX-License-Identifier: GPL-2.0-or-later
"""Pictures that a command writes: SVG, or PNG made of it.

Called by contour.py and patterns.py.
"""

import os
import subprocess
import tempfile

from chipwise.cli.output import PREFIX, unwritable, write_whole
from chipwise.drawing.data import wrong

SUFFIXES = (".svg", ".png")
RENDERER = "rsvg-convert"  # Debian: librsvg2-bin


def check_output(path):
    """CycleError for a picture that cannot be made, before any work."""
    suffix = os.path.splitext(path)[1].lower()
    if suffix not in SUFFIXES:
        raise wrong(f"-o {path}: {suffix or 'no suffix'} is not a known kind of picture", "use .svg or .png")
    trouble = unwritable(path)
    if trouble:
        raise wrong("-o " + trouble[0], trouble[1])


def write_picture(text, path):
    """Write an SVG text as .svg or .png, whole or not at all."""
    try:
        if os.path.splitext(path)[1].lower() != ".png":
            write_whole(path, text)
            return
        with tempfile.TemporaryDirectory(dir=os.path.dirname(path) or ".", prefix=PREFIX) as folder:
            drawn, painted = (os.path.join(folder, "picture" + suffix) for suffix in (".svg", ".png"))
            write_whole(drawn, text)
            render(drawn, painted)
            os.replace(painted, path)
    except OSError as error:
        raise wrong(f"-o {path}: {error.strerror}", "name a file in a folder of yours") from error


def render(source, target):
    """SVG to PNG."""
    try:
        done = subprocess.run(
            [RENDERER, "--format=png", "--zoom=1.5", "-o", target, source],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=60,
            check=False,
        )
    except FileNotFoundError as error:
        raise wrong(
            f"{RENDERER} is not installed, which a .png needs",
            "make deps, or apt-get install librsvg2-bin, or write an .svg",
        ) from error
    except subprocess.TimeoutExpired as error:
        raise wrong(f"{RENDERER} did not end within 60 s", "write an .svg") from error
    if done.returncode:
        raise wrong(f"{RENDERER}: {' '.join(done.stdout.split())}", "write an .svg")
