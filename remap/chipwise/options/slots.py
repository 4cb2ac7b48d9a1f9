# SPDX-License-Identifier: GPL-2.0-or-later
"""Stock files that a command names: a path, or a slot of M253 of a machine.

Called by cli/turn_over.py and cli/blank.py.
"""

import os

from chipwise.stock import reasons


def slots():
    """The names of all slots."""
    return [str(slot) for slot in range(reasons.SLOTS)]


def check_name(name, refuse):
    """Refuse what is neither a stock file nor a slot."""
    if name not in slots() and not name.endswith(".stock"):
        refuse(f"{name} is neither FILE.stock nor a slot from 0 to {reasons.SLOTS - 1}")


def settings_of(ini, names, refuse):
    """The settings of the machine, None if none is named and none of the names is a slot.  Raises CycleError."""
    if ini or os.environ.get("INI_FILE_NAME"):
        from chipwise.settings import load_settings

        return load_settings(ini)
    for name in names:
        if name in slots():
            refuse(f"slot {name} is that of a machine; use --ini INI")
    return None


def path_of(name, settings):
    """A slot's file, in its folder, which M253 makes, too; else the file itself.  Raises OSError."""
    if name not in slots():
        return name
    from chipwise.stock import store

    folder = settings.path("STOCK_DIR")
    os.makedirs(folder, exist_ok=True)
    return os.path.join(folder, store.slot_name(int(name)))
