# SPDX-License-Identifier: GPL-2.0-or-later
"""What run from line reads over: whether a later line of the program defines the stock again.

Called by glue/program_run.py.  Pure.  A line in a sub, in a branch or loop, or with block delete may not be executed,
so it does not count.
"""

from __future__ import annotations

import re

_BLANKS_AND_COMMENTS = re.compile(r"\([^)]*\)?|;.*|\s")
_STOCK = re.compile(r"^(n\d+(\.\d+)?)?[^o/]*?m25[04](?!\d)")
_BLOCK = re.compile(r"^/?(?:n\d+(?:\.\d+)?)?o(?:\d+|<[^>]*>)(sub|if|while|do|repeat|endsub|endif|endwhile|endrepeat)")


def stock_is_defined_again(text: str, line: int, start: int) -> bool:
    """Whether a line after `line` and before `start` is an M250 or M254 that is executed whatever happens."""
    depth = 0
    for raw in text.split("\n")[line : start - 1]:
        plain = _BLANKS_AND_COMMENTS.sub("", raw.lower())
        block = _BLOCK.match(plain)
        if block:  # the `while` that closes a `do` counts as one more: then nothing counts behind it
            depth = max(depth - 1, 0) if block.group(1).startswith("end") else depth + 1
        elif not depth and _STOCK.match(plain):
            return True
    return False
