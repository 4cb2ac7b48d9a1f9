# SPDX-License-Identifier: GPL-2.0-or-later
"""What a colour is to an eye: contrast, distance, and how deuteranopes and protanopes see it.  For the tests of
panel/colours.py.

Sources, written from the formulas alone:
    relative luminance and contrast     WCAG 2.1, definitions of "relative luminance" and "contrast ratio"
    Vienot                              F. Vienot, H. Brettel, J. Mollon, Digital video colourmaps for checking the
                                        legibility of displays by dichromats, Color Res. Appl. 24 (1999): LMS of linear
                                        RGB, the lost cone replaced on a plane
    Machado                             G. Machado, M. Oliveira, L. Fernandes, A physiologically-based model for
                                        simulation of color vision deficiency, IEEE TVCG 15 (2009): matrices for
                                        severity 1.0 on linear RGB
    distance                            CIE 1976 L*a*b*, D65; Euclidean: 2.3 is just noticeable side by side
"""

import numpy as np

_LMS = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]])
_LOST = {
    "protan": np.array([[0.0, 2.02344, -2.52581], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    "deutan": np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]]),
}
VISIONS = {
    "normal": np.eye(3),
    "deuteranopia, Vienot": np.linalg.inv(_LMS) @ _LOST["deutan"] @ _LMS,
    "protanopia, Vienot": np.linalg.inv(_LMS) @ _LOST["protan"] @ _LMS,
    "deuteranopia, Machado": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "protanopia, Machado": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
}
_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)


def linear(colour):
    """ "#rrggbb" -> linear RGB, (3,), 0 to 1."""
    value = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def seen(colour, vision):
    """Linear RGB of a colour as an eye sees it."""
    return np.clip(VISIONS[vision] @ linear(colour), 0.0, 1.0)


def contrast(one, other, vision="normal"):
    """Contrast ratio of two colours, 1 to 21."""
    low, high = sorted(float(_XYZ[1] @ seen(colour, vision)) for colour in (one, other))
    return (high + 0.05) / (low + 0.05)


def lab(rgb):
    """Linear RGB -> L*, a*, b*."""
    ratio = _XYZ @ rgb / _XYZ.sum(axis=1)
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def distance(one, other, vision="normal"):
    """How different two colours are."""
    return float(np.linalg.norm(lab(seen(one, vision)) - lab(seen(other, vision))))
