# SPDX-License-Identifier: GPL-2.0-or-later
"""Run the demo program on a headless simulated mill and print the summary.

The program runs twice: unchanged, with the volumetric feed, and with a
constant feed that has the same largest removal rate.  The summary is
that of the first run with `constant_feed_cycle_s` and `time_saved` (a share of
the constant-feed time) added; one line of JSON.
"""

import json
import os
import re
import tempfile

import numpy as np

from chipwise.headless import log as runlog
from chipwise.headless import runner

NAME = "demo"
HELP = "run the demo program headless and compare it with constant feed"
PROGRAM = os.path.join(runner.ROOT, "nc_files", "panel.ngc")
DEFAULT_SPEED = 5.0
FEED_ON = re.compile(r"\bM\s*251\b.*", re.IGNORECASE)
FEED_WORD = re.compile(r"((?<![#<\w])F\s*)[0-9.]+", re.IGNORECASE)
PLUNGE_WORD = re.compile(r"((?<![#<\w])E\s*)([0-9.]+)", re.IGNORECASE)


def add_arguments(parser):
    parser.add_argument("program", nargs="?", default=PROGRAM, help="another program (default: nc_files/panel.ngc)")
    parser.add_argument(
        "--speed",
        type=float,
        metavar="N",
        help="let time pass N times as fast (default: %g if chipwise-sandbox can, else 1)" % DEFAULT_SPEED,
    )
    parser.add_argument(
        "--timeout", type=float, default=3600.0, metavar="S", help="give up a run after S seconds of machine time"
    )
    parser.add_argument("--no-compare", action="store_true", help="leave out the constant-feed run")
    parser.add_argument("--log", metavar="FILE", help="save the servo-period log of the first run (.npz, .csv)")


def constant_feed(text, feed):
    """A program with every M251 turned into M252 and every F and E at most `feed` mm/min.

    Only in code, not in comments.  F becomes the constant feed, an E (plunge feed) above it too.
    """
    lines = []
    for line in text.splitlines():
        cut = min((i for i in (line.find("("), line.find(";")) if i >= 0), default=len(line))
        code, comment = line[:cut], line[cut:]
        code = FEED_ON.sub("M252 ", code)
        code = FEED_WORD.sub(r"\g<1>%.3f" % feed, code)
        code = PLUNGE_WORD.sub(lambda m: "%s%.3f" % (m.group(1), min(float(m.group(2)), feed)), code)
        lines.append(code + comment)
    return "\n".join(lines) + "\n"


def run_once(path, options, log=None):
    from chipwise.options.machine import CommandError

    try:
        return runner.run_headless(path, speed=options.speed, timeout=options.timeout, log=log)
    except runner.RunError as error:
        raise CommandError(error) from error


def run(options):
    from chipwise.options.machine import CommandError, require_file

    require_file(options.program, "name a G-code program that can be read")
    if options.speed is None:
        options.speed = DEFAULT_SPEED if runner.can_run_at(DEFAULT_SPEED) else 1.0
    if not 0 < options.speed <= 20:
        raise CommandError("--speed %g is out of range; use more than 0 and up to 20" % options.speed)
    with tempfile.TemporaryDirectory(prefix="chipwise-demo.") as folder:
        log = options.log or os.path.join(folder, "run.npz")
        summary = run_once(options.program, options, log)
        status = summary.pop("exit_status")
        if status == 0 and not options.no_compare:
            status = compare(options, summary, log)
    print(json.dumps(summary))
    return status


def compare(options, summary, log_path):
    """Add the constant-feed run to the summary; -> exit status.

    The constant F has, at the largest section of the first run, the peak removal rate of that run:
    the F a careful programmer would write to load the tool no more.
    """
    feed = constant_feed_rate(summary, log_path)
    with open(options.program) as handle:
        text = constant_feed(handle.read(), feed)
    with tempfile.TemporaryDirectory(prefix="chipwise-demo.") as folder:
        path = os.path.join(folder, os.path.basename(options.program))
        with open(path, "w") as handle:
            handle.write(text)
        constant = run_once(path, options)
    summary["constant_feed"] = round(feed, 1)
    summary["constant_feed_peak"] = constant["rate_peak"]
    summary["constant_feed_cycle_s"] = constant["cycle_s"]
    summary["time_saved"] = round(1.0 - summary["cycle_s"] / constant["cycle_s"], 4) if constant["cycle_s"] else None
    summary["errors"] += constant["errors"]
    return constant["exit_status"]


def constant_feed_rate(summary, log_path):
    """F (mm/min) of the constant-feed run: peak rate over largest section area (mm2)."""
    with np.load(log_path) as stored:
        log = {name: stored[name] for name in stored.files}
    section = runlog.largest_section(log, float(log["period"]), float(log["units_per_mm"]))
    if not (summary["rate_peak"] and section > 0):
        from chipwise.options.machine import CommandError

        raise CommandError("the program cut nothing, so there is no constant feed to compare with")
    return summary["rate_peak"] / section
