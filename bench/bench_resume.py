# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise resume` at random stops of twenty programs, judged by an oracle.

Called by bench/run.py (prints JSON rows); by hand `/usr/bin/python3 bench/bench_resume.py --programs N --stops M --seed
S [--only NAME ..] [--real]`.

 1. Without --real the stop is made of the program's path in steps of the servo thread, cut by the core
    (support/resume_oracle.py): what the machine would have saved.  Kinds of stop: abort (cells and tool of one moment),
    crash (the saved cells up to 0.8 s older than the part, the tool's place before or behind them), broken (the tool
    broke up to 300 s before the stop, --time says so, rounded up), line (--line).
 2. With --real the program runs in LinuxCNC in the sandbox and is stopped there (support/resume_machine.py).
 3. Judged: the stock in the end against the uninterrupted run's (heights within a cell and its neighbours, volume),
    stock met by traverses, feed in air that is added, feed that is left out.  A refusal counts as a fault, too, and is
    shown.
"""

import argparse
import collections
import json
import math
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

from roots import ROOT
from rows import row

from chipwise.program.records import RAPID
from chipwise.errors import CycleError
from chipwise.resume import run as resume
from chipwise.resume import stocks
from support.resume_case import SAME_MM, SAME_MM3, SAME_SHARE, Case, feed_left, stations
from support.resume_oracle import PERIOD_S, apart
from support.resume_programs import MORE, MORE_SAMPLES, OWN, SAMPLES

KINDS = (("abort", 0.35), ("crash", 0.35), ("broken", 0.2), ("line", 0.1))
LAG_S = 0.8  # between the cells that were saved and a crash
LATEST_S = 300.0  # after which a broken tool is reported
LEFT_OUT_S = 0.5  # of feed: rounding of the periods
MET_MM3 = 1e-3


def programs():
    """{name: text, or None for a sample}"""
    return {**dict.fromkeys(SAMPLES), **OWN, **MORE, **dict.fromkeys(MORE_SAMPLES)}


def case_of(folder, name, text):
    if text is None:
        return Case(folder, ROOT / "nc_files" / f"{name}.ngc")
    path = folder / f"{name.split()[0].strip(',')}.ngc"
    path.write_text(text)
    return Case(folder, path)


def uncut_to_end(case, stock):
    """The stock of the uninterrupted run with the cells of another one."""
    if not hasattr(case, "other"):
        case.other = stocks.blank(stocks.head_of(stock, 0.0))
        case.run.cut(case.other, 0, len(case.run.points) - 1)
    return case.other


class Stop:
    """One stop of a Case: the stock of the part as it is then, and what resume is asked."""

    def __init__(self, case, index, stock, removed, rng):
        self.case, self.index, self.rng = case, index, rng
        self.kind = rng.choices([kind for kind, _share in KINDS], [share for _kind, share in KINDS])[0]
        self.order, self.base, self.last = resume.Order(), stock, index
        self.note = ""
        getattr(self, "_" + self.kind)(stock, removed)

    def _abort(self, stock, removed):
        self.case.keep(stock, removed, self.index)

    def _crash(self, stock, removed):
        """The saved stock is the given one; the part was cut on."""
        lag, tip = self.rng.randrange(int(LAG_S / PERIOD_S)), self.index + self.rng.choice([0, -12, -2, -1, 1, 2, 12])
        tip = min(max(tip, 1), len(self.case.run.points) - 1)
        self.case.keep(stock, removed, tip)
        self.last = min(self.index, tip)
        self.note = f"lag {lag} tip {tip - self.index}"

    def _broken(self, stock, removed):
        """The tool cut nothing more behind `index`; the machine went on to `later` and kept what it took for cut."""
        run = self.case.run
        within = int(self.rng.uniform(0, LATEST_S) / PERIOD_S)
        later = min(self.index + within, len(run.points) - 2)
        same = run.tool[self.index : later + 1] == run.tool[self.index]
        later = self.index + max(int(same.sum()) - 1, 1)
        kept = run.new_stock()
        cut = run.cut(kept, 0, later)
        self.case.keep(kept, cut, later)
        seconds = float(run.seconds[self.index + 1 : later + 1].sum())
        self.order = resume.Order(None, math.ceil(seconds), True)
        self.note = f"reported {seconds:.0f} s later"

    def _line(self, _stock, _removed):
        """Before a line of the program's feeds."""
        run = self.case.run
        lines = self.case.job.followed.program.place[run.move]
        line = int(lines[self.index])
        first = int((lines >= line).argmax())
        self.last, self.order, self.note = max(first - 1, 0), resume.Order(line), f"line {line}"

    def judge(self):
        """(fault or "", s of feed in air added)."""
        case = self.case
        stopped = case.job.of_line(self.order) if self.kind == "line" else case.job.of_kept(self.order)
        made = case.job.finish(stopped, self.order)
        cut, met, fed = case.resumed(made.data, self.base if self.kind == "broken" else made.stock)
        whole = case.whole if self.kind != "line" else uncut_to_end(case, made.stock)
        higher, lower = apart(whole, cut)
        added = fed - feed_left(case, self.last)
        volume = cut.volume() - whole.volume()
        fault = ""
        if max(higher, lower) >= SAME_MM:
            fault = f"heights differ by {higher:.3f} mm higher, {lower:.3f} mm lower"
        elif abs(volume) >= SAME_MM3 + SAME_SHARE * case.volume:
            fault = f"volume differs by {volume:.2f} mm3"
        elif met >= MET_MM3:
            fault = f"traverses meet {met:.3g} mm3"
        elif added < -LEFT_OUT_S:
            fault = f"{-added:.2f} s of feed are left out"
        return fault, added


def simulated(name, text, count, seed):
    """Dicts of the stops of one program."""
    with tempfile.TemporaryDirectory() as scratch:
        case = case_of(Path(scratch), name, text)
        for index, stock, removed in stations(case, count, f"{seed} {name}"):
            rng, began = random.Random(f"{seed} {name} {index}"), time.process_time()
            stop = Stop(case, index, stock, removed, rng)
            found = {"program": name, "index": index, "kind": stop.kind, "note": stop.note, "added": None}
            try:
                found["fault"], found["added"] = stop.judge()
            except (CycleError, resume.Unreadable, resume.Different) as error:
                found["fault"] = f"refused: {error}"
            found["line"] = int(case.program.line[case.run.move[index]])
            found["rapid"] = bool(case.program.kind[case.run.move[index]] == RAPID)
            found["s"] = time.process_time() - began
            yield found


def real(name, text, count, seed):
    """The same of stops in LinuxCNC."""
    from support import resume_machine

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        folder.chmod(0o755)
        yield from resume_machine.stops(folder, case_of(folder, name, text), count, f"{seed} {name}")


def report(found, kind):
    """JSON rows."""
    faults = [one for one in found if one["fault"]]
    refused = [one for one in faults if one["fault"].startswith("refused")]
    added = [one["added"] for one in found if one["added"] is not None]
    kinds = collections.Counter(one["kind"] for one in found)
    note = f"{len({one['program'] for one in found})} programs; " + ", ".join(
        f"{count} {name}" for name, count in sorted(kinds.items())
    )
    print(
        json.dumps(
            row(
                f"{kind}: stops that end otherwise",
                len(faults) - len(refused),
                "",
                f"of {len(found)}; {note}",
                target=0,
            )
        ),
        flush=True,
    )
    print(
        json.dumps(row(f"{kind}: stops that are refused", len(refused), "", f"of {len(found)}", target=0)), flush=True
    )
    if added:
        added.sort()
        print(
            json.dumps(
                row(
                    f"{kind}: feed in air added, median",
                    statistics.median(added),
                    "s",
                    f"largest {added[-1]:.1f}",
                    target=5,
                )
            ),
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=int, default=4)
    parser.add_argument("--stops", type=int, default=2, help="of each program")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--only", nargs="*", default=[], metavar="NAME")
    parser.add_argument("--real", action="store_true", help="in LinuxCNC")
    parser.add_argument("--log", help="file for one JSON line a stop")
    options = parser.parse_args()
    chosen = {
        name: text
        for name, text in programs().items()
        if not options.only or any(part in name for part in options.only)
    }
    names = (
        list(chosen)
        if options.only
        else random.Random(options.seed).sample(list(chosen), min(options.programs, len(chosen)))
    )
    found = []
    for name in names:
        for one in (real if options.real else simulated)(name, chosen[name], options.stops, options.seed):
            found.append(one)
            if one["fault"]:
                print(
                    f"{one['program']} {one['kind']} line {one['line']} index {one['index']} {one['note']}: "
                    f"{one['fault']}",
                    file=sys.stderr,
                    flush=True,
                )
            if options.log:
                with open(options.log, "a", encoding="utf-8") as log:
                    log.write(json.dumps(one) + "\n")
    report(found, "LinuxCNC" if options.real else "simulated")
    return 0


if __name__ == "__main__":
    sys.exit(main())
