# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise turn` on the simulated lathe with more tools.  Called by tests/turning."""

import json

from chipwise import cli
from support import ROOT


class Bench:
    """A folder with the lathe's INI file, tool table and geometry; capsys: the fixture; tools: {number: {"line": of the
    table, "table": keys}}."""

    def __init__(self, folder, capsys, tools=()):
        self.folder, self.capsys = folder, capsys
        for name in ("lathe.ini", "lathe.tbl", "lathe_tools.toml"):
            (folder / name).write_text((ROOT / "configs" / name).read_text())
        for number, tool in dict(tools).items():
            self.add(number, tool["line"], tool["table"])

    def add(self, number, line, table):
        """One more tool: its line of the tool table, its keys of [lathe.N]."""
        for name, text in (("lathe.tbl", line + "\n"), ("lathe_tools.toml", f"[lathe.{number}]\n{table}")):
            with open(self.folder / name, "a") as file:
                file.write(text)

    def turn(
        self,
        part,
        tools,
        mode="G8",
        more="",
        call="G26 Q100 I0.3 D1 F100 E50",
        bar=(30, -60, 1),
        spindle="G94 G97 S500 M3",
        options=(),
    ):
        """(status, plan as data or None, what it said) of a part's sub, the LATHE comment and a bar (diameter, ZMIN,
        ZMAX)."""
        lathe = f"(LATHE,{tools})\n" if tools else ""
        return self.run(
            f"(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER={bar[0]},ZMIN={bar[1]},ZMAX={bar[2]})\n"
            f"{lathe}G21 G18 {mode} {spindle}\n{more}{call}\nM2\n"
            f"O100 sub\n{part}O100 endsub\n",
            options,
        )

    def run(self, text, options=()):
        """The same of a program's text."""
        (self.folder / "part.ngc").write_text(text)
        data = self.folder / "plan.json"
        data.unlink(missing_ok=True)
        self.capsys.readouterr()
        status = cli.main(
            [
                "turn",
                str(self.folder / "part.ngc"),
                "--json",
                str(data),
                "--ini",
                str(self.folder / "lathe.ini"),
                *map(str, options),
            ]
        )
        return status, json.loads(data.read_text()) if data.exists() else None, "".join(self.capsys.readouterr())

    def plan(self, part, tools, steps=(), options=(), **more):
        """Plan as data, which has to be there."""
        options = list(options)
        if steps:
            (self.folder / "steps.toml").write_text(f"steps = {json.dumps(list(steps))}\n")
            options += ["--steps", self.folder / "steps.toml"]
        status, plan, said = self.turn(part, tools, options=options, **more)
        assert status in (0, 1), said
        return plan
