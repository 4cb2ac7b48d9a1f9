#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Make Python's copy of the C core's structures and constants, and the table with which the library confirms it.

Called by `make build`, which writes
    remap/chipwise/clib/layout.py             ctypes structures, enums and constants
    build/layout_table.c                      size of each structure, offset and size of each member, as compiled
and by a test with --check: exit status 1 if one of them is stale.

The headers go through `gcc -E -P` and pycparser (Debian: python3-pycparser). Names lose their prefix: struct
chip_feed_in becomes FeedIn, CHIP_FULL becomes FULL; an enum becomes an IntEnum whose members lose the words all of
them share.
"""

import argparse
import ast
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from pycparser import c_ast, c_parser

ROOT = Path(__file__).resolve().parents[1]
HEADERS = (
    "registers.h",
    "core/version.h",
    "core/feed.h",
    "core/tooth_law.h",
    "core/feed_hold.h",
    "core/run_sums.h",
    "core/watchdog.h",
    "core/tool_watch.h",
    "core/load_watch.h",
    "core/path_watch.h",
    "core/clamp.h",
    "core/tracker.h",
    "core/path_done.h",
    "core/tracer.h",
    "core/stylus.h",
    "core/slave.h",
    "core/axis_offset.h",
    "core/spindle_sim.h",
    "core/spindle_load.h",
    "offline/height_sweep.h",
    "offline/drop_cutter.h",
    "offline/stock_need.h",
    "offline/depth_proof.h",
    "offline/tracer_loop.h",
    "offline/chain_fit.h",
    "offline/engage.h",
    "offline/nearest_element.h",
    "offline/raster_route.h",
)
PYTHON = ROOT / "remap" / "chipwise" / "clib" / "layout.py"
TABLE = ROOT / "build" / "layout_table.c"
WHOLE_NUMBERS = {
    "int8_t": "c_int8",
    "uint8_t": "c_uint8",
    "int16_t": "c_int16",
    "uint16_t": "c_uint16",
    "int32_t": "c_int32",
    "uint32_t": "c_uint32",
    "int64_t": "c_int64",
    "uint64_t": "c_uint64",
}
CTYPES = {
    "int": "c_int",
    "long": "c_long",
    "double": "c_double",
    "float": "c_float",
    "unsigned char": "c_ubyte",
    "char": "c_char",
    "unsigned": "c_uint",
    "unsigned int": "c_uint",
    **WHOLE_NUMBERS,
}
LITERAL = re.compile(r"^[-+]?(0x[0-9a-fA-F]+|[0-9]+(\.[0-9]*)?([eE][-+]?[0-9]+)?)[uUlL]*$")
SHIFT = re.compile(r"^\((\d+)[uU]? << (\d+)\)$")


def preprocess(*options):
    """The headers through gcc; the standard headers are empty, their types are declared here."""
    text = "".join(f"typedef int {name};\n" for name in WHOLE_NUMBERS)
    text += "".join(f'#include "{name}"\n' for name in HEADERS)
    with tempfile.TemporaryDirectory() as folder:
        for name in ("stdint.h", "math.h", "string.h", "stdlib.h"):
            (Path(folder) / name).write_text("")
        command = [
            "gcc",
            "-E",
            "-nostdinc",
            "-D__attribute__(x)=",
            "-I",
            folder,
            "-I",
            str(ROOT / "components"),
            *options,
            "-x",
            "c",
            "-",
        ]
        return subprocess.run(command, input=text, check=True, stdout=subprocess.PIPE, text=True).stdout


def constants(macros):
    """[(name, value as Python text)] of the macros that are plain numbers, in the order of their names."""
    found = []
    for line in macros.splitlines():
        match = re.match(r"#define CHIP_(\w+) (.+)$", line)
        if not match:
            continue
        name, value = match.groups()
        if LITERAL.match(value):
            found.append((name, str(ast.literal_eval(value.rstrip("uUlL")))))
        elif SHIFT.match(value):
            number, by = SHIFT.match(value).groups()
            found.append((name, str(int(number) << int(by))))
    return sorted(found)


def camel(name):
    """feed_in -> FeedIn"""
    return "".join(part.capitalize() for part in name.split("_"))


def number(node, known):
    """Value of a constant expression in an array's length or an enumerator."""
    if isinstance(node, c_ast.Constant):
        return int(node.value.rstrip("uUlL"), 0)
    if isinstance(node, c_ast.UnaryOp) and node.op == "-":
        return -number(node.expr, known)
    if isinstance(node, c_ast.UnaryOp) and node.op == "sizeof":
        return f"C.sizeof({camel(node.expr.type.type.name.removeprefix('chip_'))})"
    if isinstance(node, c_ast.BinaryOp):
        left, right = number(node.left, known), number(node.right, known)
        operator = "//" if node.op == "/" else node.op
        return f"({left} {operator} {right})"
    if isinstance(node, c_ast.ID):
        return known[node.name]
    raise ValueError(f"an expression this generator does not know: {type(node).__name__}")


def ctype(node, known):
    """ctypes expression of a declarator's type; None for a flexible array."""
    if isinstance(node, c_ast.PtrDecl):
        return "C.c_void_p"
    if isinstance(node, c_ast.ArrayDecl):
        sizes = []
        while isinstance(node, c_ast.ArrayDecl):
            if node.dim is None:
                return None
            sizes.append(number(node.dim, known))
            node = node.type
        return " * ".join([ctype(node, known), *map(str, reversed(sizes))])
    kind = node.type
    if isinstance(kind, c_ast.Struct):
        return camel(kind.name.removeprefix("chip_"))
    if isinstance(kind, c_ast.Enum):
        return "C.c_uint"
    return "C." + CTYPES[" ".join(kind.names)]


def declarations(source):
    """(enums, structs) of chip_ in the order of the headers: {name: [(member, value)]}, {name: [(member, ctype or
    None)]}."""
    enums, structs, known = {}, {}, {}
    for node in c_parser.CParser().parse(source).ext:
        kind = getattr(node, "type", None)
        if isinstance(kind, c_ast.Enum) and kind.values and kind.name:
            last, members = -1, []
            for one in kind.values.enumerators:
                last = number(one.value, known) if one.value else last + 1
                known[one.name] = last
                members.append((one.name, last))
            enums[kind.name] = members
        elif isinstance(kind, c_ast.Struct) and kind.decls and kind.name:
            structs[kind.name] = [(member.name, ctype(member.type, known)) for member in kind.decls]
    return enums, structs


def shared_words(names):
    """The leading words all names share, with the underscore."""
    words = [name.split("_") for name in names]
    count = 0
    while all(len(word) > count + 1 for word in words) and len({word[count] for word in words}) == 1:
        count += 1
    return "".join(word + "_" for word in words[0][:count])


def python_text(numbers, enums, structs):
    """layout.py"""
    lines = [
        "# SPDX-License-Identifier: GPL-2.0-or-later",
        '"""Structures, enums and constants of the C core.  Made by tools/make_layout.py from the headers in '
        "components/:",
        "change them there, and run `make build`.",
        '"""',
        "import ctypes as C",
        "from enum import IntEnum",
        "",
    ]
    lines += [f"{name} = {value}" for name, value in numbers]
    for name, members in enums.items():
        prefix = shared_words([member for member, _ in members])
        lines += ["", "", f"class {camel(name.removeprefix('chip_'))}(IntEnum):", f'    """enum {name}"""', ""]
        lines += [f"    {member.removeprefix(prefix)} = {value}" for member, value in members]
    for name, members in structs.items():
        lines += [
            "",
            "",
            f"class {camel(name.removeprefix('chip_'))}(C.Structure):",
            f'    """struct {name}"""',
            "",
            "    __slots__ = ()",
            "    _fields_ = [",
        ]
        lines += [f'        ("{member}", {kind}),' for member, kind in members if kind]
        lines += ["    ]"]
    lines += ["", "", "STRUCTURES = {"]
    lines += [f'    "{name}": {camel(name.removeprefix("chip_"))},' for name in structs]
    return "\n".join(lines + ["}"]) + "\n"


def table_text(structs):
    """layout_table.c"""
    lines = [
        "/* SPDX-License-Identifier: GPL-2.0-or-later */",
        "/* layout_table.c - size of each structure, offset and size of each member, as this library was compiled.",
        " *",
        " * Who reads it: remap/chipwise/clib/library.py, when it opens the library. Made by tools/make_layout.py.",
        " */",
        "#include <stddef.h>",
        "",
    ]
    lines += [f'#include "{name}"' for name in HEADERS]
    lines += [
        "",
        "struct chip_layout_entry { const char *name; long value; };",
        "",
        "/* Names as `struct`, `struct.member` and `struct.member size`; ends with a null name. */",
        "const struct chip_layout_entry chip_layout_table[] = {",
    ]
    for name, members in structs.items():
        lines.append(f'    {{ "{name}", sizeof(struct {name}) }},')
        for member in (member for member, kind in members if kind):
            lines.append(f'    {{ "{name}.{member}", offsetof(struct {name}, {member}) }},')
            lines.append(f'    {{ "{name}.{member} size", sizeof(((struct {name} *)0)->{member}) }},')
    lines += ["    { 0, 0 }", "};", "", "int chip_core_version(void)", "{", "    return CHIP_CORE_VERSION;", "}"]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 if a file is stale")
    options = parser.parse_args()
    enums, structs = declarations(preprocess("-P"))
    texts = {PYTHON: python_text(constants(preprocess("-dM")), enums, structs), TABLE: table_text(structs)}
    stale = [path for path, text in texts.items() if not path.exists() or path.read_text(encoding="utf-8") != text]
    if options.check:
        for path in stale:
            print(f"chipwise: {path.relative_to(ROOT)} is not what the headers say; run `make build`")
        return 1 if stale else 0
    for path, text in texts.items():
        if path in stale:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
        path.touch()
    return 0


if __name__ == "__main__":
    sys.exit(main())
