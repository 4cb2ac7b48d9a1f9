# SPDX-License-Identifier: GPL-2.0-or-later
"""tools/on-debian: whose archive, keys and settings it takes; what a command sees in it.

The second half needs a base that is there already (`tools/on-debian trixie true` makes one), as a test downloads
nothing, and root, as namespaces within namespaces hide the cache from others.
"""

import importlib.util
import os
import subprocess
import time

import pytest

from chipwise.host import processes

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
TOOL = os.path.join(ROOT, "tools", "on-debian")
FOLDER = os.environ.get("CHIPWISE_DEBIAN_DIR") or os.path.join(ROOT, "build", "debian")
RELEASES = ("bookworm", "trixie")

spec = importlib.util.spec_from_file_location("on_debian", os.path.join(ROOT, "tools", "on_debian.py"))
on_debian = importlib.util.module_from_spec(spec)
spec.loader.exec_module(on_debian)

from bare_debian import apt, processor  # noqa: E402  found by on_debian


# --- this machine's apt -----------------------------------------------------


@pytest.fixture
def machine(tmp_path, monkeypatch):
    """A machine whose apt says what a test writes: machine(targets, settings)."""
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", "%s:%s" % (programs, os.environ["PATH"]))
    monkeypatch.delenv("CHIPWISE_APT_SOURCES", raising=False)

    def write(targets, settings=""):
        for name, text in (("apt-get", targets), ("apt-config", settings)):
            (tmp_path / name).write_text(text)
            script = programs / name
            script.write_text('#!/bin/sh\n[ "$1" = shell ] || cat %s\n' % (tmp_path / name))
            script.chmod(0o755)

    return write


TARGETS = (
    "Debian|Debian|bookworm|main|http://one.test/debian/\n"
    "Debian|Debian|bookworm|contrib|http://one.test/debian/\n"
    "Debian|Debian|bookworm-updates|main|http://one.test/debian/\n"
    "Debian|Debian Backports|bookworm-backports|main|http://three.test/debian/\n"
    "Debian|Debian-Security|bookworm-security|main|http://two.test/security/\n"
    "Docker|Docker CE|bookworm|main|http://four.test/\n"
)


def test_sources_are_the_machines_own_for_another_release(machine):
    machine(TARGETS)
    assert on_debian.apt_sources("trixie") == [
        "deb http://one.test/debian/ trixie main",
        "deb http://two.test/security/ trixie-security main",
        "deb http://one.test/debian/ trixie-updates main",
    ]


def test_no_debian_archive_is_refused_with_the_remedy(machine, tmp_path, monkeypatch):
    machine("Ubuntu|Ubuntu|noble|main|http://one.test/ubuntu/\n")
    with pytest.raises(on_debian.Refusal, match="name no Debian archive.*CHIPWISE_APT_SOURCES"):
        on_debian.apt_sources("trixie")
    mine = tmp_path / "mine.list"
    mine.write_text("deb http://five.test/ trixie main\n")
    monkeypatch.setenv("CHIPWISE_APT_SOURCES", str(mine))
    assert on_debian.apt_sources("trixie") == ["deb http://five.test/ trixie main"]


def test_proxies_and_certificates_are_carried_over(machine, tmp_path):
    certificate = tmp_path / "ca.pem"
    certificate.write_text("x")
    machine(
        TARGETS,
        'Acquire "";\nAcquire::http::Proxy "http://proxy.test:3128/";\nAcquire::Check-Date "false";\n'
        'Acquire::https::CAInfo "%s";\nAcquire::IndexTargets::deb::Packages::Optional "0";\n' % certificate,
    )
    lines, files = apt.apt_settings(on_debian.apt_sources("trixie"))
    assert lines == [
        'Acquire::http::Proxy "http://proxy.test:3128/";',
        'Acquire::Check-Date "false";',
        'Acquire::https::CAInfo "%s";' % certificate,
    ]
    assert files == {str(certificate): str(certificate)}


def test_no_host_of_an_archive_is_written_here():
    for name in (
        "on-debian",
        "on_debian.py",
        "bare_debian/apt.py",
        "bare_debian/base.py",
        "bare_debian/processor.py",
        "bare_debian/system.py",
        "try_arm64",
        "processor_trial.py",
    ):
        with open(os.path.join(ROOT, "tools", name)) as handle:
            assert "http://" not in handle.read().replace("http://(", "")


def test_without_namespaces_it_refuses_before_anything_is_made(tmp_path):
    script = (
        "echo 0 >/proc/sys/user/max_user_namespaces && exec setpriv --bounding-set=-sys_admin "
        '--inh-caps=-sys_admin -- "$@"'
    )
    done = subprocess.run(
        [
            "unshare",
            "--user",
            "--map-root-user",
            "sh",
            "-c",
            script,
            "sh",
            "/usr/bin/python3",
            os.path.join(ROOT, "tools", "on_debian.py"),
            "trixie",
            "true",
        ],
        text=True,
        env=dict(os.environ, CHIPWISE_DEBIAN_DIR=str(tmp_path / "none")),
        capture_output=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("chipwise: on-debian: no private namespaces here; run it on a machine"), done.stderr
    assert not (tmp_path / "none").exists()


def test_another_processor_without_its_emulator_is_refused(tmp_path, monkeypatch):
    monkeypatch.setitem(processor.PROCESSORS, "arm64", str(tmp_path / "none.conf"))
    with pytest.raises(on_debian.Refusal, match="there is no emulator for arm64; install qemu-user-static"):
        processor.register("arm64", str(tmp_path / "place"))
    assert os.listdir(tmp_path) == []


# --- what a command sees ----------------------------------------------------


def on(release, *arguments, base=None, **options):
    if os.geteuid() != 0 or not os.path.isdir(os.path.join(FOLDER, base or release, "base")):
        pytest.skip("no base of %s in %s, or not root" % (base or release, FOLDER))
    words = [word for word in arguments if word.startswith("--")]
    return subprocess.run(
        [TOOL, *words, release, *arguments[len(words) :]],
        text=True,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=300,
        **options,
    )


@pytest.mark.parametrize("release", RELEASES)
def test_a_command_runs_on_that_release_with_the_files_of_the_repository(release):
    done = on(
        release,
        "sh",
        "-c",
        ". /etc/os-release; echo $VERSION_CODENAME; id -u; ls Makefile; ls -d build; "
        "for p in git make sudo gcc linuxcnc; do command -v $p; done",
    )
    words = done.stdout.split("\n")
    assert words[:3] == [release, "0", "Makefile"]
    assert words[3].startswith("ls: cannot access")
    assert words[4:7] == ["/usr/bin/git", "/usr/bin/make", "/usr/bin/sudo"]
    assert words[7:] == [""]  # nothing else is there
    assert done.returncode != 0  # of the last `command -v`


def test_programs_of_another_processor_run_and_the_machine_does_not_know_them():
    registered = set(os.listdir("/proc/sys/fs/binfmt_misc"))
    done = on(
        "bookworm",
        "--processor=arm64",
        "sh",
        "-c",
        "uname -m; dpkg --print-architecture; head -c 20 /bin/uname | od -An -tu1 -j18",
        base="bookworm-arm64",
    )
    assert done.stdout.split() == ["aarch64", "arm64", "183", "0"], done.stdout
    assert set(os.listdir("/proc/sys/fs/binfmt_misc")) == registered


def test_namespaces_of_its_own_and_the_sandboxs_within():
    outside = {name: os.readlink("/proc/self/ns/" + name) for name in ("user", "mnt", "pid", "ipc", "uts")}
    done = on(
        "trixie", "sh", "-c", "for n in user mnt pid ipc uts; do readlink /proc/self/ns/$n; done; unshare -Ur id -u"
    )
    *inside, uid = done.stdout.split()
    assert len(set(inside)) == 5 and not set(inside) & set(outside.values())
    assert uid == "0"  # user namespaces are to be had: no chroot


def test_an_ordinary_user_may_use_sudo():
    done = on("trixie", "--user", "sh", "-c", "id -un; touch x && sudo id -un; echo $HOME")
    assert done.stdout.split() == ["user", "root", "/home/user"]


def test_a_container_has_no_namespaces():
    done = on("trixie", "--container", "sh", "-c", "unshare -Ur true; unshare -m true; echo end")
    assert done.stdout.count("failed") == 2 and done.stdout.endswith("end\n")


@pytest.mark.parametrize(
    "command, status",
    [(["true"], 0), (["sh", "-c", "exit 7"], 7), (["sh", "-c", "kill -9 $$"], 137), (["/no/such"], 127)],
)
def test_exit_status(command, status):
    assert on("trixie", *command).returncode == status


def test_changes_are_lost_unless_kept():
    name = "test-%d" % os.getpid()
    kept = os.path.join(FOLDER, "trixie", "kept", name)
    try:
        on("trixie", "touch", "/etc/left", "LEFT")
        assert not on("trixie", "ls", "/etc/left").stdout.startswith("/etc/left")
        assert not os.path.exists(os.path.join(ROOT, "LEFT"))
        on("trixie", "--keep=" + name, "touch", "/etc/left")
        assert on("trixie", "--keep=" + name, "ls", "/etc/left").stdout == "/etc/left\n"
    finally:
        subprocess.run(["rm", "-rf", kept], check=True)


def test_what_was_made_is_brought_back():
    folder = os.path.join("build", "test-%d" % os.getpid())
    try:
        assert (
            on(
                "trixie", "--bring=" + folder, "sh", "-c", "mkdir -p %s/in && echo made >%s/file" % (folder, folder)
            ).returncode
            == 0
        )
        with open(os.path.join(ROOT, folder, "file")) as handle:
            assert handle.read() == "made\n"
        assert os.listdir(os.path.join(ROOT, folder)) == ["file"]
        assert "has made no folder build/none" in on("trixie", "--bring=build/none", "true").stdout
    finally:
        subprocess.run(["rm", "-rf", os.path.join(ROOT, folder)], check=True)


def test_nothing_is_left_when_it_is_killed(tmp_path):
    """Neither processes nor mounts; a background process dies with its PID namespace."""
    before = open("/proc/mounts").read()
    mark = str(time.time())
    done = on("trixie", "sh", "-c", 'sleep 0.1; setsid sh -c "exec sleep %s" & sleep 0.3' % mark)
    assert done.returncode == 0
    others = runs()
    process = subprocess.Popen([TOOL, "trixie", "sleep", mark], stdin=subprocess.DEVNULL)
    deadline = time.monotonic() + 300
    while not running(mark) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert running(mark)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 300
    while running(mark) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not running(mark)
    assert open("/proc/mounts").read() == before
    left = runs() - others
    assert len(left) == 1
    on("trixie", "true")  # the next call removes what the killed one had written
    assert not left & runs()


def runs():
    """Names of the folders of calls that are running or were killed."""
    return {name for name in os.listdir(os.path.join(FOLDER, "trixie")) if name.startswith("run.")}


def running(mark):
    """Is there a `sleep MARK`?"""
    return any(processes.command_line(pid)[:2] == [b"sleep", mark.encode()] for pid in processes.pids())
