# SPDX-License-Identifier: GPL-2.0-or-later
"""LinuxCNC's realtime form, which it takes on a kernel with PREEMPT_RT; LINUXCNC_FORCE_REALTIME asks for it on any."""

import os
import subprocess

import pytest

pytestmark = pytest.mark.machine

MOTION_KEY = 100  # LinuxCNC 2.9 leaves motion's memory behind
RLIMIT = """#define _GNU_SOURCE
#include <errno.h>
#include <sys/resource.h>
int setrlimit(__rlimit_resource_t which, const struct rlimit *limit)
{
    int status = prlimit(0, which, limit, 0);
    return status && errno == EPERM && which == RLIMIT_RTPRIO ? 0 : status;
}
int setrlimit64(__rlimit_resource_t which, const struct rlimit64 *limit) __attribute__((alias("setrlimit")));
"""


def test_realtime(scene, tmp_path):
    """Memory locked and SCHED_FIFO: starts, cuts, and starts again after rtapi_app was killed."""
    (tmp_path / "scene").mkdir()
    subprocess.run(
        ["gcc", "-shared", "-fPIC", "-o", tmp_path / "scene/rlimit.so", "-x", "c", "-"],
        input=RLIMIT,
        text=True,
        check=True,
    )
    found = scene("scenes.realtime")
    if found["without"]:
        pytest.skip(found["without"])
    for one in found["seen"]:
        assert "Note: Using POSIX realtime" in one["said"] and os.SCHED_FIFO in one["threads"], one
        assert one["locked"] > one["map"]["size"] and one["map"]["rss"] >= one["map"]["size"], one
        assert float(one["volume"]) > 300 and one["fault"] == "0", one
    assert float(found["seen"][0]["volume"]) == pytest.approx(float(found["seen"][1]["volume"]), rel=0.01)
    assert found["left"] == [] and set(found["memory"]) <= {MOTION_KEY}, "processes or memory outlive LinuxCNC"
