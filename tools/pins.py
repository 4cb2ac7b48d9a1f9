#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Write the tables of docs/design/pins.md: every pin and parameter of the components, from their .comp files.

    tools/pins.py            rewrite the tables
    tools/pins.py --list     print the names

Called by hand after a change of a pin, and by tests/docs/test_docs.py for the names.
"""

import argparse
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
PAGE = os.path.join(ROOT, "docs", "design", "pins.md")
COMPONENTS = (
    "chipwise_inputs",
    "chipwise_command",
    "stock_tracker",
    "volumetric_feed",
    "chipwise_guard",
    "tracer",
    "tracer_offset",
    "tracer_slave",
    "tracer_model",
    "spindle_sim",
)

_LINE = re.compile(
    r"^(pin|param)\s+(in|out|io|rw|r)\s+(\w+)\s+(\w+)(#?)(?:\[(\d+)\])?\s*"
    r'(?:=\s*([^\s"]+))?\s*"((?:[^"\\]|\\.)*)"',
    re.MULTILINE,
)


def entries(component):
    """[(kind, name, type, default, description)] of a component: kind as "pin in"."""
    with open(os.path.join(ROOT, "components", component + ".comp"), encoding="utf-8") as handle:
        source = handle.read().split("\n;;\n")[0]
    found = []
    for kind, direction, kind_of_value, name, numbered, _count, default, text in _LINE.findall(source):
        name = name.replace("_", "-") + ("N" if numbered else "")
        text = text.replace('\\"', '"').replace("|", "\\|")
        found.append((f"{kind} {direction}", name, kind_of_value, default or "", text))
    return found


def names():
    """{component: [name]}."""
    return {component: [entry[1] for entry in entries(component)] for component in COMPONENTS}


def table(component):
    rows = [
        f"| `{name}` | {kind} | {of_value} | {default} | {said} |"
        for kind, name, of_value, default, said in entries(component)
    ]
    return ["| name | | type | default | |", "|---|---|---|---|---|", *rows]


def update():
    """Replace the table below each component's heading."""
    with open(PAGE, encoding="utf-8") as handle:
        parts = re.split(r"(?m)^## ", handle.read())
    for k, part in enumerate(parts):
        name = part.split("\n", 1)[0].strip()
        if name in COMPONENTS:
            kept = [line for line in part.rstrip().split("\n") if not line.startswith("|")]
            parts[k] = "\n".join(kept).rstrip() + "\n\n" + "\n".join(table(name)) + "\n\n"
    with open(PAGE, "w", encoding="utf-8") as handle:
        handle.write("## ".join(parts).rstrip() + "\n")


def main():
    parser = argparse.ArgumentParser(description="The tables of docs/design/pins.md.")
    parser.add_argument("--list", action="store_true", help="print the names")
    if parser.parse_args().list:
        for component, found in names().items():
            print(component + ":", *found)
    else:
        update()


if __name__ == "__main__":
    sys.exit(main())
