# SPDX-License-Identifier: GPL-2.0-or-later
"""A file of tool geometry with comments and forms of every kind.  Called by tests/common/test_tool_editor.py and
tests/panel/test_panel_tools.py."""

FILE = """# Tools of the shop, mm

[tool.1]          # the good one
shape = "flat"    # new in May
flute_length = 20
# flutes = 4      what it was before

# the ball
[ tool . 2 ]
\tshape="ball"
  max_rate = 1_000\t# steel
[lathe.3]
edge_length = 12
holder = [0, 25,
  8]
[tool.10]

# the end
"""


def written(tmp_path, text=FILE):
    path = tmp_path / "tools.toml"
    path.write_bytes(text.encode())
    return path
