# SPDX-License-Identifier: GPL-2.0-or-later
"""Install, upgrade, remove and purge the packages on a bare Debian; called in it by tools/try_packages, as root.

    package_trial.py        build/deb_before has the packages of the release before, build/deb those to be tried

 1. The release before is installed; an ordinary user makes a folder of sample machines, and runs a program with
    LinuxCNC's own rtapi_app, which is setuid root.
 2. The user changes INI file, tools, and adds stock and stations; root changes settings in /etc/chipwise, a sample and
    a HAL file.
 3. The upgrade.  Every file that was changed is byte-equal, the HAL file is kept beside the new one, the program runs.
 4. debian/tests, as autopkgtest calls them: the interpreter over the sample programs, the selector's copy started by
    another user.
 5. LinuxCNC's folder of modules changes: the trigger says whether the components fit.  A component of another version:
    LinuxCNC refuses.
 6. Removal: what is left are settings and users' files, each is named.  Purge: the system is as before 1, but for
    users' files.

Each step prints a line with its seconds; exit status 1 with the reason when one has another outcome.
"""

import glob
import hashlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time

USER = "user"
HOME = "/home/" + USER
MINE = HOME + "/linuxcnc/configs/chipwise"
SHARED = "/usr/share/linuxcnc/aux_examples/chipwise/mill.ini"
HAL = "/usr/share/linuxcnc/hallib/chipwise.hal"
CODES = "/etc/chipwise/chipwise_codes.inc"
TREES = ("/etc", "/usr", "/opt", "/root", "/home", "/var/lib", "/srv")
# What apt, dpkg and Python keep for themselves, and this trial's own copy of the repository
OTHERS = re.compile(
    r"/var/lib/(apt|dpkg)/|/(etc/ld.so.cache|var/lib/systemd/)|/root/chipwise/|\.pyc$|/__pycache__$|/etc/\.pwd\.lock|"
    r"/mandb/|\.cache/"
)
APT = ("apt-get", "-q", "-y", "--no-install-recommends", "-o", "Dpkg::Options::=--force-confold")
os.environ.update(DEBIAN_FRONTEND="noninteractive")


class Failed(Exception):
    """A step with another outcome than it has to have."""


def run(*command, user=None, fails=False, **more):
    """-> what a command printed, errors included; fails: it has to end with another status than 0."""
    if user:
        command = (
            "setpriv",
            "--reuid",
            user,
            "--regid",
            user,
            "--init-groups",
            "env",
            "HOME=" + HOME,
            "USER=" + user,
            *command,
        )
    done = subprocess.run(
        command, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **more
    )
    if (done.returncode != 0) != fails:
        raise Failed("%s: status %d\n%s" % (" ".join(command), done.returncode, done.stdout[-3000:]))
    return done.stdout


def need(condition, what):
    if not condition:
        raise Failed(what)


def content(path):
    with open(path, "rb") as handle:
        return handle.read()


def system():
    """{path: hash, link or kind} of the files that belong to the system and its users."""
    found = {}
    for tree in TREES:
        for folder, folders, names in os.walk(tree):
            for name in folders + names:
                path = os.path.join(folder, name)
                if OTHERS.search(path):
                    continue
                if os.path.islink(path):
                    found[path] = os.readlink(path)
                elif os.path.isfile(path):
                    found[path] = hashlib.sha256(content(path)).hexdigest()
                else:
                    found[path] = "folder"
    return found


def packages(folder):
    """Paths of the three packages for this release."""
    with open("/etc/os-release") as handle:
        number = re.search(r'VERSION_ID="(\d+)"', handle.read())[1]
    found = sorted(glob.glob(os.path.abspath("%s/chipwise*+deb%su*.deb" % (folder, number))))
    need(len(found) == 3, "%s has %d packages for Debian %s, not 3" % (folder, len(found), number))
    return found


def mill(name):
    """Run nc_files/slots.ngc as the user on MINE/mill_headless.ini -> its summary."""
    summary = "/tmp/%s.json" % name
    printed = run(
        "env",
        "CHIPWISE_PROGRAM=%s/nc_files/slots.ngc" % MINE,
        "CHIPWISE_SUMMARY=" + summary,
        "CHIPWISE_TIMEOUT=300",
        "unshare",
        "--ipc",
        "--pid",
        "--fork",
        "--kill-child",
        "--mount-proc",
        "setpriv",
        "--reuid",
        USER,
        "--regid",
        USER,
        "--init-groups",
        "env",
        "HOME=" + HOME,
        "USER=" + USER,
        "linuxcnc",
        "-r",
        MINE + "/mill_headless.ini",
        timeout=400,
    )
    with open(summary) as handle:
        found = json.load(handle)
    need(found["finished"] and not found["errors"], "slots.ngc did not finish: %s\n%s" % (found, printed[-2000:]))
    return found


def change():
    """What users and root change -> {path: content}."""
    os.makedirs(MINE + "/stock", exist_ok=True)
    changed = [MINE + "/mill_headless.ini", MINE + "/tools.toml", SHARED, CODES]
    for path in changed:
        with open(path, "ab") as handle:
            handle.write(b"# changed\n")
    for name, text in (("stock/1.stock", b"\1\2\3"), ("stations.toml", b"# mine\n")):
        with open(os.path.join(MINE, name), "wb") as handle:
            handle.write(text)
        changed.append(os.path.join(MINE, name))
    with open(HAL, "ab") as handle:
        handle.write(b"# changed\n")
    run("chown", "-R", USER + ":", HOME + "/linuxcnc")
    return {path: content(path) for path in changed}


def upgrade(new):
    """Step 3."""
    hal, users = content(HAL), change_before()
    said = run(*APT, "install", *new)
    for path, text in users.items():
        need(content(path) == text, path + " is not as it was")
    need(content(HAL + ".yours") == hal and content(HAL) != hal, HAL + " is not replaced and kept")
    for part in (SHARED + " is as you changed it", HAL + ".yours", "the components fit LinuxCNC"):
        need(part in said, 'the upgrade does not say "%s":\n%s' % (part, said[-3000:]))
    need(
        os.path.exists(SHARED + ".new") and os.path.exists(CODES + ".dpkg-dist"),
        "a new version is not beside the changed file",
    )
    need(
        b"CELL = 0.25" in content("/etc/chipwise/chipwise.inc"),
        "a setting that was not changed is that of the release before",
    )
    return users


def change_before():
    """The changes of change() as they are now."""
    names = [MINE + "/" + name for name in ("mill_headless.ini", "tools.toml", "stock/1.stock", "stations.toml")]
    return {path: content(path) for path in [*names, SHARED, CODES]}


def autopkgtests():
    """Step 4; -> the names of those that passed."""
    names = ("fit", "interpreter", "machine")
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            run(
                "env",
                "AUTOPKGTEST_TMP=" + folder,
                "AUTOPKGTEST_NORMAL_USER=" + USER,
                "debian/tests/" + name,
                timeout=600,
            )
    return ", ".join(names)


def misfit(old):
    """Step 5."""
    said = run(*APT, "install", "--reinstall", "linuxcnc-uspace")
    need("the components fit LinuxCNC" in said, "the trigger says nothing:\n" + said[-2000:])
    module = "/usr/lib/linuxcnc/modules/stock_tracker.so"
    right = content(module)
    run(
        "sh",
        "-c",
        'dpkg-deb --fsys-tarfile "$0" | tar -x -O .%s >%s' % (module, module),
        next(path for path in old if "/chipwise_" in path),
    )
    said = run("chipwise", "load", "--check", fails=True)
    need("stock_tracker.so is of chipwise 0.3.9, and the programs are" in said and "reinstall" in said, said)
    said = run(
        "unshare",
        "--ipc",
        "--pid",
        "--fork",
        "--kill-child",
        "--mount-proc",
        "setpriv",
        "--reuid",
        USER,
        "--regid",
        USER,
        "--init-groups",
        "env",
        "HOME=" + HOME,
        "linuxcnc",
        "-r",
        MINE + "/mill_headless.ini",
        fails=True,
        timeout=120,
    )
    need(
        "stock_tracker.so is of chipwise 0.3.9" in said,
        "LinuxCNC starts with a component of another version:\n" + said[-2000:],
    )
    with open(module, "wb") as handle:
        handle.write(right)


def gone(before, users, purged):
    """Step 6: compare the system with the one before; names what is left.  Files of packages that are there, as
    dependencies that another package recommends and apt's autoremove leaves, are not ours."""
    now = system()
    dependencies = {
        path
        for path in run("sh", "-c", "cat /var/lib/dpkg/info/*.list").split("\n")
        if not path.startswith("/etc/chipwise/")
    }
    left = {path for path in now if path not in before and now[path] != "folder"} - dependencies
    mine = set(users) | {HAL + ".yours", SHARED + ".new"} | {path for path in left if path.startswith(HOME)}
    settings = {path for path in left if path.startswith("/etc/chipwise/")}
    need(not purged or not settings, "purge has left %s" % sorted(settings))
    need(left <= mine | settings, "left behind: %s" % sorted(left - mine - settings))
    lost = {path for path in before if now.get(path) != before[path]}
    need(not lost, "not as before: %s" % sorted(lost))
    for path in users:
        need(path == CODES or os.path.exists(path), path + " is gone")


def step(text, begin):
    print("package_trial: %s, %.0f s" % (text, time.monotonic() - begin), flush=True)
    return time.monotonic()


def main():
    begin = time.monotonic()
    run("apt-get", "-q", "update")
    run(*APT, "install", "linuxcnc-uspace", "procps")
    old, new = packages("build/deb_before"), packages("build/deb")
    run("chmod", "755", "/root")
    before = system()
    begin = step("LinuxCNC is installed: %s" % run("dpkg-query", "-W", "linuxcnc-uspace").split()[1], begin)
    run(*APT, "install", *old)
    need(run("chipwise", "--version") == "chipwise 0.3.9\n", "the release before is not installed")
    run("chipwise", "new-config", user=USER)
    begin = step("the release before is installed, with a folder of the user's", begin)
    begin = step("it runs slots.ngc in %.0f s of the machine" % mill("before")["cycle_s"], begin)
    change()
    users = upgrade(new)
    begin = step("upgraded; %d changed files are byte-equal" % len(users), begin)
    begin = step("it runs slots.ngc in %.0f s of the machine" % mill("after")["cycle_s"], begin)
    begin = step("debian/tests pass: " + autopkgtests(), begin)
    misfit(old)
    begin = step("a component that does not fit is refused", begin)
    said = run(*APT, "remove", "chipwise", "chipwise-data", "chipwise-doc")
    for path in (SHARED, MINE + "/mill.ini", HAL + ".yours"):
        need(path in said, "the removal does not name %s:\n%s" % (path, said[-3000:]))
    print("".join(line + "\n" for line in said.splitlines() if line.startswith("chipwise: ")), end="")
    gone(before, users, False)
    run(*APT, "purge", "chipwise", "chipwise-data", "chipwise-doc")
    run(*APT, "autoremove", "--purge")
    gone(before, users, True)
    step("removed and purged: the system is as before but for users' files", begin)


if __name__ == "__main__":
    try:
        main()
    except Failed as error:
        sys.exit("package_trial: %s" % error)
