# SPDX-License-Identifier: GPL-2.0-or-later
"""chipwise import of SVG: what is shown is read, where it is shown, and nothing else.  bench/import_svg.py has whole
drawings and a second reader."""

import math

import pytest

from chipwise.importing import svg_tree
from chipwise.importing.drawn import Unreadable
from chipwise.importing.run import Layer, extent, imported

SHARE = 1e-3  # of the area: the target
DISC, BOX = math.pi * 25.0, 200.0
PAGE = (
    '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="100mm" height="80mm" '
    'viewBox="0 0 100 80">',
    "</svg>",
)


def read(body, folder):
    path = folder / "part.svg"
    path.write_text(body.join(PAGE))
    return imported(str(path), 0.01, 1.0)


def pockets(found):
    """[(area, (min x, min y, max x, max y) of the boundary)], the largest first."""
    return sorted(
        (
            (area, extent([Layer("", [pocket])]))
            for layer in found.layers
            for area, pocket in zip(layer.areas, layer.pockets)
        ),
        reverse=True,
    )


@pytest.mark.parametrize(
    "body, area, box",
    [
        ('<g transform="rotate(30)"><circle cx="50" cy="20" r="5"/></g>', DISC, (28.301, 32.679, 38.301, 42.679)),
        (
            '<g transform="translate(20 10) rotate(90)"><ellipse cx="0" cy="0" rx="8" ry="4"/></g>',
            math.pi * 32,
            (16.0, 62.0, 24.0, 78.0),
        ),
        ('<rect x="10" y="0" width="20" height="10" transform="rotate(30)"/>', BOX, (3.660, 56.340, 25.981, 75.0)),
        ('<rect x="10" y="0" width="20" height="10" transform="skewX(45)"/>', BOX, (10.0, 70.0, 40.0, 80.0)),
    ],
)
def test_shapes_that_are_turned(body, area, box, tmp_path):
    """A circle or box that is turned came in the size and place of before its transforms and the page's units."""
    ((found, around),) = pockets(read(body, tmp_path))
    assert found == pytest.approx(area, rel=SHARE)
    assert around == pytest.approx(box, abs=0.01)


HIDDEN = (
    '<mask id="m"><path d="M0 0H90V70H0z"/></mask>',
    '<symbol id="s"><path d="M0 0H90V70H0z"/></symbol>',
    '<marker id="k"><path d="M0 0H90V70H0z"/></marker>',
    '<defs><path d="M0 0H90V70H0z"/></defs>',
    '<clipPath id="c"><path d="M0 0H90V70H0z"/></clipPath>',
    '<g style="display:none"><path d="M0 0H90V70H0z"/></g>',
    '<switch><path d="M10 10h20v10h-20z"/><path d="M0 0H90V70H0z"/></switch>',
)


@pytest.mark.parametrize("body", HIDDEN)
def test_what_is_not_shown_is_not_read(body, tmp_path):
    """Masks and symbols were pockets."""
    found = read(body + '<rect x="10" y="10" width="20" height="10"/>', tmp_path)
    assert [area for area, _ in pockets(found)] == pytest.approx([BOX], rel=SHARE) and not found.left


def test_a_frame_without_fill_and_stroke_is_left_out(tmp_path):
    """Illustrator and icon sets draw the artboard so: what is drawn in it would be an island."""
    style = "<style>.a{fill:none;stroke:#000}.b{fill:none}</style>"
    found = read(
        f'<rect class="b" width="100" height="80"/><rect class="a" x="10" y="10" width="20" height="10"/>{style}',
        tmp_path,
    )
    assert [area for area, _ in pockets(found)] == pytest.approx([BOX], rel=SHARE)
    assert found.words[-1] == "left out: 1 with neither fill nor stroke"
    with pytest.raises(Unreadable, match="1 with neither fill nor stroke are left out"):
        read('<rect fill="none" width="100" height="80"/>', tmp_path)


@pytest.mark.parametrize(
    "body, box",
    [
        (
            '<use xlink:href="#b" x="30" y="5"/><defs><rect id="b" x="10" y="10" width="20" height="10"/></defs>',
            (40.0, 55.0, 60.0, 65.0),
        ),
        (
            '<symbol id="b" viewBox="0 0 10 10"><rect width="10" height="10"/></symbol><use href="#b" x="30" y="5" '
            'width="10" height="20" transform="scale(2 1)"/>',
            (60.0, 60.0, 80.0, 70.0),
        ),
        ('<g><svg x="30" y="5"><path d="M10 10h20v10h-20z"/></svg></g>', (40.0, 55.0, 60.0, 65.0)),
        ('<a><path d="M10 10h20v10h-20z"/></a>', (10.0, 60.0, 30.0, 70.0)),
    ],
)
def test_copies_and_places(body, box, tmp_path):
    ((area, around),) = pockets(read(body, tmp_path))
    assert area == pytest.approx(BOX, rel=SHARE) and around == pytest.approx(box, abs=0.001)


def test_clipped_elements_get_a_sentence(tmp_path):
    found = read(
        '<clipPath id="c"><circle r="9"/></clipPath><g clip-path="url(#c)"><rect x="10" y="10" width="20" '
        'height="10"/></g>',
        tmp_path,
    )
    assert found.words[1] == "1 elements are clipped or masked in the drawing; here their whole outlines count"


def test_copies_without_end_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(svg_tree, "MOST_ELEMENTS", 2000)
    itself = '<g id="a"><rect width="9" height="9"/><use href="#a"/></g>'
    with pytest.raises(Unreadable, match="more than 100 deep, or a copy holds itself"):
        read(itself, tmp_path)
    levels = "".join(f'<g id="a{k}">' + f'<use href="#a{k + 1}"/>' * 10 + "</g>" for k in range(9))
    with pytest.raises(Unreadable, match="more than 2000 elements with its copies"):
        read(f'<defs>{levels}<g id="a9"><rect width="9" height="9"/></g></defs><use href="#a0"/>', tmp_path)
