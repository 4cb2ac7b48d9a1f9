#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import of SVG: bench/import_svg.py [--count N] [--seed N] [--letters] [FILE|FOLDER ..].  Prints a table and
what is wrong.

Without files, N drawings in the manner of seven programs (drawings_svg.py).  Each is right if its pockets are as many
as were drawn, each has the area by closed forms within 0.1 %, and their sum is that of svg_oracle.py within 0.1 %.
With --letters three characters of any font of this computer are written as paths.
Files and folders are drawings of others: right is the sum of svg_oracle.py within 0.1 %, layer by layer even-odd by
nesting.  Said is what import refuses, or where it names what is open, crosses, is unclear, clipped or left out.  What
is neither is wrong.
"""

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import roots  # noqa: F401
import svg_oracle
from drawings_svg import MANNERS, drawing
from import_drawings import drawn
from import_table import tabled

from chipwise.errors import CycleError
from chipwise.importing.run import imported
from support.glyph_shapes import Font, fonts

SHARE, TOLERANCE = 1e-3, 0.01
LEAST = 0.01  # mm2: smaller loops are dirt


def wanted(path):
    """mm2 of all layers by the oracle."""
    return sum(drawn([ring for ring in rings if len(ring) > 2]) for rings in svg_oracle.rings(path)[0].values())


def judged(path, areas=None):
    """(verdict, largest share by which an area differs, what is said)."""
    try:
        found = imported(str(path), TOLERANCE, 1.0)
    except CycleError as error:
        return "refused", 0.0, str(error)
    except Exception as error:  # nothing but a sentence may come out
        return "wrong", 1.0, repr(error)
    got = sorted((area for layer in found.layers for area in layer.areas), reverse=True)
    try:
        whole = wanted(str(path))
    except Exception as error:  # of the oracle: the drawing is not judged
        return "not judged", 0.0, repr(error)
    off = abs(sum(got) - whole) / max(whole, LEAST)
    if areas is not None:
        off = max([off, *(abs(a - b) / b for a, b in zip(got, areas))]) if len(got) == len(areas) else 1.0
    if off <= SHARE:
        return "right", off, ""
    said = found.doubtful or any(word in text for text in found.words for word in ("clipped", "left out"))
    return "said" if said else "wrong", off, f"{sum(got):.3f} mm2 instead of {whole:.3f}; " + "; ".join(found.words)


def table(count, first):
    """Rows of drawings in the manner of programs."""

    def told(path, areas):
        verdict, off, text = judged(path, areas)
        return {"refused": "said", "not judged": "wrong"}.get(verdict, verdict), off, text

    return tabled(MANNERS, drawing, told, range(first, first + count), ".svg")


def letter(seed, path):
    """Writes a word as its outlines, as programs write text as paths; its font."""
    from fontTools.pens.svgPathPen import SVGPathPen

    rng, known = np.random.default_rng([seed, 48]), sorted(fonts().items())
    name, file = known[int(rng.integers(len(known)))]
    font, words, at = Font(file), [], 0.0
    characters = font.characters()
    for code in rng.choice(characters, 3):
        pen, name_of = SVGPathPen(font.glyphs), font.names[int(code)]
        font.glyphs[name_of].draw(pen)
        words.append(f'<path transform="translate({at:.3f} 0)" d="{pen.getCommands()}"/>')
        at += 3.0 * font.unit
    scale = float(rng.uniform(10, 60)) / font.unit
    with open(path, "w", encoding="utf-8") as out:
        out.write(
            f'<svg xmlns="http://www.w3.org/2000/svg" width="999mm" height="200mm" viewBox="0 0 999 200"><g '
            f'transform="translate(5 100) scale({scale:.9f} {-scale:.9f})">'
            f"{''.join(words)}</g></svg>"
        )
    return name


def letters(count, first):
    """Words as paths, by the oracle alone."""
    rows, worst = Counter(), 0.0
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(first, first + count):
            name = letter(seed, f"{folder}/{seed}.svg")
            verdict, off, text = judged(f"{folder}/{seed}.svg")
            rows[verdict] += 1
            worst = max(worst, off) if verdict == "right" else worst
            if verdict != "right":
                print(f"seed {seed}, {name}: {verdict} {text[:300]}", file=sys.stderr)
    print(f"{count} words as paths: {dict(rows)}; largest error of an area {100 * worst:.3f} %")
    return rows["wrong"]


def others(names):
    """Drawings of others, one by one."""
    paths = [
        path for name in names for path in (sorted(Path(name).rglob("*.svg")) if Path(name).is_dir() else [Path(name)])
    ]
    count, worst = Counter(), 0.0
    for path in paths:
        verdict, off, text = judged(path)
        count[verdict] += 1
        worst = max(worst, off) if verdict == "right" else worst
        if verdict != "right":
            print(f"{path.name}: {verdict} {text[:300]}", flush=True)
    print(f"{len(paths)} drawings: {dict(count)}; largest error of an area {100 * worst:.3f} %")
    return count["wrong"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    parser.add_argument("--count", type=int, default=140)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--letters", action="store_true", help="words of the fonts of this computer as paths")
    given = parser.parse_args()
    wrong = others(given.names) if given.names else (letters if given.letters else table)(given.count, given.seed)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
