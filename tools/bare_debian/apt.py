# SPDX-License-Identifier: GPL-2.0-or-later
"""This machine's apt: archives, settings, proxies and keys, for a system of another release.

Called by base.py and on_debian.py.
"""

import glob
import os
import re
import shutil

from bare_debian.common import Refusal, output, read

KEYRINGS = ("/etc/apt/trusted.gpg", "/etc/apt/trusted.gpg.d", "/etc/apt/keyrings")
APT_FILE = re.compile(r'::(CAInfo|CaPath|SslCert|SslKey|CrlFile|IssuerCert) "(/.+)";$', re.I)


def apt_sources(release):
    """Lines of sources.list for a release, from the archives this machine uses itself."""
    path = os.environ.get("CHIPWISE_APT_SOURCES")
    if path:
        return [line for line in read(path).splitlines() if line.strip()]
    found = debian_archives() or (output("apt-get", "-q", "update"), debian_archives())[1]
    if "" not in found:
        raise Refusal(
            "the apt sources of this machine name no Debian archive; "
            "put lines for %s into a file and name it in CHIPWISE_APT_SOURCES" % release
        )
    return ["deb %s %s%s main" % (found[suffix], release, suffix) for suffix in sorted(found)]


def debian_archives():
    """{'': URI, '-updates': URI, '-security': URI}, as far as this machine has them."""
    text = output(
        "apt-get",
        "indextargets",
        "--format",
        "$(ORIGIN)|$(LABEL)|$(CODENAME)|$(COMPONENT)|$(REPO_URI)",
        "Created-By: Packages",
    )
    found = {}
    for line in text.splitlines():
        origin, label, codename, component, uri = line.split("|")
        suffix = re.sub("^[a-z]+", "", codename)
        if (
            origin == "Debian"
            and label in ("Debian", "Debian-Security")
            and component == "main"
            and suffix in ("", "-updates", "-security")
        ):
            found.setdefault(suffix, uri)
    return found


def apt_settings(sources):
    """(lines of apt.conf: this machine's Acquire settings, {file they name: path inside})."""
    lines, files = [], {}
    for line in output("apt-config", "dump", "Acquire").splitlines():
        if line.endswith(' "";') or re.match("Acquire::(IndexTargets|Changelogs|CompressionTypes|cdrom)", line):
            continue
        named = APT_FILE.search(line)
        if named:
            files[named[2]] = named[2]
        if not re.search("::Proxy-?Auto-?Detect ", line, re.I):
            lines.append(line)
    bundle = "/etc/ssl/certs/ca-certificates.crt"
    if (
        any("https:" in line for line in sources)
        and os.path.exists(bundle)
        and not any(line.startswith("Acquire::https::CAInfo ") for line in lines)
    ):
        files[bundle] = "/etc/ssl/machine.crt"
    return lines + detected_proxies(sources), files


def detected_proxies(sources):
    """What the machine's Proxy-Auto-Detect program says, as lines of apt.conf."""
    lines = []
    for uri in {line.split()[1] for line in sources if re.match(r"deb https?:", line)}:
        scheme, host = re.match(r"(https?)://(?:[^@/]*@)?([^:/]+)", uri).groups()
        for option in ("Proxy-Auto-Detect", "ProxyAutoDetect"):
            program = output("apt-config", "shell", "p", "Acquire::%s::%s" % (scheme, option))
            if program:
                proxy = output(program.split("'")[1], uri).strip()
                lines.append('Acquire::%s::Proxy::%s "%s";' % (scheme, host, proxy))
    return lines


def machine_keys():
    """{name: file} of the keys this machine's apt trusts."""
    named = set()
    for path in [
        "/etc/apt/sources.list",
        *glob.glob("/etc/apt/sources.list.d/*.list"),
        *glob.glob("/etc/apt/sources.list.d/*.sources"),
    ]:
        named.update(re.findall(r"(?i)signed-by\s*[=:]\s*(/[^\s\]]+)", read(path)))
    debian = "/usr/share/keyrings/debian-archive-keyring.gpg"
    keys = {}
    for number, path in enumerate([*KEYRINGS, *sorted(named | {debian})]):
        for key in glob.glob(path + "/*") if os.path.isdir(path) else [path]:
            if os.path.isfile(key) and key.endswith((".asc", ".gpg")):
                keys["machine%d-%s" % (number, os.path.basename(key))] = key
    return keys


def carry_apt_over(system, sources):
    """Write this machine's apt settings, passwords, keys and certificates into a system."""
    lines, files = apt_settings(sources)
    files.update(
        {path: path for path in ["/etc/apt/auth.conf", *glob.glob("/etc/apt/auth.conf.d/*")] if os.path.isfile(path)}
    )
    files.update({key: "/etc/apt/trusted.gpg.d/" + name for name, key in machine_keys().items()})
    for source, target in files.items():
        os.makedirs(os.path.dirname(system + target), exist_ok=True)
        shutil.copy2(source, system + target)
        if target == "/etc/ssl/machine.crt":
            lines.append('Acquire::https::CAInfo "%s";' % target)
    with open(system + "/etc/apt/apt.conf.d/99machine", "w") as handle:
        handle.write("\n".join(lines) + "\n")
