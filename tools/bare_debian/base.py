# SPDX-License-Identifier: GPL-2.0-or-later
"""The base system of a release, made once by mmdebstrap.  Called by on_debian.py."""

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile

from bare_debian.apt import apt_settings, machine_keys
from bare_debian.common import USER, USER_ID, Refusal, read
from bare_debian.processor import emulated
from repository import ROOT

INCLUDE = "git make sudo"


def cache_directory():
    """Where bases, packages and kept systems are."""
    path = os.environ.get("CHIPWISE_DEBIAN_DIR")
    if not path:
        build = os.path.join(ROOT, "build")
        if not os.path.isdir(build):
            os.mkdir(build)
            owner = os.stat(ROOT)
            os.chown(build, owner.st_uid, owner.st_gid)
        path = os.path.join(build, "debian")
    path = os.path.abspath(path)
    os.makedirs(path, mode=0o755, exist_ok=True)
    return path


@contextlib.contextmanager
def locked(path):
    """Hold a lock file; others wait."""
    with open(path, "w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def ensure_base(folder, options, sources):
    """Make the base of a release if it is missing or outdated; -> its directory."""
    recipe = hashlib.sha256("\n".join([INCLUDE, USER, *sources]).encode()).hexdigest()
    base, stamp = os.path.join(folder, "base"), os.path.join(folder, "recipe")
    with locked(os.path.join(folder, "lock")):
        if not options.renew and os.path.isdir(base) and read(stamp) == recipe:
            return base
        print("chipwise: making a Debian %s in %s" % (options.release, folder), file=sys.stderr)
        for path in (base, os.path.join(folder, "kept")):
            if os.path.isdir(path):
                shutil.rmtree(path)
        fresh = tempfile.mkdtemp(prefix="fresh.", dir=folder)
        os.chmod(fresh, 0o711)  # apt fetches as a user of its own
        try:
            if options.processor:
                emulated(options.processor, lambda: bootstrap(options, fresh, sources))
            else:
                bootstrap(options, fresh, sources)
            os.rename(os.path.join(fresh, "base"), base)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
        with open(stamp, "w") as handle:
            handle.write(recipe)
    return base


def bootstrap(options, fresh, sources):
    """mmdebstrap into fresh/base, with this machine's apt settings and keys."""
    list_file, settings, keys = (os.path.join(fresh, name) for name in ("sources.list", "apt.conf", "keys"))
    os.mkdir(keys)
    for name, key in machine_keys().items():
        shutil.copyfile(key, os.path.join(keys, name))
    with open(list_file, "w") as handle:
        handle.write("\n".join(sources) + "\n")
    with open(settings, "w") as handle:
        handle.write("\n".join(apt_settings(sources)[0]) + "\n")
        handle.write('Dir::Etc::netrc "/etc/apt/auth.conf";\nDir::Etc::netrcparts "/etc/apt/auth.conf.d";\n')
    done = subprocess.run(
        [
            "mmdebstrap",
            "--mode=root",
            "--variant=minbase",
            "--format=directory",
            "--include=" + INCLUDE.replace(" ", ","),
            "--aptopt=" + settings,
            "--keyring=" + keys,
            *(
                ["--architectures=" + options.processor, "--skip=check/qemu,chroot/mount/sys"]
                if options.processor
                else []
            ),
            '--customize-hook=rm -f "$1/etc/apt/apt.conf.d/99mmdebstrap"',
            '--customize-hook=chroot "$1" useradd -m -u %d -s /bin/bash %s' % (USER_ID, USER),
            '--customize-hook=echo "%s ALL=(ALL) NOPASSWD: ALL" >"$1/etc/sudoers.d/%s"' % (USER, USER),
            options.release,
            os.path.join(fresh, "base"),
            list_file,
        ],
        stdin=subprocess.DEVNULL,
        stdout=sys.stderr,
    )
    if done.returncode != 0:
        raise Refusal(
            "mmdebstrap could not make a Debian %s (status %d); does this machine's "
            "archive have that release?" % (options.release, done.returncode)
        )
