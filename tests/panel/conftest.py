# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tests of the panel's server share."""

import pytest


@pytest.fixture
def rig():
    """A panel_rig.Rig whose server answers and changes nothing."""
    from support.panel_rig import serving

    with serving() as found:
        yield found


@pytest.fixture
def changing():
    """A panel_rig.Rig whose page may change something."""
    from support.panel_rig import TOKEN, serving

    with serving(TOKEN) as found:
        yield found
