# SPDX-License-Identifier: GPL-2.0-or-later
"""Run a command on a bare Debian of another release.

    tools/on-debian [options] RELEASE COMMAND [ARGUMENT...]
    tools/on-debian trixie make test

What a fresh machine has: Debian's smallest system, made by mmdebstrap from
Debian's packages, with git, make and sudo, and a copy of this repository's files
(those git knows or would add; no build/).  Whatever COMMAND needs besides, it
installs itself.  Called by hand, by CI and by tests/install/test_on_debian.py.

1. The base system is made once per release and kept in build/debian, or in
   CHIPWISE_DEBIAN_DIR.  Packages downloaded by a command are kept there too.
2. The archive, its keys, proxies and other settings are those of this machine's
   apt.  On a machine that is not a Debian, CHIPWISE_APT_SOURCES names a file
   with the lines of sources.list for the release.
3. Each call sees the base through an overlay of its own (a copy where the kernel
   has no overlay), thrown away at the end; --keep NAME keeps it, packages and
   build/ included, for the next call with that name.
4. Namespaces: user (every user keeps its number; root has no rights outside),
   mount, PID, IPC and host name.  The network is this machine's.  The root
   directory is changed by pivot_root, as in a chroot the kernel refuses user
   namespaces, and with them bin/chipwise-sandbox.
5. --container takes away what an ordinary container takes away: CAP_SYS_ADMIN
   and user namespaces.

Exit status: COMMAND's; 128 + signal when killed.
"""

import argparse
import contextlib
import ctypes
import fcntl
import glob
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.path.insert(0, os.path.join(ROOT, 'remap'))

from chipwise.machine import command, namespaces, sandbox        # noqa: E402
from chipwise.machine.namespaces import libc            # noqa: E402
from repository import repository_files                 # noqa: E402

RELEASES = ('bookworm', 'trixie')
INCLUDE = 'git make sudo'
USER, USER_ID = 'user', 1000
DEVICES = ('full', 'null', 'random', 'tty', 'urandom', 'zero')
KEYRINGS = ('/etc/apt/trusted.gpg', '/etc/apt/trusted.gpg.d', '/etc/apt/keyrings')
APT_FILE = re.compile(r'::(CAInfo|CaPath|SslCert|SslKey|CrlFile|IssuerCert) "(/.+)";$', re.I)
PASSED_ON = re.compile(r'(CHIPWISE_(?!DEBIAN_DIR|APT_SOURCES).*|(http|https|ftp|no)_proxy|TERM)$', re.I)
CLONE_NEWUTS = 0x04000000
MS_RDONLY, MS_REMOUNT, MNT_DETACH = 1, 32, 2


class Refusal(Exception):
    """What cannot be done, why, and what to do about it."""


def parse_arguments(argv):
    parser = argparse.ArgumentParser(
        prog='tools/on-debian', description='Run a command on a bare Debian of a release, '
        'with a copy of this repository.', epilog='Example: tools/on-debian trixie make test')
    parser.add_argument('--keep', metavar='NAME',
                        help='keep what the command changes, for the next call with that name')
    parser.add_argument('--user', action='store_true',
                        help='run the command as an ordinary user who may use sudo, not as root')
    parser.add_argument('--container', action='store_true',
                        help='without CAP_SYS_ADMIN and user namespaces, as in a plain container')
    parser.add_argument('--renew', action='store_true',
                        help='make the base anew and forget what was kept of that release')
    parser.add_argument('release', choices=RELEASES)
    parser.add_argument('command', nargs=argparse.REMAINDER)
    options = parser.parse_args(argv)
    if options.command[:1] == ['--']:
        options.command = options.command[1:]
    if not options.command and not options.renew:
        parser.error('no command')
    if options.keep and not re.fullmatch(r'[A-Za-z0-9][A-Za-z0-9._-]*', options.keep):
        parser.error('--keep %s: use letters, digits, dot, minus and underscore' % options.keep)
    return options


def become_root(argv):
    """Again through sudo, with the variables that matter."""
    if not shutil.which('sudo'):
        raise Refusal('needs root; run it as root or install sudo')
    passed = ['%s=%s' % item for item in os.environ.items()
              if PASSED_ON.match(item[0]) or item[0] in ('CHIPWISE_DEBIAN_DIR', 'CHIPWISE_APT_SOURCES')]
    ask = [] if os.isatty(0) else ['-n']
    os.execvp('sudo', ['sudo', *ask, 'env', *passed, sys.executable, os.path.realpath(__file__), *argv])


# --- 1. the base ------------------------------------------------------------

def cache_directory():
    """Where bases, packages and kept systems are."""
    path = os.environ.get('CHIPWISE_DEBIAN_DIR')
    if not path:
        build = os.path.join(ROOT, 'build')
        if not os.path.isdir(build):
            os.mkdir(build)
            owner = os.stat(ROOT)
            os.chown(build, owner.st_uid, owner.st_gid)
        path = os.path.join(build, 'debian')
    path = os.path.abspath(path)
    os.makedirs(path, mode=0o755, exist_ok=True)
    return path


@contextlib.contextmanager
def locked(path):
    """Hold a lock file; others wait."""
    with open(path, 'w') as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield


def ensure_base(folder, release, sources, renew):
    """Make the base of a release if it is missing or outdated; -> its directory."""
    recipe = hashlib.sha256('\n'.join([INCLUDE, USER, *sources]).encode()).hexdigest()
    base, stamp = os.path.join(folder, 'base'), os.path.join(folder, 'recipe')
    with locked(os.path.join(folder, 'lock')):
        if not renew and os.path.isdir(base) and read(stamp) == recipe:
            return base
        print('chipwise: making a Debian %s in %s' % (release, folder), file=sys.stderr)
        for path in (base, os.path.join(folder, 'kept')):
            if os.path.isdir(path):
                shutil.rmtree(path)
        fresh = tempfile.mkdtemp(prefix='fresh.', dir=folder)
        os.chmod(fresh, 0o711)          # apt fetches as a user of its own
        try:
            bootstrap(release, fresh, sources)
            os.rename(os.path.join(fresh, 'base'), base)
        finally:
            shutil.rmtree(fresh, ignore_errors=True)
        with open(stamp, 'w') as handle:
            handle.write(recipe)
    return base


def bootstrap(release, fresh, sources):
    """mmdebstrap into fresh/base, with this machine's apt settings and keys."""
    list_file, settings, keys = (os.path.join(fresh, name) for name in ('sources.list', 'apt.conf', 'keys'))
    os.mkdir(keys)
    for name, key in machine_keys().items():
        shutil.copyfile(key, os.path.join(keys, name))
    with open(list_file, 'w') as handle:
        handle.write('\n'.join(sources) + '\n')
    with open(settings, 'w') as handle:
        handle.write('\n'.join(apt_settings(sources)[0]) + '\n')
        handle.write('Dir::Etc::netrc "/etc/apt/auth.conf";\n'
                     'Dir::Etc::netrcparts "/etc/apt/auth.conf.d";\n')
    done = subprocess.run(
        ['mmdebstrap', '--mode=root', '--variant=minbase', '--format=directory',
         '--include=' + INCLUDE.replace(' ', ','), '--aptopt=' + settings,
         '--keyring=' + keys,
         '--customize-hook=rm -f "$1/etc/apt/apt.conf.d/99mmdebstrap"',
         '--customize-hook=chroot "$1" useradd -m -u %d -s /bin/bash %s' % (USER_ID, USER),
         '--customize-hook=echo "%s ALL=(ALL) NOPASSWD: ALL" >"$1/etc/sudoers.d/%s"' % (USER, USER),
         release, os.path.join(fresh, 'base'), list_file], stdin=subprocess.DEVNULL, stdout=sys.stderr)
    if done.returncode != 0:
        raise Refusal('mmdebstrap could not make a Debian %s (status %d); does this machine\'s '
                      'archive have that release?' % (release, done.returncode))


# --- 2. this machine's apt --------------------------------------------------

def apt_sources(release):
    """Lines of sources.list for a release, from the archives this machine uses itself."""
    path = os.environ.get('CHIPWISE_APT_SOURCES')
    if path:
        return [line for line in read(path).splitlines() if line.strip()]
    found = debian_archives() or (output('apt-get', '-q', 'update'), debian_archives())[1]
    if '' not in found:
        raise Refusal('the apt sources of this machine name no Debian archive; '
                      'put lines for %s into a file and name it in CHIPWISE_APT_SOURCES' % release)
    return ['deb %s %s%s main' % (found[suffix], release, suffix) for suffix in sorted(found)]


def debian_archives():
    """{'': URI, '-updates': URI, '-security': URI}, as far as this machine has them."""
    text = output('apt-get', 'indextargets', '--format',
                  '$(ORIGIN)|$(LABEL)|$(CODENAME)|$(COMPONENT)|$(REPO_URI)', 'Created-By: Packages')
    found = {}
    for line in text.splitlines():
        origin, label, codename, component, uri = line.split('|')
        suffix = re.sub('^[a-z]+', '', codename)
        if (origin == 'Debian' and label in ('Debian', 'Debian-Security') and component == 'main'
                and suffix in ('', '-updates', '-security')):
            found.setdefault(suffix, uri)
    return found


def apt_settings(sources):
    """(lines of apt.conf: this machine's Acquire settings, {file they name: path inside})."""
    lines, files = [], {}
    for line in output('apt-config', 'dump', 'Acquire').splitlines():
        if line.endswith(' "";') or re.match('Acquire::(IndexTargets|Changelogs|CompressionTypes|cdrom)', line):
            continue
        named = APT_FILE.search(line)
        if named:
            files[named[2]] = named[2]
        if not re.search('::Proxy-?Auto-?Detect ', line, re.I):
            lines.append(line)
    bundle = '/etc/ssl/certs/ca-certificates.crt'
    if any('https:' in line for line in sources) and os.path.exists(bundle) and not any(
            line.startswith('Acquire::https::CAInfo ') for line in lines):
        files[bundle] = '/etc/ssl/machine.crt'
    return lines + detected_proxies(sources), files


def detected_proxies(sources):
    """What the machine's Proxy-Auto-Detect program says, as lines of apt.conf."""
    lines = []
    for uri in {line.split()[1] for line in sources if re.match(r'deb https?:', line)}:
        scheme, host = re.match(r'(https?)://(?:[^@/]*@)?([^:/]+)', uri).groups()
        for option in ('Proxy-Auto-Detect', 'ProxyAutoDetect'):
            program = output('apt-config', 'shell', 'p', 'Acquire::%s::%s' % (scheme, option))
            if program:
                proxy = output(program.split("'")[1], uri).strip()
                lines.append('Acquire::%s::Proxy::%s "%s";' % (scheme, host, proxy))
    return lines


def machine_keys():
    """{name: file} of the keys this machine's apt trusts."""
    named = set()
    for path in ['/etc/apt/sources.list', *glob.glob('/etc/apt/sources.list.d/*.list'),
                 *glob.glob('/etc/apt/sources.list.d/*.sources')]:
        named.update(re.findall(r'(?i)signed-by\s*[=:]\s*(/[^\s\]]+)', read(path)))
    debian = '/usr/share/keyrings/debian-archive-keyring.gpg'
    keys = {}
    for number, path in enumerate([*KEYRINGS, *sorted(named | {debian})]):
        for key in glob.glob(path + '/*') if os.path.isdir(path) else [path]:
            if os.path.isfile(key) and key.endswith(('.asc', '.gpg')):
                keys['machine%d-%s' % (number, os.path.basename(key))] = key
    return keys


def carry_apt_over(system, sources):
    """Write this machine's apt settings, passwords, keys and certificates into a system."""
    lines, files = apt_settings(sources)
    files.update({path: path for path in ['/etc/apt/auth.conf', *glob.glob('/etc/apt/auth.conf.d/*')]
                  if os.path.isfile(path)})
    files.update({key: '/etc/apt/trusted.gpg.d/' + name for name, key in machine_keys().items()})
    for source, target in files.items():
        os.makedirs(os.path.dirname(system + target), exist_ok=True)
        shutil.copy2(source, system + target)
        if target == '/etc/ssl/machine.crt':
            lines.append('Acquire::https::CAInfo "%s";' % target)
    with open(system + '/etc/apt/apt.conf.d/99machine', 'w') as handle:
        handle.write('\n'.join(lines) + '\n')


def read(path):
    """A text file, or '' if there is none."""
    try:
        with open(path, errors='replace') as handle:
            return handle.read()
    except OSError:
        return ''


def output(*command):
    """What a command prints, or '' if it fails."""
    try:
        return subprocess.run(command, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL).stdout
    except OSError:
        return ''


# --- 3. the system a command sees -------------------------------------------

def lay_system(base, changes):
    """Mount base with changes over it at changes/root; -> (that, where new files land)."""
    system, upper, work = (os.path.join(changes, name) for name in ('root', 'upper', 'work'))
    for path in (system, upper, work):
        os.makedirs(path, exist_ok=True)
    copied = os.path.join(changes, 'copied')
    if not os.path.exists(copied):
        try:
            mount_overlay(base, upper, work, system)
            return system, upper
        except OSError:
            subprocess.run(['cp', '-a', '--reflink=auto', base + '/.', upper], check=True)
            open(copied, 'w').close()
    namespaces.mount(upper, system, None, namespaces.MS_BIND)
    return system, upper


def mount_overlay(base, upper, work, system):
    text = 'lowerdir=%s,upperdir=%s,workdir=%s' % (base, upper, work)
    namespaces.check(libc.mount(b'overlay', os.fsencode(system), b'overlay', ctypes.c_ulong(0),
                             os.fsencode(text)), 'mount overlay')


def lend_packages(cache, changes):
    """Link the packages downloaded by earlier calls into the system's cache."""
    archives = os.path.join(changes, 'upper', 'var', 'cache', 'apt', 'archives')
    os.makedirs(cache, exist_ok=True)
    # as the base has them: what is made here covers the base's directories
    for part in ('var', 'var/cache', 'var/cache/apt', 'var/cache/apt/archives'):
        path = os.path.join(changes, 'upper', part)
        if not os.path.isdir(path):
            os.mkdir(path, 0o755)
    link_packages(cache, archives)


def take_packages_back(cache, changes):
    """Keep what the command has downloaded."""
    link_packages(os.path.join(changes, 'upper', 'var', 'cache', 'apt', 'archives'), cache)


def link_packages(source, target):
    for path in glob.glob(os.path.join(source, '*.deb')):
        copy = os.path.join(target, os.path.basename(path))
        if not os.path.exists(copy):
            try:
                os.link(path, copy)
            except OSError:
                shutil.copy2(path, copy)


def home(options):
    """HOME of the command; the repository is in chipwise/ there."""
    return '/home/' + USER if options.user else '/root'


def copy_repository(system, changes, options):
    """Bring the repository's files to HOME/chipwise; a kept system loses those that are gone."""
    place = system + home(options) + '/chipwise'
    manifest = os.path.join(changes, 'manifest' + home(options).replace('/', '-'))
    names = repository_files()
    for name in sorted(set(filter(None, read(manifest).split('\0'))) - names):
        with contextlib.suppress(OSError):
            os.unlink(os.path.join(place, name))
    for name in sorted(names):
        source, target = os.path.join(ROOT, name), os.path.join(place, name)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        if os.path.islink(target) or not same_file(source, target):
            with contextlib.suppress(FileNotFoundError):
                os.unlink(target)
            shutil.copy2(source, target, follow_symlinks=False)
    with open(manifest, 'w') as handle:
        handle.write('\0'.join(sorted(names)))
    owner = USER_ID if options.user else 0
    subprocess.run(['chown', '-R', '-h', '%d:%d' % (owner, owner), place], check=True)


def same_file(source, target):
    """Same size and date, and neither is a link."""
    try:
        one, other = os.lstat(source), os.lstat(target)
    except OSError:
        return False
    return (not os.path.islink(source) and one.st_size == other.st_size
            and one.st_mtime_ns == other.st_mtime_ns and one.st_mode == other.st_mode)


# --- 4. namespaces ----------------------------------------------------------

def mount_devices(system):
    """/dev with the harmless devices, terminals and shared memory; /sys to be read."""
    dev = system + '/dev'
    namespaces.mount('tmpfs', dev, 'tmpfs')
    for name in DEVICES:
        open(os.path.join(dev, name), 'w').close()
        namespaces.mount('/dev/' + name, os.path.join(dev, name), None, namespaces.MS_BIND)
    for name, kind in (('pts', 'devpts'), ('shm', 'tmpfs')):
        os.mkdir(os.path.join(dev, name))
        data = b'newinstance,ptmxmode=0666,mode=0620,gid=5' if kind == 'devpts' else b'mode=1777'
        namespaces.check(libc.mount(kind.encode(), os.fsencode(os.path.join(dev, name)), kind.encode(),
                                 ctypes.c_ulong(0), data), 'mount ' + name)
    for name, target in (('ptmx', 'pts/ptmx'), ('fd', '/proc/self/fd'), ('stdin', '/proc/self/fd/0'),
                         ('stdout', '/proc/self/fd/1'), ('stderr', '/proc/self/fd/2')):
        os.symlink(target, os.path.join(dev, name))
    os.chmod(dev, 0o755)
    namespaces.mount('/sys', system + '/sys', None, namespaces.MS_BIND)
    namespaces.mount('none', system + '/sys', None, namespaces.MS_BIND | MS_REMOUNT | MS_RDONLY)


def map_same_numbers(pid):
    """Give a process in a new user namespace every user and group this one has."""
    for kind in ('uid_map', 'gid_map'):
        lines = [line.split() for line in read('/proc/self/' + kind).splitlines()]
        namespaces.write_file('/proc/%d/%s' % (pid, kind),
                           ''.join('%s %s %s\n' % (first, first, count) for first, _, count in lines))


def enter_namespaces():
    """New namespaces for this process; its next child is their PID 1."""
    entered, go_on = os.pipe(), os.pipe()
    mapper = os.fork()
    if mapper == 0:             # root outside, who alone may write the maps
        os.read(entered[0], 1)
        code = 1
        try:
            map_same_numbers(os.getppid())
            code = 0
        finally:
            os.write(go_on[1], b'0' if code == 0 else b'1')
            os._exit(code)
    namespaces.check(libc.unshare(namespaces.CLONE_NEWUSER), 'unshare user')
    os.write(entered[1], b'0')
    fine = os.read(go_on[0], 1) == b'0'
    os.waitpid(mapper, 0)
    if not fine:
        raise Refusal('user namespaces cannot be had here; run it on a machine, not in a container')
    os.setgroups([])
    os.setresgid(0, 0, 0)
    os.setresuid(0, 0, 0)
    namespaces.check(libc.unshare(namespaces.CLONE_NEWNS | namespaces.CLONE_NEWPID | namespaces.CLONE_NEWIPC | CLONE_NEWUTS),
                  'unshare')


def change_root(system):
    """Make system the root directory; the machine's is gone from sight."""
    namespaces.mount(system, system, None, namespaces.MS_BIND | namespaces.MS_REC)
    namespaces.mount('proc', system + '/proc', 'proc')
    before = system + '/.before'
    os.makedirs(before, exist_ok=True)
    os.chdir(system)
    subprocess.run(['pivot_root', '.', '.before'], check=True)
    os.chdir('/')
    namespaces.check(libc.umount2(b'/.before', MNT_DETACH), 'umount')
    os.rmdir('/.before')


def inside(options, system):
    """PID 1 of the namespaces: run the command."""
    namespaces.die_with_parent()
    change_root(system)
    env = {name: value for name, value in os.environ.items() if PASSED_ON.match(name)}
    env.update(PATH='/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin', LANG='C.UTF-8',
               HOME=home(options), USER=USER if options.user else 'root')
    prefix = ['setpriv']
    if options.user:
        prefix += ['--reuid=%d' % USER_ID, '--regid=%d' % USER_ID, '--init-groups']
    if options.container:
        namespaces.write_file('/proc/sys/user/max_user_namespaces', '0')
        prefix += ['--bounding-set=-sys_admin', '--inh-caps=-sys_admin']
    os.chdir(home(options) + '/chipwise')
    return command.run_and_reap(options.command, env, prefix + ['--'] if len(prefix) > 1 else ())


def in_child(action):
    """Run an action in a child, whose status is the action's; -> the child."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = action()
        except (Refusal, OSError, subprocess.CalledProcessError) as error:
            print('chipwise: on-debian: %s' % error, file=sys.stderr)
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    return child


def supervise(options, base, changes, sources):
    """Lay the system, enter the namespaces and hand over to their PID 1."""
    namespaces.check(libc.unshare(namespaces.CLONE_NEWNS), 'unshare mount')
    namespaces.mount('none', '/', None, namespaces.MS_REC | namespaces.MS_PRIVATE)
    system, _ = lay_system(base, changes)
    carry_apt_over(system, sources)
    for path in ('/etc/resolv.conf', '/etc/hosts'):
        if os.path.exists(path):
            shutil.copyfile(path, system + path)
    copy_repository(system, changes, options)
    mount_devices(system)
    enter_namespaces()
    namespaces.die_with_parent()
    return sandbox.wait_for(in_child(lambda: inside(options, system)), None)


def remove_left_behind(folder):
    """Remove the changes of calls that were killed: no one holds their lock."""
    for changes in glob.glob(os.path.join(folder, 'run.*')):
        with contextlib.suppress(OSError), open(os.path.join(changes, 'lock')) as handle:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(changes, ignore_errors=True)


def run(options, folder, base, sources):
    """The command on a system of its own, or on the kept one; -> its exit status."""
    cache = os.path.join(folder, 'packages')
    with contextlib.ExitStack() as stack:
        if options.keep:
            changes = os.path.join(folder, 'kept', options.keep)
            os.makedirs(changes, mode=0o700, exist_ok=True)
            stack.enter_context(locked(os.path.join(changes, 'lock')))
        else:
            remove_left_behind(folder)
            changes = tempfile.mkdtemp(prefix='run.', dir=folder)
            stack.enter_context(locked(os.path.join(changes, 'lock')))
            stack.callback(shutil.rmtree, changes, ignore_errors=True)
        for name in ('upper', 'work', 'root'):
            os.makedirs(os.path.join(changes, name), exist_ok=True)
        lend_packages(cache, changes)
        try:
            return sandbox.wait_for(in_child(lambda: supervise(options, base, changes, sources)), None)
        finally:
            take_packages_back(cache, changes)


def main(argv):
    options = parse_arguments(argv)
    if os.geteuid() != 0:
        become_root(argv)
    if not namespaces.works(lambda: namespaces.check(libc.unshare(namespaces.CLONE_NEWNS | namespaces.CLONE_NEWUSER), 'unshare')):
        raise Refusal('no private namespaces here; run it on a machine, or give the container CAP_SYS_ADMIN')
    folder = os.path.join(cache_directory(), options.release)
    os.makedirs(folder, mode=0o711, exist_ok=True)
    sources = apt_sources(options.release)
    base = ensure_base(folder, options.release, sources, options.renew)
    return run(options, folder, base, sources) if options.command else 0


if __name__ == '__main__':
    try:
        sys.exit(main(sys.argv[1:]))
    except (Refusal, OSError) as error:
        sys.exit('chipwise: on-debian: %s' % error)
