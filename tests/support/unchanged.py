# SPDX-License-Identifier: GPL-2.0-or-later
"""Tests that are left out while everything they depend on is as it was when they passed.

Some tests say nothing about the product that others do not say: that a fault of the C files would be seen (sabotage),
that no test program reads behind an array (sanitizers), how many instructions a period has (valgrind). Their outcome
depends on the C files, on the tests they run, on the compiler. They are marked

    @pytest.mark.inputs(lambda ..: paths)       of the test's parameters; paths below the root; all that a file imports
    or includes counts too

and the digest of these inputs is kept when they pass, in build/passed.txt; tools/passed writes those of this tree to
tests/passed.txt, which is committed, so a fresh clone knows them too. `make test` and `make test-all`
(CHIPWISE_UNCHANGED=skip) skip a marked test whose digest is in either file. A change of a C file, a test, a module it
imports, the compiler or the Python libraries gives another digest, and the test runs.  `make test-long` and a test that
is named (tools/test PATH) run all of them.

Called by tests/conftest.py and tools/passed.
"""

import ast
import functools
import hashlib
import importlib.metadata
import os
import platform
import re
import subprocess
import textwrap
from pathlib import Path

from support import ROOT

COMMITTED, LOCAL = ROOT / "tests/passed.txt", ROOT / "build/passed.txt"
IMPORTED_FROM = tuple(ROOT / name for name in ("tests", "remap", "bench"))
C_FILES = ("components/core/*.[ch]", "components/offline/*.[ch]", "components/registers.h", "tools/make_layout.py")
INCLUDED_FROM = tuple(ROOT / name for name in ("components", "tests/core", "tests/support"))
COMPILED = (
    "build/core/stock.o",
    "build/offline/chain_fit.o",
    "build/tests/test_core",
    "build/sanitized/libchipwise.so",
    "build/sanitized/core/stock.o",
    "build/sanitized/tests/test_core",
    "build/bench/lib/cost",
)
NO_INPUT = (
    ROOT / "tests/support/unchanged.py",
)  # it decides whether a test runs, as tests/conftest.py, not what comes of it
LINUXCNC = Path("/usr/include/linuxcnc")
COMMANDS = (("gcc", "-dumpfullversion"), ("gcc", "-dumpmachine"), ("valgrind", "--version"))
LIBRARIES = ("numpy", "shapely", "pytest")
SHARE = "0.2"  # of the random cases: what `make test-all` runs


def c_files():
    """Paths of all that the library is made of; the headers of components/ that it includes are found by closure()."""
    return [path for pattern in C_FILES for path in sorted(ROOT.glob(pattern))]


def c_program(name):
    """Paths of a C program of tests/core."""
    return [*c_files(), ROOT / f"tests/core/{name}.c"]


def package():
    """Paths of the whole package and its machines: of tests that start programs of it."""
    return sorted([*ROOT.glob("remap/chipwise/**/*.py"), *(path for path in ROOT.glob("configs/*") if path.is_file())])


# --- digests ------------------------------------------------------------------


def module_files(name):
    """Files that `import NAME` executes: the module's, and __init__.py of the packages it is in; none for a module from
    elsewhere."""
    found, parts = [], name.split(".")
    for root in IMPORTED_FROM:
        for count in range(1, len(parts) + 1):
            whole = root.joinpath(*parts[:count])
            found += [path for path in (whole / "__init__.py", whole.with_name(whole.name + ".py")) if path.is_file()]
    return found


def parsed(text):
    """A text as Python, and nothing if it cannot be read as that."""
    try:
        return ast.parse(textwrap.dedent(text))
    except SyntaxError:
        return ast.parse("")


@functools.lru_cache(maxsize=None)
def imports(path):
    """Files that a Python file imports itself, anywhere in it, programs that it has as text included."""
    inside = next((path.relative_to(root).parts[:-1] for root in IMPORTED_FROM if root in path.parents), ())
    names = set()
    nodes = list(ast.walk(ast.parse(path.read_bytes())))
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and "import " in node.value:
            nodes += ast.walk(parsed(node.value))
        elif isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = [*inside[: len(inside) - node.level + 1]] if node.level else []
            whole = ".".join([*base, *([node.module] if node.module else [])])
            names.add(whole)
            names.update(f"{whole}.{alias.name}" for alias in node.names)
    return tuple(file for name in sorted(names) for file in module_files(name))


@functools.lru_cache(maxsize=None)
def includes(path):
    """Files of ours that a C file includes itself."""
    named = re.findall(r'^\s*#\s*include\s+"([^"]+)"', path.read_text(), re.M)
    beside = [Path(os.path.normpath(folder / name)) for name in named for folder in (path.parent, *INCLUDED_FROM)]
    return tuple(found for found in beside if found.is_file())


def beside(path):
    """The C file that a Python file of tests/support calls: of the same name (the oracles)."""
    found = path.with_suffix(".c")
    return (found,) if path.parent == ROOT / "tests/support" and found.is_file() else ()


def closure(paths):
    """Paths, and all that the Python files among them import and the C files include, in order."""
    found, waiting = set(), list(paths)
    while waiting:
        path = waiting.pop()
        if path not in found and path not in NO_INPUT:
            found.add(path)
            waiting += (
                (*imports(path), *beside(path))
                if path.suffix == ".py"
                else includes(path)
                if path.suffix in (".c", ".h")
                else ()
            )
    return sorted(found)


@functools.lru_cache(maxsize=None)
def content(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


@functools.lru_cache(maxsize=None)
def tools():
    """What compiles and runs the inputs, as text."""
    said = [
        subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False).stdout.strip()
        if any(os.access(Path(folder, command[0]), os.X_OK) for folder in os.get_exec_path())
        else f"no {command[0]}"
        for command in COMMANDS
    ]
    clean = {
        name: value for name, value in os.environ.items() if name not in ("MAKEFLAGS", "MFLAGS", "WERROR")
    }  # of CI
    made = subprocess.run(
        ["make", "-sBn", *COMPILED],
        cwd=ROOT,
        env=clean,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    compiled = hashlib.sha256("\n".join(line for line in made.splitlines() if "gcc" in line).encode()).hexdigest()[:16]
    headers = hashlib.sha256("".join(content(path) for path in sorted(LINUXCNC.glob("*.h"))).encode()).hexdigest()[:16]
    return " ".join(
        [
            "gcc",
            *said,
            "Python",
            platform.python_version(),
            *map(version, LIBRARIES),
            "LinuxCNC",
            headers,
            "flags",
            compiled,
        ]
    )


def version(library):
    try:
        return f"{library} {importlib.metadata.version(library)}"
    except importlib.metadata.PackageNotFoundError:
        return f"no {library}"


def digest(paths, name):
    """Of the paths' contents and names, of all that they import, of the tools, and of the test's name."""
    return digest_of_contents({path: content(path) for path in closure(paths)}, name, tools())


def digest_of_contents(contents, *texts):
    lines = [*texts, *(f"{os.path.relpath(path, ROOT)} {found}" for path, found in sorted(contents.items()))]
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:20]


def inputs_of(item):
    """Paths of a marked test, its own file and pytest's settings included."""
    named = item.get_closest_marker("inputs").args[0](**getattr(getattr(item, "callspec", None), "params", {}))
    return [item.path, ROOT / "pytest.ini", *(ROOT / path for path in named)]


def digest_of(item):
    return digest(inputs_of(item), item.nodeid)


# --- what has passed ----------------------------------------------------------


def read(path):
    """{test: digest} of a file, whose lines are `digest test`; of two lines for a test the last counts."""
    lines = path.read_text().splitlines() if path.is_file() else []
    return {test: found for found, _, test in (line.partition(" ") for line in lines if not line.startswith("#"))}


def committed_tools(path=COMMITTED):
    """The tools with which what is in tests/passed.txt has passed."""
    return path.read_text().splitlines()[0].removeprefix("# ")


def write_committed(known):
    COMMITTED.write_text(f"# {tools()}\n" + "".join(f"{known[test]} {test}\n" for test in sorted(known)))


def files():
    """The two files; a test of this module names its own by CHIPWISE_PASSED."""
    own = os.environ.get("CHIPWISE_PASSED")
    return (Path(own),) if own else (COMMITTED, LOCAL)


def in_force(environment=None):
    """Whether marked tests are skipped and kept: asked for, and with the random cases of `make test-all`."""
    names = os.environ if environment is None else environment
    usual = (
        names.get("CHIPWISE_RANDOM_SHARE") == SHARE
        and not names.get("CHIPWISE_SEED")
        and not names.get("CHIPWISE_RANDOM_COUNT")
    )
    return names.get("CHIPWISE_UNCHANGED") == "skip" and usual


def has_passed(item):
    """Whether a marked test has passed with the inputs of today."""
    return digest_of(item) in {read(path).get(item.nodeid) for path in files()}


def is_built():
    """Whether the library is not older than any of its sources: tools/test does not build."""
    library = ROOT / "build/libchipwise.so"
    return library.is_file() and all(path.stat().st_mtime <= library.stat().st_mtime for path in closure(c_files()))


def keep(item):
    """A marked test has passed."""
    path = files()[-1]
    if not is_built():
        return
    path.parent.mkdir(exist_ok=True)
    with open(path, "a") as out:  # one write: several processes add to it
        out.write(f"{digest_of(item)} {item.nodeid}\n")
