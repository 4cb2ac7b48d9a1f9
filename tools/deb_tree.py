# SPDX-License-Identifier: GPL-2.0-or-later
"""The tree that the Debian packages are built from: FOLDER/chipwise, the repository's files and a debian/changelog.

    deb_tree.py FOLDER

Called by tools/deb.
"""

import email.utils
import os
import re
import shutil
import subprocess
import sys
import time

from repository import ROOT, repository_files


def release_suffix(os_release):
    """The text of /etc/os-release -> what Debian appends to versions made for one release: "+deb12u1"."""
    values = dict(re.findall(r'^(\w+)="?([^"\n]*)', os_release, re.MULTILINE))
    if values.get("ID") != "debian" or not values.get("VERSION_ID", "").isdigit():
        raise SystemExit(
            "chipwise: packages are built on Debian 12 or 13, and this is %s; use tools/on-debian bookworm make deb"
            % values.get("PRETTY_NAME", "an unknown system")
        )
    return "+deb%su%s" % (values["VERSION_ID"], os.environ.get("CHIPWISE_DEB_REVISION", "1"))


def build_date():
    """Seconds: $SOURCE_DATE_EPOCH, else the date of the last commit, else of the newest file."""
    if os.environ.get("SOURCE_DATE_EPOCH"):
        return int(os.environ["SOURCE_DATE_EPOCH"])
    shown = subprocess.run(
        ["git", "-c", "safe.directory=*", "log", "-1", "--format=%ct"],
        cwd=ROOT,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ).stdout.strip()
    return int(shown) if shown else int(max(os.lstat(os.path.join(ROOT, name)).st_mtime for name in repository_files()))


def changelog(version, release, maintainer, date):
    """The text of debian/changelog; CHANGELOG.md, which chipwise-doc has, says what has changed."""
    return (
        "chipwise (%s) %s; urgency=medium\n\n  * Version %s. What has changed: CHANGELOG.md in chipwise-doc.\n\n"
        " -- %s  %s\n" % (version, release, version.split("+")[0], maintainer, email.utils.formatdate(date))
    )


def main():
    tree = os.path.join(os.path.abspath(sys.argv[1]), "chipwise")
    shutil.rmtree(tree, ignore_errors=True)
    for name in sorted(repository_files()):
        target = os.path.join(tree, name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copy2(os.path.join(ROOT, name), target, follow_symlinks=False)
    with open("/etc/os-release") as handle:
        text = handle.read()
    codename = re.search(r"^VERSION_CODENAME=(\w+)", text, re.MULTILINE)
    with open(os.path.join(ROOT, "VERSION")) as handle:
        version = handle.read().strip() + release_suffix(text)
    with open(os.path.join(tree, "debian", "control")) as handle:
        maintainer = re.search(r"^Maintainer: (.*)$", handle.read(), re.MULTILINE)[1]
    with open(os.path.join(tree, "debian", "changelog"), "w") as handle:
        handle.write(changelog(version, codename[1] if codename else "unstable", maintainer, build_date()))
    os.utime(tree, (time.time(), time.time()))


if __name__ == "__main__":
    main()
