# SPDX-License-Identifier: GPL-2.0-or-later
"""Run one program on LinuxCNC without a screen: the display of configs/mill_headless.ini.

    [DISPLAY]DISPLAY = ../bin/chipwise-headless

LinuxCNC calls it with `-ini FILE`.  It switches the machine on, homes it, runs
the program to its end, prints ONE line of JSON on stdout, and exits with 0 only
if the program finished without an operator error.  It reads from the
environment:

  CHIPWISE_PROGRAM   the program to run; a relative name is relative to the
                     directory linuxcnc was started in, else to chipwise's
  CHIPWISE_TIMEOUT   seconds for all of it (default 3600)
  CHIPWISE_REPORT    where the cycles write their report, set before linuxcnc
                     starts (default: a file in HOME)
  CHIPWISE_LOG       save the servo-period log here, .npz or .csv
  CHIPWISE_SUMMARY   write the JSON line here too: linuxcnc keeps the output of
                     a display for its log unless -r or a terminal is there

From a shell, `chipwise demo PROGRAM` starts LinuxCNC with it.
"""

import argparse
import json
import os
import signal
import sys
import tempfile
import time

from chipwise import ROOT, report, version
from chipwise.host.clock import patience
from chipwise.errors import CycleError, unnamed
from chipwise.host.halcmd import getp
from chipwise.headless import log as runlog
from chipwise.headless import sampling, session
from chipwise.ini import Ini
from chipwise.monitor import known

DEFAULT_TIMEOUT_S = 3600.0
READ_S = 150.0  # for a program that is read; the monitor gives up before
MONITOR = "chipwise-monitor."
KEYS = (
    "program",
    "finished",
    "cycle_s",
    "volume_mm3",
    "rate_target",
    "rate_mean",
    "rate_peak",
    "over_target_share",
    "holes_chopped",
    "largest_piece_mm",
    "stock",
    "errors",
)
# The figures that need a column the machine may not have.
NEEDS = {
    "volume_mm3": "removed_volume",
    "rate_mean": "removed_volume",
    "rate_peak": "removed_volume",
    "rate_target": "rate_target",
    "over_target_share": "rate_target",
}


def find_program(name):
    """-> absolute path; the program is named from where linuxcnc was started."""
    if not name:
        raise session.SessionError(
            "no program; LinuxCNC starts this as its display: set CHIPWISE_PROGRAM and call "
            "linuxcnc configs/mill_headless.ini, or use bin/chipwise demo"
        )
    places = [os.environ.get("OLDPWD") or "", os.environ.get("PWD") or "", os.getcwd(), ROOT]
    for place in places:
        path = os.path.join(place, name)
        if os.path.isfile(path):
            return os.path.abspath(path)
    raise session.SessionError("program %s does not exist" % name)


def run(summary, ini, deadline, folder):
    """Do the run and fill the summary in."""
    program = find_program(os.environ.get("CHIPWISE_PROGRAM"))
    summary["program"] = os.path.basename(program)
    session.wait_for_task(min(deadline, time.monotonic() + session.STEP_TIMEOUT_S))
    machine = session.Session(deadline)
    sampler = sampling.Sampling(os.path.join(folder, "samples"))
    try:
        machine.switch_on()
        machine.home()
        machine.open(program)
        wait_for_monitor(machine, deadline)
        clear_report()
        sampled = sampler.start()
        started, idle_s = time.monotonic(), 0.0
        try:
            idle_s = machine.run_program()
            summary["finished"] = not machine.failure
        finally:
            summary["cycle_s"] = round(time.monotonic() - started - idle_s, 3)
            summary["stock"] = known.SOURCES[machine.guard.value(MONITOR + known.STOCK_SOURCE) or 0]
            sampler.stop()
            if sampled:
                add_figures(summary, sampler, Ini(ini).servo_period_s(), idle_s, machine)
    finally:
        machine.collect_messages()
        summary["errors"] += machine.errors
        if machine.failure and not summary["errors"]:
            summary["errors"].append("chipwise-headless: %s" % machine.failure)


def wait_for_monitor(machine, deadline):
    """Until chipwise-monitor has read the open program: its set-up, or the stock that is assumed for it, counts from
    the first move on.  A machine need not have a monitor."""
    wanted, end = known.checksum(machine.status.file), min(deadline, time.monotonic() + patience(READ_S))
    while machine.guard.value(MONITOR + known.PROGRAM_READ) not in (wanted, None) and time.monotonic() < end:
        machine.poll()
        time.sleep(session.POLL_S)


def add_figures(summary, sampler, period, idle_s, machine):
    """The summary's figures from the log; save the log if CHIPWISE_LOG asks for it."""
    log = runlog.without_tail(sampler.load(), period, idle_s)
    figures = runlog.figures(log, period, machine.status.linear_units or 1.0)
    for key, column in NEEDS.items():
        if column not in sampler.columns:
            figures[key] = None
    figures.update(rates(figures))
    summary.update(figures)
    if os.environ.get("CHIPWISE_LOG"):
        runlog.save(
            os.environ["CHIPWISE_LOG"],
            log,
            period=period,
            units_per_mm=machine.status.linear_units,
            overruns=sampler.overruns,
        )
    lost = runlog.lost_samples(log) + sampler.overruns
    if lost:
        print("chipwise-headless: %d samples lost" % lost, file=sys.stderr)


def rates(figures):
    """Mean and peak as the servo thread has summed them (components/core/run_sums.h), where it has them and something
    was cut."""
    found = {"rate_mean": getp("volumetric-feed.0.mean-rate"), "rate_peak": getp("volumetric-feed.0.peak-rate")}
    return {
        key: round(float(text), 3)
        for key, text in found.items()
        if text and float(text) > 0 and figures[key] is not None
    }


def clear_report():
    """Forget what an earlier run in this HOME reported."""
    if os.path.exists(report.path()):
        os.unlink(report.path())


def add_holes(summary):
    """What the cycles reported: holes chopped and the largest loose piece."""
    done = report.read(report.path())
    holes = [line for line in done if line["kind"] == "hole"]
    pieces = [line["largest_piece_mm"] for line in done if line.get("largest_piece_mm") is not None]
    summary["holes_chopped"] = sum(1 for line in holes if line.get("chopped"))
    summary["largest_piece_mm"] = round(max(pieces), 3) if pieces else 0.0


def print_summary(summary):
    line = json.dumps(summary)
    print(line, flush=True)
    if os.environ.get("CHIPWISE_SUMMARY"):
        with open(os.environ["CHIPWISE_SUMMARY"], "w") as handle:
            handle.write(line + "\n")


def out_of_time(_number, _frame):
    raise session.SessionError("time is over")


def time_limit():
    """-> CHIPWISE_TIMEOUT in s, and what is wrong with it ('' where nothing is)."""
    text = os.environ.get("CHIPWISE_TIMEOUT") or str(DEFAULT_TIMEOUT_S)
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if 0.0 < seconds < 1e9:
        return seconds, ""
    return DEFAULT_TIMEOUT_S, "CHIPWISE_TIMEOUT is %s; it has to be a number of seconds above 0" % text


def build_parser():
    parser = argparse.ArgumentParser(
        prog="chipwise-headless",
        description=__doc__,
        allow_abbrev=False,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version="chipwise " + version())
    parser.add_argument("-ini", metavar="FILE", help="the machine (default: INI_FILE_NAME)")
    return parser


def main(arguments):
    options, _others = build_parser().parse_known_args(arguments)  # of LinuxCNC's own
    ini = options.ini or os.environ.get("INI_FILE_NAME", "")
    timeout, wrong = time_limit()
    signal.signal(signal.SIGALRM, out_of_time)
    signal.setitimer(signal.ITIMER_REAL, timeout + session.STEP_TIMEOUT_S)
    summary = dict.fromkeys(KEYS)
    summary.update(finished=False, errors=[], program=os.path.basename(os.environ.get("CHIPWISE_PROGRAM", "")))
    with tempfile.TemporaryDirectory(prefix="chipwise-headless.") as folder:
        try:
            if wrong:
                raise session.SessionError(wrong)
            run(summary, ini, time.monotonic() + timeout, folder)
        except (session.SessionError, CycleError) as error:
            summary["errors"].append("chipwise-headless: " + unnamed(error))
    add_holes(summary)
    print_summary(summary)
    return 0 if summary["finished"] and not summary["errors"] else 1
