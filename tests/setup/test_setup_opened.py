# SPDX-License-Identifier: GPL-2.0-or-later
"""The name of a program that a screen has opened through a filter, and its job file."""

import pytest

from chipwise.program.program_file import opened_name
from chipwise.setup import job as jobs


@pytest.mark.parametrize(
    "path, name",
    [
        ("/tmp/tmpa1_b2c3d/filtered-part.ngc", "part.ngc"),  # AXIS of LinuxCNC 2.10
        ("/tmp/tmpa1_b2c3d/part.ngc", "part.ngc"),  # of 2.9
        ("/home/me/filtered-part.ngc", "filtered-part.ngc"),
        ("/tmp/tmpa1_b2c3dx/filtered-part.ngc", "filtered-part.ngc"),
        ("filtered-part.ngc", "filtered-part.ngc"),
    ],
)
def test_the_copy_that_axis_runs_has_the_job_of_its_program(path, name):
    assert opened_name(path) == jobs.name_of(path) == name
    assert jobs.path_of(path, "/jobs") == f"/jobs/{name[:-4]}.job.toml"
