#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Write a component as the halcompile on the PATH reads it.

    tools/make_component.py SOURCE TARGET

The Makefile calls it before halcompile.  components/*.comp are written for HAL as LinuxCNC 2.10 has it: types real,
bool, si32, ui32, and NAME_set(value) for a pin or parameter that is written.  Where halcompile refuses such a type
 (2.9), TARGET gets
 - the types of 2.9, and a macro NAME_set for each name that may be written,
 - nofp for the comment with that word, because 2.10 warns of it,
 - POST_EXPORT as the end of EXTRA_SETUP: a parameter without a default keeps what it is given there.
Otherwise TARGET is a copy.  Lines keep their numbers for the compiler's messages.
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

OLD = {"real": "float", "bool": "bit", "si32": "s32", "ui32": "u32"}
PROBE = 'component probe;\npin out real x;\nfunction _;\nlicense "GPL";\n;;\nFUNCTION(_) {}\n'
DECLARED = re.compile(r"^((?:pin|param)\s+(\w+)\s+)(\w+)(\s+(\w+?)(_?#\[\d+\])?\s)", re.MULTILINE)
ARGUMENTS = "(struct __comp_state *__comp_inst, char *prefix, long extra_arg)"
SPLIT_SETUP = f"""#define POST_EXPORT() static int post_export{ARGUMENTS}
#undef EXTRA_SETUP
#define EXTRA_SETUP() static int before_export{ARGUMENTS}
"""
JOINED_SETUP = f"""
static int extra_setup{ARGUMENTS}
{{
    int code = before_export(__comp_inst, prefix, extra_arg);
    return code ? code : post_export(__comp_inst, prefix, extra_arg);
}}
"""


def knows_new_types():
    """Whether the halcompile on the PATH does."""
    with tempfile.TemporaryDirectory() as folder:
        probe = Path(folder) / "probe.comp"
        probe.write_text(PROBE)
        return (
            subprocess.run(
                ["halcompile", "--preprocess", probe], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            ).returncode
            == 0
        )


def old_spelling(text, path):
    """The component `text` for LinuxCNC 2.9."""
    head, body = text.split("\n;;\n", 1)
    written = [
        (name, numbered)
        for _all, direction, _type, _rest, name, numbered in DECLARED.findall(head)
        if direction != "in"
    ]
    macros = "".join(
        f"#define {name}_set(i, v) ({name}(i) = (v))\n" if numbered else f"#define {name}_set(v) ({name} = (v))\n"
        for name, numbered in written
    )
    head = DECLARED.sub(lambda found: found[1] + OLD[found[3]] + found[4], head).replace("/* nofp */", "nofp")
    splits = "\nPOST_EXPORT() {" in body
    return (
        f'{head}\n;;\n{macros}{SPLIT_SETUP if splits else ""}#line {head.count(chr(10)) + 3} "{path}"\n'
        f"{body}{JOINED_SETUP if splits else ''}"
    )


def main():
    source, target = map(Path, sys.argv[1:])
    text = source.read_text()
    target.write_text(text if knows_new_types() else old_spelling(text, source.resolve()))


if __name__ == "__main__":
    main()
