# SPDX-License-Identifier: GPL-2.0-or-later
"""A script of tools/ that has no .py at its end, as a module."""

import importlib.util
from importlib.machinery import SourceFileLoader

from support import ROOT


def load_script(name):
    """-> the module of tools/NAME."""
    loader = SourceFileLoader(name, str(ROOT / "tools" / name))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(name, loader))
    loader.exec_module(module)
    return module
