# SPDX-License-Identifier: GPL-2.0-or-later
"""The packages of another processor, installed with all they depend on and tried; called by tools/try_arm64 in an
emulated Debian, as root.

 1. apt installs chipwise and chipwise-data of build/deb; each of their programs and LinuxCNC's is of that processor.
 2. `chipwise --version` and `chipwise load --check`.
 3. LinuxCNC's interpreter executes nc_files/slots.ngc on the sample mill, remapped codes and their plans included.
 4. Each function that a component calls is one of rtapi_app's, HAL's or C's, and rtapi_app finds its rtapi_app_main.
    Nothing is loaded:  halcmd of LinuxCNC 2.9 crashes in qemu-user 7.2 with each `loadrt`, that of LinuxCNC's own and2
    as well.

Each step prints a line with its seconds; exit status 1 with the reason when one has another outcome.
"""

import glob
import os
import platform
import sys
import time

from package_trial import HOME, USER, Failed, need, run  # apt asks no questions then

APT = ("apt-get", "-q", "-y", "--no-install-recommends", "install")
MODULES = "/usr/lib/linuxcnc/modules/"
COMPONENTS = (
    "chipwise_inputs",
    "chipwise_command",
    "stock_tracker",
    "volumetric_feed",
    "chipwise_guard",
    "spindle_sim",
    "tracer",
    "tracer_model",
    "tracer_slave",
    "tracer_offset",
)
# What rtapi_app has loaded when it loads a component
LIBRARIES = (
    "/usr/bin/rtapi_app",
    MODULES + "hal_lib.so",
    "/lib/*/libc.so.6",
    "/lib/*/libm.so.6",
    "/lib/ld-linux-*.so.*",
    "/usr/lib/liblinuxcnchal.so.0",
)


def machine(path):
    """The processor in an ELF file's head."""
    with open(path, "rb") as handle:
        return int.from_bytes(handle.read(20)[18:20], "little")


def install():
    """Step 1."""
    run("apt-get", "-q", "update")
    debs = [
        glob.glob("build/deb/chipwise%s.deb" % name)
        for name in ("_*_" + run("dpkg", "--print-architecture").strip(), "-data_*")
    ]
    need(
        all(len(found) == 1 for found in debs),
        "build/deb has not one package chipwise and one chipwise-data: %s" % debs,
    )
    run(*APT, *(os.path.abspath(found[0]) for found in debs))
    ours = machine("/bin/sh")
    for path in [MODULES + name + ".so" for name in COMPONENTS] + ["/usr/bin/rtapi_app", "/usr/bin/milltask"]:
        need(machine(path) == ours, "%s is of another processor" % path)
    return "%s %s" % (
        platform.machine(),
        run("dpkg-query", "-W", "-f", "${Package} ${Version} ", "chipwise", "linuxcnc-uspace").strip(),
    )


def version():
    """Step 2."""
    with open("VERSION") as handle:
        wanted = handle.read().strip()
    said = run("chipwise", "--version", user=USER).strip()
    need(wanted in said, 'chipwise --version is "%s", not %s' % (said, wanted))
    run("chipwise", "load", "--check", user=USER)
    return said


def interpreter():
    """Step 3."""
    folder = HOME + "/machines"
    run("chipwise", "new-config", folder, user=USER)
    motion = run("chipwise", "try", "nc_files/slots.ngc", "--ini", "mill.ini", user=USER, cwd=folder)
    need("STRAIGHT_FEED" in motion and "PROGRAM_END" in motion, "slots.ngc does not move or end:\n" + motion[-2000:])
    return "%d lines of motion" % motion.count("\n")


def symbols(path, which):
    """Names of a file's dynamic symbols, without versions; which: --defined-only or --undefined-only."""
    rows = [line.split() for line in run("nm", "-D", which, path).splitlines()]
    return {row[-1].partition("@")[0] for row in rows if row[-2] not in "wv"}


def components():
    """Step 4."""
    run(*APT, "binutils")
    libraries = [path for pattern in LIBRARIES for path in glob.glob(pattern)]
    known = set().union(*(symbols(path, "--defined-only") for path in libraries))
    for name in COMPONENTS:
        path = MODULES + name + ".so"
        missing = symbols(path, "--undefined-only") - known
        need(not missing, "%s calls what nobody has: %s" % (path, ", ".join(sorted(missing))))
        need("rtapi_app_main" in symbols(path, "--defined-only"), "%s has no rtapi_app_main" % path)
    return "%d components" % len(COMPONENTS)


def main():
    try:
        for step in (install, version, interpreter, components):
            begin = time.monotonic()
            print("%s: %s (%.0f s)" % (step.__name__, step(), time.monotonic() - begin), flush=True)
    except Failed as error:
        sys.exit("chipwise: processor trial: %s" % error)


if __name__ == "__main__":
    main()
