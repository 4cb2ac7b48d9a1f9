# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tests of chipwise rewrite share."""

import pytest


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    """Path of the INI file of the mill, with the tools of rewrite_rig."""
    from support.rewrite_rig import make_machine

    return make_machine(tmp_path_factory.mktemp("machine") / "mill")
