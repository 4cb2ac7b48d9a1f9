# SPDX-License-Identifier: GPL-2.0-or-later
"""A TOML file of the user's that chipwise changes without losing what else is in it.  Called by stations/store.py and
clamps/set_ups.py."""

import contextlib
import os
import tomllib
from typing import Any, Iterator

from chipwise.errors import CycleError, braceless
from chipwise.host.files import locked, read_bytes, write_durable

MAX_BYTES = 1 << 20
UNFINISHED = ".unfinished"
REMEDY = "correct the file"


def document(path: str) -> dict:
    """What a file holds, {} without one.  Raises CycleError that names it."""
    name = os.path.basename(path)
    try:
        return tomllib.loads(read_bytes(path, MAX_BYTES).decode("utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, UnicodeDecodeError) as error:
        raise CycleError(
            braceless(f"{name}: it cannot be read: {getattr(error, 'strerror', None) or 'it is not UTF-8'}"), REMEDY
        ) from error
    except (ValueError, RecursionError) as error:
        raise CycleError(braceless(f"{name}: is not TOML: {error}"), REMEDY) from error


@contextlib.contextmanager
def changing(path: str, head: str, setting: str, what: str) -> Iterator[Any]:
    """The file as a document that keeps comments and layout; written at the end if it can be read again.

    head: of a new file; setting: that names the file; what: needs it, for the message."""
    try:
        import tomlkit
    except ImportError:
        raise CycleError(
            f"{what} need the Python package tomlkit, which is not installed", "apt-get install python3-tomlkit"
        ) from None
    folder = os.path.dirname(os.path.abspath(path))
    try:
        os.makedirs(folder, exist_ok=True)
        with locked(folder):
            text = read_bytes(path, MAX_BYTES).decode("utf-8") if os.path.exists(path) else head
            found: Any = tomlkit.parse(text)
            yield found
            write_durable(path, tomlkit.dumps(found).encode("utf-8"), UNFINISHED)
    except (OSError, ValueError, TypeError) as error:
        raise CycleError(
            braceless(f"{os.path.basename(path)}: it cannot be written: {getattr(error, 'strerror', None) or error}"),
            f"correct the file, its folder or [CHIPWISE]{setting}",
        ) from error
