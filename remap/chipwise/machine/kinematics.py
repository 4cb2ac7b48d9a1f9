# SPDX-License-Identifier: GPL-2.0-or-later
"""The machine's own kinematics, offline: the module that motion runs, in a process of its own.

Called by cycles/reach.py.  components/kinematics_host.c has what the module needs of HAL.  Lengths are machine units
and angles degrees, as in the module.
"""

import ctypes
import os
from functools import lru_cache
from pathlib import Path

import numpy as np

from chipwise.errors import CycleError, braceless
from chipwise.machine.covers import module_directory

POSE, JOINTS = 9, 16  # X Y Z A B C U V W; EMCMOT_MAX_JOINTS
FOLDERS = ("/usr/lib/linuxcnc/modules", "/usr/local/lib/linuxcnc/modules")


class Kinematics:
    """A kinematics module: forward, inverse, and the joints along a path."""

    def __init__(self, name, pins=()):
        """name: of the module; pins: ((name of a HAL pin, value), ..).  Raises CycleError."""
        self._host, self._module = _loaded(name)
        for pin, value in pins:
            self._host.chip_host_set(pin.encode(), ctypes.c_double(value))

    def pins(self):
        """Names of the module's pins that are numbers."""
        kind = ctypes.c_char()
        self._host.chip_host_pin.restype = ctypes.c_char_p
        names = [
            (self._host.chip_host_pin(k, ctypes.byref(kind)).decode(), kind.value)
            for k in range(self._host.chip_host_pins())
        ]
        return [name for name, found in names if found == b"f"]

    def forward(self, joints):
        """Joints (n,) -> pose (9,)."""
        pose, flags, given = np.zeros(POSE), (ctypes.c_ulong * 2)(), _row(joints, JOINTS)
        self._module.kinematicsForward(_of(given), _of(pose), ctypes.byref(flags, 0), ctypes.byref(flags, 8))
        return pose

    def follow(self, poses, joints):
        """Joints (n, 16) along poses (n, 9), which begin beside the pose of joints (k,); fewer where the module has
        refused one.  A pose out of reach has joints that are not finite."""
        rows = np.ascontiguousarray(poses, float)
        found, at = np.full((len(rows), JOINTS), np.nan), _row(joints, JOINTS)
        done = self._host.chip_host_follow(
            self._module.kinematicsInverse, self._module.kinematicsForward, _of(rows), len(rows), _of(at), _of(found)
        )
        return found[:done]


def _row(values, size):
    """Values at the beginning of a row of zeros."""
    row = np.zeros(size)
    row[: len(values)] = values
    return row


def _of(array):
    return array.ctypes.data_as(ctypes.c_void_p)


def host_path():
    """Where the host is: build/ of this checkout, or where it is installed."""
    return Path(__file__).resolve().parents[3] / "build/libchipwise_kinematics.so"


@lru_cache(maxsize=None)
def _loaded(name):
    """(host, module), once for a process."""
    folders = [
        folder for folder in dict.fromkeys((os.environ.get("HAL_RTMOD_DIR"), module_directory(), *FOLDERS)) if folder
    ]
    path = next(
        (
            os.path.join(folder, name + ".so")
            for folder in folders
            if os.path.isfile(os.path.join(folder, name + ".so"))
        ),
        None,
    )
    if path is None:
        raise CycleError(
            f"there is no kinematics module {braceless(name)} in {braceless(', '.join(folders))}",
            "correct [KINS]KINEMATICS",
        )
    try:
        host = ctypes.CDLL(str(host_path()), mode=ctypes.RTLD_GLOBAL)
        module = ctypes.CDLL(path, mode=os.RTLD_NOW)
        ready = module.rtapi_app_main() == 0
    except (OSError, AttributeError) as error:
        raise CycleError(
            f"the kinematics module {braceless(name)} cannot be used here: {braceless(str(error))}",
            "report it with the module",
        ) from error
    if not ready:
        raise CycleError(f"the kinematics module {braceless(name)} does not start", "report it with the module")
    return host, module
