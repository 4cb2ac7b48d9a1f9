# SPDX-License-Identifier: GPL-2.0-or-later
"""Names on screens in the user's language, by gettext.  Called by cli/enter.py and the panel.

The catalogues are remap/chipwise/locale/LANGUAGE.po; `make build` compiles them into build/locale.  A text without a translation, and
every text without a catalogue, stays as it is in the source: English.  Messages of errors are not translated: docs/user/messages.md
explains them as they are.
"""

import gettext
import os
import struct
from typing import Callable, Optional, Sequence

from chipwise import ROOT

DOMAIN = "chipwise"
FOLDER = os.path.join(ROOT, "build", "locale")


def languages(folder: str = FOLDER) -> tuple:
    """Languages that there are, English among them: ("de", "en")."""
    try:
        found = [name for name in os.listdir(folder) if os.path.exists(os.path.join(folder, name, "LC_MESSAGES", DOMAIN + ".mo"))]
    except OSError:
        found = []
    return tuple(sorted({*found, "en"}))


def translator(wanted: Optional[Sequence[str]] = None, folder: str = FOLDER) -> Callable[[str], str]:
    """The function text -> text for the first of the wanted languages that there is: ("de_AT", "en"); None: the environment's,
    LANGUAGE, LC_ALL, LC_MESSAGES or LANG."""
    if wanted is not None:
        first = next((name for name in map(_short, wanted) if name in languages(folder)), "en")
        wanted = [first] if first != "en" else []
    try:
        return gettext.translation(DOMAIN, folder, wanted, fallback=True).gettext
    except (OSError, ValueError, struct.error):         # a catalogue that is broken
        return lambda text: text


def _short(name):
    """"de-AT" or "de_AT.UTF-8" -> "de"."""
    return name.replace("-", "_").partition("_")[0].partition(".")[0].lower()
