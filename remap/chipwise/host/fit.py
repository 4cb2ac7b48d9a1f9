# SPDX-License-Identifier: GPL-2.0-or-later
"""Whether realtime modules, programs and LinuxCNC belong together.

Who calls it: cli/load.py before a module is loaded, and through it the package's trigger; tools/build_stamp, which
makes the stamp.

stock_tracker and chipwise_inputs read structures in LinuxCNC's memory.  Another LinuxCNC has them elsewhere, and a
number read from a wrong place looks like any other.  So each module carries a stamp:

    chipwise-stamp CHIPWISE LINUXCNC HEADERS

the versions of chipwise and of the LinuxCNC that it was built with, and a hash of LinuxCNC's headers.  The hash finds
two builds of LinuxCNC with one version, as a clone of its master has for months; it is compared where headers are
installed.
"""

import hashlib
import os
import re
import subprocess
from pathlib import Path
from typing import NamedTuple, Optional

from chipwise import ROOT, version
from chipwise.errors import CycleError, braceless

INSTALLED = Path("/usr/include/linuxcnc")
MODULES = (
    "chipwise_command",
    "chipwise_guard",
    "chipwise_inputs",
    "stock_tracker",
    "volumetric_feed",
)  # what `chipwise load` loads
MARK = b"chipwise-stamp "
STAMP = re.compile(MARK + rb"([!-~]+) ([!-~]+) ([!-~]+)\0")


class Stamp(NamedTuple):
    """What a module was built from and with."""

    chipwise: str
    linuxcnc: str
    headers: str  # fingerprint() of LinuxCNC's headers; "none" where there were none

    def text(self) -> str:
        """As the module has it, without the zero at its end."""
        return MARK.decode() + " ".join(self)


def linuxcnc_variable(name: str) -> str:
    """What LinuxCNC's own linuxcnc_var says; "" without a LinuxCNC."""
    try:
        return subprocess.run(
            ["linuxcnc_var", name],
            check=True,
            text=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return ""


def linuxcnc_version() -> str:
    """The version of the LinuxCNC that runs, else of the one on the PATH; "" without one."""
    return os.environ.get("LINUXCNCVERSION") or linuxcnc_variable("LINUXCNCVERSION")


def fingerprint(folder: Path = INSTALLED) -> str:
    """A hash of the names and texts of the C headers in a folder; "none" where there are none."""
    names = sorted(folder.glob("*.h"))
    texts = hashlib.sha256()
    for name in names:
        texts.update(name.name.encode() + b"\0" + name.read_bytes() + b"\0")
    return texts.hexdigest()[:16] if names else "none"


def module_folder() -> Optional[Path]:
    """Where LinuxCNC loads realtime modules from, as its rtapi.conf has it; None if that is not known."""
    beside = os.path.dirname(linuxcnc_variable("REALTIME"))
    for path in (Path(beside, "rtapi.conf"), Path("/etc/linuxcnc/rtapi.conf")):
        try:
            found = re.search(r"^RTLIB_DIR=(\S+)", path.read_text(errors="replace"), re.MULTILINE)
        except OSError:
            continue
        if found:
            return Path(found[1])
    return None


def stamp_of(path: Path) -> Optional[Stamp]:
    """The stamp in a module's file; None for a module without one."""
    found = STAMP.search(path.read_bytes())
    return Stamp(*(word.decode("ascii", "replace") for word in found.groups())) if found else None


def remedy() -> str:
    """What brings all parts to one version: by the packages, or by `make install`."""
    if ROOT == "/usr/share/chipwise":
        return "install the packages chipwise and chipwise-data of this LinuxCNC again (apt install --reinstall)"
    return "rebuild: `make install` in chipwise's folder"


def check_stamp(name: str, stamp: Optional[Stamp], wanted: Stamp) -> None:
    """Raise CycleError if a module's stamp is not the wanted one."""
    if stamp is None:
        raise CycleError(f"{name} is of an earlier chipwise, without a stamp", remedy())
    if stamp.chipwise != wanted.chipwise:
        raise CycleError(
            f"{name} is of chipwise {braceless(stamp.chipwise)}, and the programs are {braceless(wanted.chipwise)}",
            remedy(),
        )
    if stamp.linuxcnc != wanted.linuxcnc:
        raise CycleError(
            f"{name} was built for LinuxCNC {braceless(stamp.linuxcnc)}, and this is LinuxCNC "
            f"{braceless(wanted.linuxcnc)}, "
            "whose memory may be laid out otherwise",
            remedy(),
        )
    if "none" not in (stamp.headers, wanted.headers) and stamp.headers != wanted.headers:
        raise CycleError(
            f"{name} was built with other headers of LinuxCNC {braceless(wanted.linuxcnc)} than those in "
            f"{braceless(str(INSTALLED))}, so its memory may be laid out otherwise",
            remedy(),
        )


def check_fit() -> None:
    """Raise CycleError unless each module that `chipwise load` loads was built for this chipwise and this LinuxCNC."""
    folder = module_folder()
    if folder is None:
        raise CycleError(
            "LinuxCNC's folder of modules is not known: no RTLIB_DIR in its rtapi.conf", "install LinuxCNC again"
        )
    wanted = Stamp(version(), linuxcnc_version(), fingerprint())
    for name in MODULES:
        path = folder / (name + ".so")
        try:
            stamp = stamp_of(path)
        except OSError as error:
            raise CycleError(
                f"the component {braceless(str(path))} cannot be read: {error.strerror}", remedy()
            ) from error
        check_stamp(path.name, stamp, wanted)
