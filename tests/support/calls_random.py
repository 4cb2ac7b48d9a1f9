# SPDX-License-Identifier: GPL-2.0-or-later
"""Random programs with subs, loops, conditions, parameters and modes.  Used by tests/rewrite/test_rewrite_calls.py.

Lengths are small multiples of the unit in force, arcs are quarter circles in G91 or whole circles, so every program is
valid.
"""

import random

HEAD = "G21 G90 G17 G40 G49 G80 G94 G64 P0.01\n"


class Maker:
    """One program from a seed: text, files {name: text} of subs."""

    def __init__(self, seed):
        self.r = random.Random(f"calls {seed}")
        self.label, self.subs, self.files = 100, [], {}
        r, lines = self.r, [HEAD.strip()]
        self.cycles = r.random() < 0.5
        for k in range(r.randint(1, 3)):
            self._sub(f"<s{k}>", lines)
        if r.random() < 0.4:
            own = []
            self._sub("<outside>", own)
            self.files["outside"] = "\n".join(["(a file of its own)", *own]) + "\n"
        lines += ["#<_g>=2", "#<own>=3", "#31=1", "T1 M6", "S1000 M3", "G0 X1 Y1 Z5", "F100"]
        for _ in range(r.randint(3, 8)):
            lines += self._item(0)
        lines += ["G90 G21 G17 G80", "G0 Z20", "M5 M9", "M2"]
        self.text = "\n".join(lines) + "\n"

    def _sub(self, name, lines):
        lines.append(f"o{name} sub")
        self.depth = 0
        for _ in range(self.r.randint(2, 5)):
            lines += self._item(1)
        if self.r.random() < 0.3:
            lines.append("#<inner>=[#1*2]")
        lines.append(f"o{name} endsub")
        self.subs.append(name)

    def value(self):
        r = self.r
        return r.choice(
            [
                f"{r.uniform(-9, 9):.3f}",
                f"[{r.randint(1, 9)}/4]",
                "#31",
                "#<_g>",
                f"[#31*{r.randint(1, 3)}+#<_g>]",
                f"[sin[{r.randint(1, 90)}]*5]",
            ]
        )

    def _item(self, level):
        """Lines of one thing that a program does."""
        r = self.r
        kinds = [self._move] * 5 + [self._arc] * 2 + [self._code] * 3 + [self._assign] * 2 + [self._cycle] * self.cycles
        if level < 3:
            kinds += [self._loop] * 2 + [self._condition]
            kinds += [self._call] * 3 if self.subs else []
        return r.choice(kinds)(level)

    def _move(self, _level):
        r = self.r
        words = [a + self.value() for a in r.sample("XYZ", r.randint(1, 3))]
        line = (
            r.choice(["G0 ", "G1 ", "", "G1 "])
            + " ".join(words)
            + r.choice(["", "", f" F{r.randint(50, 500)}", " F[50*#31+60]"])
        )
        line += r.choice(["", "", "", " M8", f" (note {r.randint(1, 9)})", " S[100*#<_g>]"])
        return [r.choice(["", f"N{r.randint(1, 99)} "]) + ("G1 " if line[0] not in "G" else "") + line]

    def _arc(self, _level):
        r, radius = self.r, self.r.choice(["2", "3.5", "[1+1]"])
        a, b, i, g = r.choice([("X", "Y", "I", "G17"), ("X", "Z", "I", "G18"), ("Y", "Z", "J", "G19")])
        turn, ahead = (2, 1) if g != "G18" else (3, 1)
        return [
            g,
            f"G91 G{turn} {a}{radius} {b}{radius if ahead > 0 else ''} {i}{radius}",
            r.choice(["G90", "G90", "G91 G1 X1", "G90 G17"]),
            *(["G90"] if r.random() < 0.5 else []),
        ]

    def _code(self, _level):
        r = self.r
        return [
            r.choice(
                [
                    "M8",
                    "M9",
                    "M7",
                    "S[200+100*#31] M3",
                    "M62 P1",
                    "M63 P[0+1]",
                    "M67 E1 Q[#31/2]",
                    "G4 P0.1",
                    "(MSG, hello)",
                    "(DEBUG, g is #<_g>)",
                    "G61",
                    "G64 P0.02",
                    "G54",
                    "G55",
                    "G20",
                    "G21",
                    "G10 L2 P2 X[1+#31] Y2 Z1",
                    "G92 X1 Y[#31]",
                    "G92.1",
                    "G90",
                    "G91",
                    "M5",
                    "M3 S900 (MSG, on)",
                    "G43 H1",
                    "G49",
                    "G98",
                    "G99",
                    "G17",
                    "G0 X1 M9",
                    "M48",
                    "G53 G0 Z30",
                    "G91 G28 Z3",
                    "T2 M6",
                    "G40",
                ]
            )
        ]

    def _assign(self, _level):
        r = self.r
        return [
            r.choice(
                [
                    "#31=[#31+1]",
                    "#<_g>=[#<_g>*1.5-1]",
                    "#<own>=[7/3]",
                    f"#{r.randint(40, 50)}={self.value()}",
                    "#[60+1]=#31",
                    "#<_new>=[#31-0.123456789]",
                    "#31=1 #32=2",
                ]
            )
        ]

    def _cycle(self, _level):
        r = self.r
        lines = ["G90 G21 G17", f"G81 X{r.randint(1, 9)} Y2 Z[-1-#31/10] R20 F100"]
        lines += [f"X{r.randint(1, 20)}"] * r.randint(0, 2)
        return lines + r.choice([["G80"], ["G80"], ["G0 Z25"]])

    def _name(self):
        self.label += 1
        return f"o{self.label}"

    def _body(self, level):
        return [line for _ in range(self.r.randint(1, 3)) for line in self._item(level + 1)]

    def _loop(self, level):
        r, name = self.r, self._name()
        count, body = r.randint(1, 3), self._body(level + 1)
        counter = f"#<n{name[1:]}>"
        kind = r.randrange(3)
        if kind == 0:
            return [f"{name} repeat [{count}]", *body, f"{name} endrepeat"]
        if kind == 1:
            return [
                f"{counter}=0",
                f"{name} while [{counter} LT {count}]",
                *body,
                f"{counter}=[{counter}+1]",
                f"{name} endwhile",
            ]
        return [f"{counter}=0", f"{name} do", *body, f"{counter}=[{counter}+1]", f"{name} while [{counter} LT {count}]"]

    def _condition(self, level):
        name = self._name()
        other = [f"{name} else", *self._body(level + 1)] if self.r.random() < 0.5 else []
        return [f"{name} if [#31 GT {self.r.randint(0, 4)}]", *self._body(level + 1), *other, f"{name} endif"]

    def _call(self, _level):
        return [f"o{self.r.choice(self.subs)} call [{self.value()}] [2]" + self.r.choice(["", " (calls)"])]
