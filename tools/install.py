# SPDX-License-Identifier: GPL-2.0-or-later
"""Install chipwise, and remove exactly what was installed.

    install.py install|uninstall [--destdir DIR] [--prefix DIR] [--package]

Called by `make install` and `make uninstall`, with DESTDIR and PREFIX in the environment.  What goes where:

  build/modules/*.so       LinuxCNC's module directory (loadrt finds them there)
  hal/chipwise*.hal        LinuxCNC's HAL library (HALFILE = chipwise.hal)
  build/man/*.1 *.9        PREFIX/share/man/man1, man9
  build/completion/*       PREFIX/share/bash-completion/completions
  build/locale/*/          PREFIX/share/chipwise, laid out as in the repository
  README.md .. docs/       PREFIX/share/doc/chipwise
  VERSION                  PREFIX/share/chipwise
  build/libchipwise*.so    PREFIX/lib/chipwise
  configs/*.in             PREFIX/share/chipwise/configs, with the place filled in
  configs hal remap nc_files bin
                           PREFIX/share/chipwise, laid out as in the repository,
                           so that every relative path in the INI files holds
  bin/*                    PREFIX/bin, as links
  the sample machines      chipwise/ in LinuxCNC's aux_examples, a folder made of configs, hal and nc_files
                           (remap/chipwise/machine/sample_folder.py): the configuration selector offers it
  nc_files                 chipwise in LinuxCNC's ncfiles, as a link: the programs that a copy made by the selector sees

The Python files are compiled there, unless DESTDIR is set.  The list of files and directories made is
kept in PREFIX/share/chipwise/manifest; uninstall removes those, and what Python
compiled beside them.  Files already
there and equal are left alone, and files that are not ours are never replaced.
What a user has changed is not lost either: users_files.py.
With --package, for debian/rules, there is no manifest.
If the caller may not write there, it runs itself again through sudo.
"""

import argparse
import compileall
import contextlib
import filecmp
import glob
import os
import shutil
import subprocess
import sys

from users_files import Manifest, free_name, hash_of, is_changed, is_users, with_users_files

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, "remap"))

from chipwise.machine.sample_folder import sample_files  # noqa: E402

TREES = ("configs", "hal", "remap", "nc_files", "bin")
LEFT_OUT = (".in", ".stock", ".var", ".var.bak", ".pref", ".expanded", ".pyc", "~", ".gitignore", ".gitkeep")


class InstallError(Exception):
    """What cannot be done and what to do about it."""


def linuxcnc_directories():
    """-> (module directory, HAL library, samples of other packages) of the LinuxCNC on the PATH."""
    modinc = run("halcompile", "--print-modinc")
    module_dir = run(
        "make",
        "-s",
        "--no-print-directory",
        "-f",
        "-",
        "print",
        text=("none:\ninclude %s\nprint:\n\t@echo $(RTLIBDIR)\n" % modinc),
    )
    return module_dir, run("linuxcnc_var", "HALLIB_DIR"), run("linuxcnc_var", "LINUXCNC_AUX_EXAMPLES")


def run(*command, text=""):
    try:
        return subprocess.run(command, input=text, text=True, check=True, stdout=subprocess.PIPE).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise InstallError("%s failed (%s); use `make deps` first" % (command[0], error)) from error


def tree_files(tree):
    """Files and links of a directory of the repository, relative to it."""
    for folder, folders, names in os.walk(os.path.join(ROOT, tree)):
        folders[:] = sorted(name for name in folders if name != "__pycache__")
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for name in sorted(names + links):
            if not name.endswith(LEFT_OUT):
                yield os.path.relpath(os.path.join(folder, name), ROOT)


def for_prefix(name, content, share):
    """-> path of a file that depends on where we install to, in build/, a folder for each such place."""
    made = os.path.join(ROOT, "build", "prefix", share.strip("/").replace("/", "_"), name)
    os.makedirs(os.path.dirname(made), exist_ok=True)
    fresh = "%s.%d" % (made, os.getpid())
    with open(fresh, "wb") as handle:
        handle.write(content)
    os.replace(fresh, made)  # another installation may be reading it
    return made


def template(name, share):
    """-> the content of NAME.in with @SHARE@ replaced by where we install to."""
    with open(os.path.join(ROOT, name), "rb") as handle:
        return handle.read().replace(b"@SHARE@", os.fsencode(share))


def samples(hallib, aux_examples, share):
    """-> the part of the plan for the sample machines: their folder, and the programs where LinuxCNC keeps its own."""
    folder = os.path.join(aux_examples, "chipwise")
    plan = {
        os.path.join(folder, name): for_prefix(os.path.join("samples", name), content, share)
        for name, content in sample_files(ROOT, share).items()
    }
    plan[os.path.join(os.path.dirname(hallib), "ncfiles", "chipwise")] = ("link", share + "/nc_files")
    return plan


def wanted(prefix):
    """-> {target: source file, or ('link', text)}."""
    module_dir, hallib, aux_examples = linuxcnc_directories()
    share = os.path.join(prefix, "share", "chipwise")
    plan = samples(hallib, aux_examples, share)

    def files(pattern, folder):
        for source in sorted(glob.glob(os.path.join(ROOT, pattern))):
            plan[os.path.join(folder, os.path.basename(source))] = source

    files("build/modules/*.so", module_dir)
    files("hal/chipwise*.hal", hallib)
    for part in "19":
        files("build/man/*." + part, os.path.join(prefix, "share", "man", "man" + part))
    files("build/completion/*", os.path.join(prefix, "share", "bash-completion", "completions"))
    for page in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md"):
        files(page, os.path.join(prefix, "share", "doc", "chipwise"))
    for shelf in ("docs", "docs/user", "docs/design", "docs/proof"):
        for pattern in ("/*.[ms][dv]*", "/*.png", "/*.gif"):
            files(shelf + pattern, os.path.join(prefix, "share", "doc", "chipwise", shelf))
    for catalogue in glob.glob(os.path.join(ROOT, "build", "locale", "*", "LC_MESSAGES", "*.mo")):
        plan[os.path.join(share, os.path.relpath(catalogue, ROOT))] = catalogue
    files("VERSION", share)
    plan[share + "/configs/chipwise.inc"] = for_prefix(
        "chipwise.inc", template("configs/chipwise.inc.in", share), share
    )
    for library in ("libchipwise.so", "libchipwise_kinematics.so"):
        files("build/" + library, os.path.join(prefix, "lib", "chipwise"))
        if os.path.exists(os.path.join(ROOT, "build", library)):
            plan[share + "/build/" + library] = ("link", "../../../lib/chipwise/" + library)
    for tree in TREES:
        for name in tree_files(tree):
            source = os.path.join(ROOT, name)
            plan[os.path.join(share, name)] = ("link", os.readlink(source)) if os.path.islink(source) else source
            if tree == "bin":
                plan[os.path.join(prefix, name)] = ("link", "../share/chipwise/" + name)
    return plan


def is_there(source, target):
    """Whether a target already is what the plan wants."""
    if isinstance(source, tuple):
        return os.path.islink(target) and os.readlink(target) == source[1]
    return (
        os.path.isfile(target)
        and not os.path.islink(target)
        and filecmp.cmp(source, target, shallow=False)
        and bool(os.stat(source).st_mode & 0o100) == bool(os.stat(target).st_mode & 0o100)
    )


def make_directories(folder, made):
    """Make a directory and its parents, noting each one made."""
    missing = []
    while not os.path.isdir(folder):
        missing.append(folder)
        folder = os.path.dirname(folder)
    for folder in reversed(missing):
        os.mkdir(folder)
        os.chmod(folder, 0o755)
        made.append(folder)


def put(source, target):
    """Place one file or link; the new one appears whole or not at all."""
    fresh = target + ".new"
    if os.path.lexists(fresh):
        os.unlink(fresh)
    if isinstance(source, tuple):
        os.symlink(source[1], fresh)
    else:
        shutil.copyfile(source, fresh)
        os.chmod(fresh, 0o755 if os.stat(source).st_mode & 0o100 else 0o644)
    os.replace(fresh, target)


def manifest_path(destdir, prefix):
    return destdir + os.path.join(prefix, "share", "chipwise", "manifest")


def check_free(pending, old, destdir):
    """Raise InstallError for a file that is there and not from chipwise."""
    for target in pending:
        if os.path.lexists(destdir + target) and target not in old.files and not target.endswith(".new"):
            package = owner(destdir + target)
            raise InstallError(
                "%s is of the package %s; remove that first: apt remove %s" % (destdir + target, package, package)
                if package
                else "%s is there and not from chipwise; move it away" % (destdir + target)
            )


def owner(path):
    """Name of the Debian package that a file is of; '' if of none."""
    try:
        said = subprocess.run(
            ["dpkg", "-S", path], text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        )
    except OSError:
        return ""
    return said.stdout.partition(":")[0] if said.returncode == 0 else ""


def keep_beside(targets, destdir):
    """Copies of users' files whose place those of this version take."""
    for target in targets:
        yours = free_name(destdir + target)
        shutil.copy2(destdir + target, yours)
        print("chipwise: %s is the one of this version; the one you have changed is %s" % (destdir + target, yours))


def say_what_stays(gone, stay, to_put, destdir):
    """gone: users' files that this version does not have; stay: those that it has."""
    for target in gone:
        print("chipwise: %s is yours and stays; this version has no such file" % (destdir + target))
    for target in stay:
        print(
            "chipwise: %s stays as you have changed it%s"
            % (
                destdir + target,
                "; the one of this version is %s.new" % (destdir + target) if target + ".new" in to_put else "",
            )
        )


def install(destdir, prefix, is_package=False):
    plan = wanted(prefix)
    old = Manifest(manifest_path(destdir, prefix))
    to_put, stay, beside = with_users_files(plan, old, destdir)
    pending = {target: source for target, source in to_put.items() if not is_there(source, destdir + target)}
    gone = [
        target
        for target in old.files
        if target not in to_put and target not in stay and os.path.lexists(destdir + target)
    ]
    stale = [target for target in gone if not (is_users(target) and is_changed(old, target, destdir))]
    if not pending and not stale and old.files and set(old.files) <= set(to_put) | set(stay):
        print("chipwise: already installed in %s" % (destdir + prefix))
        return
    check_free(pending, old, destdir)
    new = Manifest(old.path)
    made = [destdir + folder for folder in old.folders]
    for target in [old.path[len(destdir) :], *to_put]:
        make_directories(os.path.dirname(destdir + target), made)
    new.folders = [folder[len(destdir) :] for folder in made]
    new.files.update({target: "" if target in pending else old.files.get(target, "") for target in to_put} | stay)
    if not is_package:
        new.write()  # first: an interrupted run can be undone
    keep_beside(beside, destdir)
    for target, source in pending.items():
        put(source, destdir + target)
    for target in stale:
        os.unlink(destdir + target)
    say_what_stays(set(gone) - set(stale), stay, to_put, destdir)
    if not is_package:
        new.files = {target: hash_of(destdir + target) for target in to_put} | stay
        new.files.update(
            {
                target: old.files[target]
                for target in old.files
                if target not in new.files and os.path.lexists(destdir + target)
            }
        )
        new.write()
    if not destdir:
        # An operator may not write there: without it LinuxCNC and each preview would compile the package again.
        compileall.compile_dir(os.path.join(prefix, "share", "chipwise", "remap"), quiet=1)
    print("chipwise: installed in %s" % (destdir + prefix))


def uninstall(destdir, prefix):
    old = Manifest(manifest_path(destdir, prefix))
    if not old.files:
        print("chipwise: nothing is installed in %s" % (destdir + prefix))
        return
    plan = {}
    with contextlib.suppress(InstallError):  # LinuxCNC is gone
        plan = wanted(prefix)
    users = {target for target in old.files if is_users(target) and is_changed(old, target, destdir, plan.get(target))}
    for target in old.files:
        if target not in users and os.path.lexists(destdir + target):
            os.unlink(destdir + target)
    os.unlink(old.path)
    for folder in sorted((destdir + folder for folder in old.folders), key=len, reverse=True):
        shutil.rmtree(os.path.join(folder, "__pycache__"), ignore_errors=True)
        with contextlib.suppress(OSError):
            os.rmdir(folder)
    left = {destdir + target for target in users}
    left.update(path for target in old.files for path in glob.glob(glob.escape(destdir + target) + ".yours*"))
    for folder in old.folders:
        left.update(os.path.join(place, name) for place, _, names in os.walk(destdir + folder) for name in names)
    for path in sorted(filter(os.path.lexists, left)):
        print("chipwise: %s is yours and stays" % path)
    print("chipwise: uninstalled from %s" % (destdir + prefix))


def main():
    parser = argparse.ArgumentParser(description="Install or uninstall chipwise.")
    parser.add_argument("action", choices=("install", "uninstall"))
    parser.add_argument("--destdir", default=os.environ.get("DESTDIR", ""))
    parser.add_argument("--prefix", default=os.environ.get("PREFIX") or "/usr/local")
    parser.add_argument("--package", action="store_true", help="for a Debian package: no manifest")
    options = parser.parse_args()
    destdir = os.path.abspath(options.destdir) if options.destdir else ""
    prefix = os.path.abspath(options.prefix)
    try:
        if options.action == "install":
            install(destdir, prefix, options.package)
        else:
            uninstall(destdir, prefix)
    except InstallError as error:
        return "chipwise: %s" % error
    except PermissionError as error:
        if os.getuid() == 0 or not shutil.which("sudo") or os.environ.get("SUDO_USER"):
            return "chipwise: %s; run it as root or set PREFIX or DESTDIR" % error
        os.execvp(
            "sudo",
            [
                "sudo",
                "env",
                "PATH=" + os.environ["PATH"],
                sys.executable,
                sys.argv[0],
                options.action,
                "--destdir",
                destdir,
                "--prefix",
                prefix,
            ],
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
