# SPDX-License-Identifier: GPL-2.0-or-later
"""Every source file names its license in its first two lines."""

import pytest
from support import ROOT

TAG = "SPDX-License-Identifier: GPL-2.0-or-later"
FOLDERS = ("bench", "bin", "components", "remap", "tests", "tools")


def sources(folder):
    """C, components, Python and scripts; not what halcompile and Python leave there."""
    for path in sorted((ROOT / folder).rglob("*")):
        if path.is_file() and not path.is_symlink() and "__pycache__" not in path.parts and "replays" not in path.parts:
            if path.suffix in (".py", ".c", ".h", ".comp") or (not path.suffix and path.read_bytes()[:2] == b"#!"):
                yield path


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_source_file_names_its_license(folder):
    missing = [
        str(path.relative_to(ROOT))
        for path in sources(folder)
        if TAG not in "".join(path.read_text(errors="replace").splitlines(keepends=True)[:2])
    ]
    assert missing == []
