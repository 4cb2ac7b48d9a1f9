# SPDX-License-Identifier: GPL-2.0-or-later
"""Install chipwise, and remove exactly what was installed.

    install.py install|uninstall [--destdir DIR] [--prefix DIR]

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

The Python files are compiled there.  The list of files and directories made is
kept in PREFIX/share/chipwise/manifest; uninstall removes those, and what Python
compiled beside them.  Files already
there and equal are left alone, and files that are not ours are never replaced.
If the caller may not write there, it runs itself again through sudo.
"""

import argparse
import compileall
import filecmp
import glob
import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, 'remap'))

from chipwise.machine.sample_folder import sample_files         # noqa: E402

TREES = ('configs', 'hal', 'remap', 'nc_files', 'bin')
LEFT_OUT = ('.in', '.stock', '.var', '.var.bak', '.pref', '.expanded', '.pyc', '~', '.gitignore', '.gitkeep')


class InstallError(Exception):
    """What cannot be done and what to do about it."""


def linuxcnc_directories():
    """-> (module directory, HAL library, samples of other packages) of the LinuxCNC on the PATH."""
    modinc = run('halcompile', '--print-modinc')
    module_dir = run('make', '-s', '--no-print-directory', '-f', '-', 'print', text=(
        'none:\ninclude %s\nprint:\n\t@echo $(RTLIBDIR)\n' % modinc))
    return module_dir, run('linuxcnc_var', 'HALLIB_DIR'), run('linuxcnc_var', 'LINUXCNC_AUX_EXAMPLES')


def run(*command, text=''):
    try:
        return subprocess.run(command, input=text, text=True, check=True,
                              stdout=subprocess.PIPE).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise InstallError('%s failed (%s); use `make deps` first' % (command[0], error)) from error


def tree_files(tree):
    """Files and links of a directory of the repository, relative to it."""
    for folder, folders, names in os.walk(os.path.join(ROOT, tree)):
        folders[:] = sorted(name for name in folders if name != '__pycache__')
        links = [name for name in folders if os.path.islink(os.path.join(folder, name))]
        for name in sorted(names + links):
            if not name.endswith(LEFT_OUT):
                yield os.path.relpath(os.path.join(folder, name), ROOT)


def for_prefix(name, content, share):
    """-> path of a file that depends on where we install to, in build/, a folder for each such place."""
    made = os.path.join(ROOT, 'build', 'prefix', share.strip('/').replace('/', '_'), name)
    os.makedirs(os.path.dirname(made), exist_ok=True)
    fresh = '%s.%d' % (made, os.getpid())
    with open(fresh, 'wb') as handle:
        handle.write(content)
    os.replace(fresh, made)             # another installation may be reading it
    return made


def template(name, share):
    """-> the content of NAME.in with @SHARE@ replaced by where we install to."""
    with open(os.path.join(ROOT, name), 'rb') as handle:
        return handle.read().replace(b'@SHARE@', os.fsencode(share))


def samples(hallib, aux_examples, share):
    """-> the part of the plan for the sample machines: their folder, and the programs where LinuxCNC keeps its own."""
    folder = os.path.join(aux_examples, 'chipwise')
    plan = {os.path.join(folder, name): for_prefix(os.path.join('samples', name), content, share)
            for name, content in sample_files(ROOT, share).items()}
    plan[os.path.join(os.path.dirname(hallib), 'ncfiles', 'chipwise')] = ('link', share + '/nc_files')
    return plan


def wanted(prefix):
    """-> {target: source file, or ('link', text)}."""
    module_dir, hallib, aux_examples = linuxcnc_directories()
    share = os.path.join(prefix, 'share', 'chipwise')
    plan = samples(hallib, aux_examples, share)

    def files(pattern, folder):
        for source in sorted(glob.glob(os.path.join(ROOT, pattern))):
            plan[os.path.join(folder, os.path.basename(source))] = source
    files('build/modules/*.so', module_dir)
    files('hal/chipwise*.hal', hallib)
    for part in '19':
        files('build/man/*.' + part, os.path.join(prefix, 'share', 'man', 'man' + part))
    files('build/completion/*', os.path.join(prefix, 'share', 'bash-completion', 'completions'))
    for page in ('README.md', 'CHANGELOG.md', 'CONTRIBUTING.md'):
        files(page, os.path.join(prefix, 'share', 'doc', 'chipwise'))
    for shelf in ('docs', 'docs/user', 'docs/design', 'docs/proof'):
        for pattern in ('/*.[ms][dv]*', '/*.png'):
            files(shelf + pattern, os.path.join(prefix, 'share', 'doc', 'chipwise', shelf))
    for catalogue in glob.glob(os.path.join(ROOT, 'build', 'locale', '*', 'LC_MESSAGES', '*.mo')):
        plan[os.path.join(share, os.path.relpath(catalogue, ROOT))] = catalogue
    files('VERSION', share)
    plan[share + '/configs/chipwise.inc'] = for_prefix('chipwise.inc', template('configs/chipwise.inc.in', share), share)
    for library in ('libchipwise.so', 'libchipwise_kinematics.so'):
        files('build/' + library, os.path.join(prefix, 'lib', 'chipwise'))
        if os.path.exists(os.path.join(ROOT, 'build', library)):
            plan[share + '/build/' + library] = ('link', '../../../lib/chipwise/' + library)
    for tree in TREES:
        for name in tree_files(tree):
            source = os.path.join(ROOT, name)
            plan[os.path.join(share, name)] = (
                ('link', os.readlink(source)) if os.path.islink(source) else source)
            if tree == 'bin':
                plan[os.path.join(prefix, name)] = ('link', '../share/chipwise/' + name)
    return plan


def is_there(source, target):
    """Whether a target already is what the plan wants."""
    if isinstance(source, tuple):
        return os.path.islink(target) and os.readlink(target) == source[1]
    return (os.path.isfile(target) and not os.path.islink(target)
            and filecmp.cmp(source, target, shallow=False)
            and bool(os.stat(source).st_mode & 0o100) == bool(os.stat(target).st_mode & 0o100))


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
    fresh = target + '.new'
    if os.path.lexists(fresh):
        os.unlink(fresh)
    if isinstance(source, tuple):
        os.symlink(source[1], fresh)
    else:
        shutil.copyfile(source, fresh)
        os.chmod(fresh, 0o755 if os.stat(source).st_mode & 0o100 else 0o644)
    os.replace(fresh, target)


def manifest_path(destdir, prefix):
    return destdir + os.path.join(prefix, 'share', 'chipwise', 'manifest')


def read_manifest(path):
    """-> (files, directories made), as installed paths without DESTDIR."""
    if not os.path.exists(path):
        return [], []
    with open(path) as handle:
        lines = handle.read().split('\n')
    return ([line[2:] for line in lines if line.startswith('f ')],
            [line[2:] for line in lines if line.startswith('d ')])


def install(destdir, prefix):
    plan = wanted(prefix)
    manifest = manifest_path(destdir, prefix)
    old, made = read_manifest(manifest)
    made = [destdir + folder for folder in made]
    pending = {target: source for target, source in plan.items()
               if not is_there(source, destdir + target)}
    stale = [target for target in old
             if target not in plan and os.path.lexists(destdir + target)]
    if not pending and not stale and sorted(old) == sorted(plan):
        print('chipwise: already installed in %s' % (destdir + prefix))
        return
    for target in pending:
        if os.path.lexists(destdir + target) and target not in old:
            raise InstallError('%s is there and not from chipwise; move it away'
                               % (destdir + target))
    make_directories(os.path.dirname(manifest), made)
    for target in plan:
        make_directories(os.path.dirname(destdir + target), made)
    folders = [folder[len(destdir):] for folder in made]
    with open(manifest, 'w') as handle:      # first: an interrupted run can be undone
        handle.write(''.join(['f %s\n' % name for name in sorted(set(plan) | set(stale))]
                             + ['d %s\n' % name for name in folders]))
    os.chmod(manifest, 0o644)
    for target, source in pending.items():
        put(source, destdir + target)
    for target in stale:
        os.unlink(destdir + target)
    if stale:
        with open(manifest, 'w') as handle:
            handle.write(''.join(['f %s\n' % name for name in sorted(plan)]
                                 + ['d %s\n' % name for name in folders]))
    # An operator may not write there: without it LinuxCNC and each preview would compile the package again.
    compileall.compile_dir(os.path.join(destdir + prefix, 'share', 'chipwise', 'remap'), quiet=1, stripdir=destdir or None)
    print('chipwise: installed in %s' % (destdir + prefix))


def uninstall(destdir, prefix):
    manifest = manifest_path(destdir, prefix)
    files, folders = read_manifest(manifest)
    if not files:
        print('chipwise: nothing is installed in %s' % (destdir + prefix))
        return
    for target in files:
        if os.path.lexists(destdir + target):
            os.unlink(destdir + target)
    os.unlink(manifest)
    for folder in sorted((destdir + folder for folder in folders), key=len, reverse=True):
        shutil.rmtree(os.path.join(folder, '__pycache__'), ignore_errors=True)
        try:
            os.rmdir(folder)
        except FileNotFoundError:
            pass
        except OSError:
            print('chipwise: %s is not empty and stays' % folder)
    print('chipwise: uninstalled from %s' % (destdir + prefix))


def main():
    parser = argparse.ArgumentParser(description='Install or uninstall chipwise.')
    parser.add_argument('action', choices=('install', 'uninstall'))
    parser.add_argument('--destdir', default=os.environ.get('DESTDIR', ''))
    parser.add_argument('--prefix', default=os.environ.get('PREFIX') or '/usr/local')
    options = parser.parse_args()
    destdir = os.path.abspath(options.destdir) if options.destdir else ''
    prefix = os.path.abspath(options.prefix)
    try:
        {'install': install, 'uninstall': uninstall}[options.action](destdir, prefix)
    except InstallError as error:
        return 'chipwise: %s' % error
    except PermissionError as error:
        if os.getuid() == 0 or not shutil.which('sudo') or os.environ.get('SUDO_USER'):
            return 'chipwise: %s; run it as root or set PREFIX or DESTDIR' % error
        os.execvp('sudo', ['sudo', 'env', 'PATH=' + os.environ['PATH'], sys.executable, sys.argv[0],
                           options.action, '--destdir', destdir, '--prefix', prefix])
    return 0


if __name__ == '__main__':
    sys.exit(main())
