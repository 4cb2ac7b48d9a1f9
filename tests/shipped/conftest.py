# SPDX-License-Identifier: GPL-2.0-or-later
"""What the tests here share: what `make install` puts on a machine, in a folder; skipped where no machine can be
covered."""

import pytest

from support import shipped

LONGEST = (
    "test_whatever_is_killed_the_next_start_works",
    "test_slots",
)  # first, so that two processes end at the same time


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    if shipped.missing():
        pytest.skip(shipped.missing())
    return shipped.stage(tmp_path_factory.mktemp("installed") / "root")


@pytest.fixture
def scene(installed, tmp_path):
    """scene(NAME, arguments..): the answer of shipped.scene()."""

    def run(name, folder="scene", **arguments):
        return shipped.scene(name, installed, tmp_path / folder, **arguments)

    return run


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: item.name not in LONGEST)
