# SPDX-License-Identifier: GPL-2.0-or-later
"""Names on screens in the user's language, by gettext.  Called by cli/enter.py and panel/server.py.

The catalogues are remap/chipwise/locale/LANGUAGE.po; `make build` compiles them into build/locale.  A text without a
translation, and every text without a catalogue, stays as it is in the source: English.  Messages of errors are not
translated: docs/user/messages.md explains them as they are.
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
        found = [
            name
            for name in os.listdir(folder)
            if os.path.exists(os.path.join(folder, name, "LC_MESSAGES", DOMAIN + ".mo"))
        ]
    except OSError:
        found = []
    return tuple(sorted({*found, "en"}))


def translator(wanted: Optional[Sequence[str]] = None, folder: str = FOLDER) -> Callable[[str], str]:
    """The function text -> text for the first of the wanted languages that there is: ("de_AT", "en"); None: the
    environment's, LANGUAGE, LC_ALL, LC_MESSAGES or LANG."""
    if wanted is not None:
        wanted = [name for name in (_first(wanted, folder),) if name != "en"]
    try:
        return gettext.translation(DOMAIN, folder, wanted, fallback=True).gettext
    except (OSError, ValueError, struct.error):  # a catalogue that is broken
        return lambda text: text


def catalogue(wanted: Sequence[str], folder: str = FOLDER) -> tuple:
    """(language, {English: translated}) for the first of the wanted languages that there is; without texts for
    English."""
    name = _first(wanted, folder)
    try:
        found = gettext.translation(DOMAIN, folder, [name], class_=_Catalogue, fallback=name == "en")
    except (OSError, ValueError, struct.error):
        return "en", {}
    return name, found.texts() if isinstance(found, _Catalogue) else {}


class _Catalogue(gettext.GNUTranslations):
    """A catalogue that can be read as a whole."""

    _catalog: dict  # of gettext: {msgid: msgstr}, the head of the file under ""

    def texts(self) -> dict:
        """{English: translated}."""
        return {text: translated for text, translated in self._catalog.items() if text and isinstance(text, str)}


def _first(wanted, folder):
    """The first of the wanted languages that there is, "en" if there is none of them."""
    known = languages(folder)
    return next((name for name in map(_short, wanted) if name in known), "en")


def _short(name):
    """ "de-AT" or "de_AT.UTF-8" -> "de"."""
    return name.replace("-", "_").partition("_")[0].partition(".")[0].lower()
