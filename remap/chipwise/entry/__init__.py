# SPDX-License-Identifier: GPL-2.0-or-later
"""Entry by fields: a code's data typed in one line, in a stored order, with commas between them.

Called by cli/enter.py and by the panel.

    entry.codes()               ("G12", "G13", ..)
    entry.fields("G79")         (EntryField, ..) in the order of entry
    entry.line("G79", "100,-8,,5")      "G79 Q100 Z-8 R5", or EntryError, which names the field
    entry.words("G79 Q100 Z-8 R5")      (("Q", "sub of the pocket", "100"), ..)

entry/planned.py plans a line as the machine would, drawing/entered.py draws that.

Source: abstract on entering several data: the input order is stored beforehand, the names are shown in that order, the
data are fed in that order with "," between them and a symbol for the end behind them, and distinguished by order and
punctuation alone.  Departs from it: an empty place keeps the code's default, and data at the end may be left out.
"""

from chipwise.entry.table import CodeEntry, EntryField, codes, fields, load_table, title
from chipwise.entry.typed import EntryError, form, line, split
from chipwise.entry.naming import words

__all__ = (
    "CodeEntry",
    "EntryError",
    "EntryField",
    "codes",
    "fields",
    "form",
    "line",
    "load_table",
    "split",
    "title",
    "words",
)
