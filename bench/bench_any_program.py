# SPDX-License-Identifier: GPL-2.0-or-later
"""Any program, as it is: what chipwise check, rewrite and the filter answer for sixty ordinary programs and for
LinuxCNC's own, and whether the findings are true.

Called by hand: `/usr/bin/python3 bench/bench_any_program.py [--seed N] [--every N [--from N]] [--nc FOLDER]
[--answers]`.

 1. tests/support/ordinary_programs.py has the programs: twelve CAM systems' manners, five shapes of work each, in eight
    clothes.  The machine is configs/mill.ini.
 2. Each is answered with figures, or refused with a sentence, or it fails: a traceback, an internal error, no answer.
 3. tests/support/ordinary_oracle.py, written apart, cuts the stock that check has named.  A finding is false if no line
    of it is as it says, with 3 % of a rate and 0.02 mm of a depth for the cells; one is missing if a line is clearly
    beyond a limit (15 %, 0.3 mm) and no finding has it.
 4. --answers: a program that rewrite has written leaves the same part, its traverses go no deeper into stock, and it
    keeps the rate, or the flutes, by the same oracle.
"""

import argparse
import json
import subprocess
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
from roots import ROOT

from support import ordinary_oracle, ordinary_programs

CHIPWISE = Path(ROOT) / "bin" / "chipwise"
DEPTH, RATE = 0.02, 0.97  # what the cells of the model may be off
MISSED_DEPTH, MISSED_RATE = 0.3, 1.15
FEED = 12  # cm3/min, of rewrite --feed


def tools():
    """{number: section} of configs/tools.toml."""
    with open(Path(ROOT) / "configs" / "tools.toml", "rb") as file:
        return {int(number): section for number, section in tomllib.load(file)["tool"].items()}


def is_true(finding, truth, described):
    """Whether one finding is as it says."""
    lines = range(finding["line"], finding["last_line"] + 1)
    rule, number, tool = finding["rule"], finding["tool"], described.get(finding["tool"], {})
    if rule == "rate":
        return max((truth.rate.get(k, 0.0) for k in lines), default=0.0) > RATE * tool["max_rate"]
    if rule == "flute":
        return max((truth.depth.get(k, 0.0) for k in lines), default=0.0) > tool["flute_length"] - DEPTH
    if rule == "rapid":
        return max((truth.rapid.get(k, 0.0) for k in lines), default=0.0) > 0.0
    if rule == "clearance":
        return bool(truth.beside & set(lines))
    if rule == "machine":
        return number == ordinary_programs.STRANGE
    return rule in ("tool", "flute-unknown") and "flute_length" not in tool


def missing(program, truth, described):
    """Number of lines that are clearly beyond a limit and in no finding."""
    has = {rule: set() for rule in ("rate", "flute", "rapid")}
    for finding in program["findings"]:
        has.get(finding["rule"], set()).update(range(finding["line"], finding["last_line"] + 1))
    tool = described.get(program["tools"][0]["tool"], {})
    most, flutes = tool.get("max_rate"), tool.get("flute_length")
    found = [k for k, depth in truth.rapid.items() if depth > MISSED_DEPTH and k not in has["rapid"]]
    found += [k for k, rate in truth.inner.items() if most and rate > MISSED_RATE * most and k not in has["rate"]]
    return len(found) + len(
        [k for k, depth in truth.depth.items() if flutes and depth > flutes + MISSED_DEPTH and k not in has["flute"]]
    )


def judged(paths):
    """[program of --json] of chipwise check."""
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "found.json"
        subprocess.run(
            [CHIPWISE, "check", *paths, "--json", found, "--time-limit", "30"],
            capture_output=True,
            stdin=subprocess.DEVNULL,
            check=False,
        )
        return json.loads(found.read_text())["programs"] if found.exists() else []


def outcome(error):
    """A sentence, or a failure."""
    return (
        "failed"
        if not error or "internal error" in error or "Traceback" in error or len(error) < 12
        else "refused with a sentence"
    )


def check_all(texts, folder):
    """-> (Counter, [lines about what is wrong])."""
    described, count, wrong = tools(), Counter(), []
    results = judged([folder / name for name in texts])
    count["failed"] = len(texts) - len(results)
    for program in results:
        name = Path(program["program"]).name
        if program["status"] == 2:
            count[outcome(program["error"])] += 1
            wrong.append(f"{name}: {program['error']}")
            continue
        count["answered"] += 1
        if len(program["tools"]) != 1 or not program["stock"]:
            wrong.append(f"{name}: {len(program['tools'])} tools, stock {program['stock']}")
            continue
        text = texts[name][0].decode()
        truth = truth_of(text, program)
        false = [one for one in program["findings"] if not is_true(one, truth, described)]
        lost = missing(program, truth, described)
        count["findings"] += len(program["findings"])
        count["false findings"] += len(false)
        count["missing findings"] += lost
        volume = program["tools"][0]["volume_mm3"]
        if abs(volume - truth.volume) > 0.02 * truth.volume + 3.0:
            count["volume more than 2 % off"] += 1
            wrong.append(f"{name}: {volume:.0f} mm3, the oracle {truth.volume:.0f}")
        wrong += [f"{name}: false: {one['text']}" for one in false] + ([f"{name}: {lost} missing"] if lost else [])
    return count, wrong


def wrongs(kind, before, after, tool):
    """[what is wrong] with a rewritten program: Truth of the old and of the new one, and the section of its tool."""
    found = []
    change = float(np.abs(before.heights - after.heights).max())
    if change > DEPTH:
        found.append(f"the part differs by {change:.3f} mm")
    into = max(after.rapid.values(), default=0.0), max(before.rapid.values(), default=0.0)
    if into[0] > into[1] + DEPTH:
        found.append(f"traverses go {into[0]:.3f} mm into stock, {into[1]:.3f} before")
    rate = max(after.inner.values(), default=0.0), max(before.inner.values(), default=0.0)
    if kind == "--feed" and rate[0] > FEED * (2.0 - RATE):
        found.append(f"{rate[0]:.2f} cm3/min, {rate[1]:.2f} before")
    deepest = max(after.depth.values(), default=0.0)
    if kind == "--flute" and deepest > tool.get("flute_length", deepest) + DEPTH:
        found.append(f"{deepest:.3f} mm deep, flutes {tool['flute_length']} mm")
    return found


def answers(texts, folder):
    """(Counter of what rewrite and the filter do with each, [lines about what is wrong]); a program that is written is
    judged on the stock that check names for the old one."""
    count, wrong, described = Counter(), [], tools()
    known = {
        Path(program["program"]).name: program
        for program in judged([folder / name for name in texts])
        if program["status"] < 2
    }
    for name, (data, _clothes) in texts.items():
        before = known.get(name) and truth_of(data.decode(), known[name])
        for kind, words in (("--feed", ["--feed", str(FEED), "--ceiling", "3000"]), ("--flute", ["--flute"])):
            done = subprocess.run(
                [CHIPWISE, "rewrite", folder / name, "-o", folder / "out.ngc", *words],
                text=True,
                capture_output=True,
                stdin=subprocess.DEVNULL,
                check=False,
            )
            count[
                f"rewrite {kind}: " + ("written" if done.returncode == 0 else outcome(done.stderr or done.stdout))
            ] += 1
            if done.returncode == 0:
                text = (folder / "out.ngc").read_text()
                said = (
                    wrongs(
                        kind, before, truth_of(text, known[name]), described.get(known[name]["tools"][0]["tool"], {})
                    )
                    if before
                    else ["check refuses it"]
                )
                count[f"rewrite {kind}: changed"] += text != data.decode()
                count[f"rewrite {kind}: wrong"] += bool(said)
                wrong += [f"{name} {kind}: {one}" for one in said]
        done = subprocess.run(
            [CHIPWISE, "filter", folder / name], capture_output=True, stdin=subprocess.DEVNULL, check=False
        )
        opened = done.returncode == 0 and done.stdout
        count["filter: " + ("opened" if opened else outcome(done.stderr.decode("utf-8", "replace")))] += 1
        count["filter: opened with another text"] += bool(opened) and done.stdout != data
    return count, wrong


def truth_of(text, program):
    """Truth of a text on stock and tool of check's answer."""
    return ordinary_oracle.truth(
        text, program["stock"]["min"], program["stock"]["max"], program["tools"][0]["diameter_mm"]
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--nc", help="a folder of programs, with those below it, which are only counted")
    parser.add_argument("--answers", action="store_true", help="rewrite and the filter, in place of check")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="each Nth of the sixty only")
    parser.add_argument("--from", type=int, default=0, metavar="N", dest="first", help="after the first N of them")
    options = parser.parse_args()
    texts = dict(list(ordinary_programs.programs(options.seed).items())[options.first :: options.every])
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, (data, _clothes) in texts.items():
            (folder / name).write_bytes(data)
        if options.answers:
            count, wrong = answers(texts, folder)
            print(
                "\n".join([f"{key} {value}" for key, value in sorted(count.items())] + ["  " + text for text in wrong])
            )
        else:
            count, wrong = check_all(texts, folder)
            print(
                f"check, {len(texts)} ordinary programs, seed {options.seed}: "
                + ", ".join(f"{key} {value}" for key, value in count.items())
            )
            print("\n".join("  " + text for text in wrong))
    if options.nc:
        results = judged(sorted(Path(options.nc).rglob("*.ngc")))
        count = Counter("answered" if program["status"] < 2 else outcome(program["error"]) for program in results)
        print(
            f"check, {len(results)} programs below {options.nc}: "
            + ", ".join(f"{key} {value}" for key, value in count.items())
        )


if __name__ == "__main__":
    main()
