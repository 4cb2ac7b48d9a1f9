# SPDX-License-Identifier: GPL-2.0-or-later
"""The strings of the panel's page in the languages there are: PO files, as the tools of gettext read and write them.

Called by server.py.  locale/LANGUAGE.po beside this file; the texts of the page itself are English, and so is what a file lacks.
"""

import ast
import functools
import os

FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "locale")
LANGUAGES = ("en", "de")


def read_po(path):
    """{msgid: msgstr} of a PO file without plural forms; what is not translated is left out."""
    found, key, text = {}, None, {"msgid": "", "msgstr": ""}
    with open(path, encoding="utf-8") as file:
        for line in [*file, 'msgid ""']:
            word, _, rest = line.strip().partition(" ")
            if word == "msgid":
                if text["msgid"] and text["msgstr"]:
                    found[text["msgid"]] = text["msgstr"]
                text = {"msgid": "", "msgstr": ""}
            if word in text:
                key = word
                text[key] = ast.literal_eval(rest)
            elif line.startswith('"') and key:
                text[key] += ast.literal_eval(line.strip())
    return found


@functools.lru_cache(maxsize=None)
def strings(language):
    """{"language", "strings": {English: translated}}; none for English."""
    path = os.path.join(FOLDER, f"{language}.po")
    found = read_po(path) if language in LANGUAGES and os.path.exists(path) else {}
    return {"language": language, "strings": found}
