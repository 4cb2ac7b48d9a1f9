# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks and rewrites one program for the GUI -> its Verdict.  Called by process.py, in a process of its own.

1. A file that LinuxCNC cannot use (binary, too large, an error in a line, an endless loop) is not opened.
   So is one that makes the interpreter run Python or a shell: the GUI's preview would do it (program/program_code.py).
2. A program that cannot be judged (an unknown tool, M254, ..) is opened as it is, if it has an end: LinuxCNC's preview
   runs it, too, and a GUI whose preview does not end cannot be used any more.
3. A program with findings is opened with a warning; [CHIPWISE]FILTER_REFUSE is stricter.  That a tool's flutes are
   unknown is said, but never a reason to refuse.
4. A program that names no stock or no tool is judged on what chipwise check assumes, and that is said.  It counts as
   one that cannot be judged for FILTER_REFUSE = unchecked, which asks for certainty, and findings in what is assumed
   refuse nothing.
5. [CHIPWISE]FILTER_REWRITE: the rewritten program goes to the GUI.  One that cannot be rewritten counts as one with
   findings.
"""

import os
from dataclasses import dataclass

from chipwise.check.findings import FLUTE, FLUTES_UNKNOWN, OF_STOCK, RATE, TOOL, grouped, grouped_notes
from chipwise.program import program_code
from chipwise.program.program_file import UNFINISHED, UNSAFE, UNUSABLE, Unreadable
from chipwise.program.reader import Machine, Reader
from chipwise.check.run import checked, lines_of
from chipwise.errors import CycleError, unnamed, with_line
from chipwise.filter import verdict as verdicts
from chipwise.host.temp_folder import FolderError, put
from chipwise.rates import MM3_PER_CM3
from chipwise.settings import Settings, load_settings

MAX_LISTED = 20  # findings in the log
MAX_NAMED = 5  # tools in a message
NOT_KNOWN = (TOOL, FLUTES_UNKNOWN)
ASSUMED = " (on what is assumed)"


def judged(program, ini, limits, folder, loops, progress):
    """Verdict of a program.

    limits: those of Reader; folder: for a rewritten one; loops: it may have some; progress(share): called.
    """
    try:
        settings = load_settings(ini)
    except CycleError as error:
        return _unchecked(unnamed(error.text()), program, None, loops, "unusable", limits)
    refuse = settings["FILTER_REFUSE"]
    try:
        machine = Machine(ini)
    except Unreadable as error:
        return _unchecked(str(error), program, None, loops, refuse, limits)
    rewrite = settings["FILTER_REWRITE"] != "no"
    lines = lines_of(program)

    more = {name: value for name, value in limits.items() if name != "cpu_s"}

    def check_it(**assumed):
        return checked(
            program,
            lambda line: progress(line / lines * (0.4 if rewrite else 1.0)),
            {"machine": machine, "cpu_s": limits["cpu_s"], "limits": more, **assumed},
        )

    result = check_it()
    if result.error and result.state != UNFINISHED:
        machine.tool = (
            spindle_tool() if os.environ.get("INI_FILE_NAME") else 0
        )  # the program may count on it, as LinuxCNC's preview does
        result = check_it(assumes=True, tool=machine.tool or None)
    if result.error:
        return _with_error(result, machine, loops, refuse, limits)
    verdict = verdicts.Verdict()
    if result.guessed and refuse in verdicts.UNCHECKED_IS_REFUSED:
        return verdicts.not_opened(
            "; ".join(["it is judged on what is assumed only", *(text for _line, text in result.notes)])
        )
    for text in grouped_notes(result.notes):
        verdict.note(verdicts.for_screen(text))
    mended = None
    if rewrite:
        rewriting = _Rewriting(machine, settings, limits, folder)
        mended = rewriting.run(result, lambda share: progress(0.4 + 0.6 * share), verdict)
    return _with_findings(result, mended, refuse, verdict)


def spindle_tool():
    """Number of the tool that LinuxCNC has in the spindle; 0: none, or no LinuxCNC."""
    try:
        import linuxcnc

        status = linuxcnc.stat()
        status.poll()
        return status.tool_in_spindle
    except (ImportError, RuntimeError, SystemError):  # linuxcnc.error is a RuntimeError
        return 0


def _with_error(result, machine, loops, refuse, limits):
    text = with_line(*result.error)
    if result.state in (UNUSABLE, UNSAFE):
        return verdicts.not_opened(text)
    if result.state == UNFINISHED:
        return verdicts.unfinished(text, loops, refuse)
    return _unchecked(text, result.program, machine, loops, refuse, limits)


def _unchecked(text, program, machine, loops, refuse, limits):
    """A program that cannot be judged; one with loops is read to its end."""
    if machine is None and (code := program_code.first_code([program], program_code.Places(()))):
        text, line = code.sentence(program)
        return verdicts.not_opened(with_line(f"{text}; {code.remedy}", line))
    if loops and machine is None:
        return verdicts.unfinished(text, loops, refuse)
    if loops:
        try:
            with Reader(program, machine, judged=False, **limits) as reader:
                for _block in reader:
                    pass
        except Unreadable as error:
            if error.state in (UNUSABLE, UNFINISHED, UNSAFE):
                return verdicts.not_opened(with_line(str(error), error.line))
    return verdicts.unchecked(text, refuse)


def _with_findings(result, mended, refuse, verdict):
    """The verdict on a program that was checked; mended: the rule that the rewriting has seen to."""
    unknown = sorted({finding.tool for finding in result.findings.kept if finding.rule in NOT_KNOWN})
    left = [finding for finding in result.findings.kept if finding.rule != mended and finding.rule not in NOT_KNOWN]
    count = len(left) + result.findings.dropped
    if left:
        first = left[0].text(result.unit)
        assumed = result.guessed and all(finding.rule in OF_STOCK for finding in left)
        verdict.note(
            (first if count == 1 else f"{count} findings; the first: {first}") + (ASSUMED if assumed else ""),
            not assumed,
        )
        groups = grouped(left)
        verdict.more = [group.text(result.unit) for group in groups[int(len(groups[0]) == 1) : MAX_LISTED]]
        more = result.findings.dropped + sum(map(len, groups[MAX_LISTED:]))
        if more:
            verdict.more.append(f"and {more} more; `chipwise check` has all")
    if unknown:
        names = ", ".join([*map(str, unknown[:MAX_NAMED]), *([".."] if len(unknown) > MAX_NAMED else [])])
        verdict.note(
            f"the depth of tool {names} is not checked, the length of the flutes is unknown; give it in "
            "[CHIPWISE]TOOL_GEOMETRY"
        )
    if verdict.warns and refuse in verdicts.FINDINGS_ARE_REFUSED:
        verdict.status, verdict.path = verdicts.FINDINGS, ""
    return verdict


# ---- rewriting -------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Rewriting:
    """On a machine, as the settings say; limits: those of Reader; folder: for the new program."""

    machine: Machine
    settings: Settings
    limits: dict
    folder: str

    def run(self, result, progress, verdict):
        """Rewrite the program of a result, with a note; -> the rule that the new one does not break any more, or
        None."""
        from chipwise.rewrite.read_back import Different
        from chipwise.rewrite.run import rewritten

        flute = self.settings["FILTER_REWRITE"] == "flute"
        if flute and not any(finding.rule == FLUTE for finding in result.findings.kept) and not result.findings.dropped:
            return None
        try:
            data, said = rewritten(result.program, self._order(flute), progress, self.machine, **self.limits)
            with open(result.program, "rb") as file:
                if file.read() == data:
                    return FLUTE if flute else RATE
            path = put(self.folder, "rewritten.ngc", data)
        except Unreadable as error:
            verdict.note(f"it is not rewritten: {verdicts.for_screen(with_line(str(error), error.line))}", True)
        except Different as error:
            verdict.note(f"it is not rewritten: {error}; please report it with the program", True)
        except MemoryError:
            verdict.note("it is not rewritten: it needs more memory than there is; raise [CHIPWISE]PLAN_MEMORY", True)
        except FolderError as error:
            verdict.note(f"it is not rewritten: {unnamed(error)}", True)
        except OSError as error:
            verdict.note(f"it is not rewritten: {error.strerror}", True)
        else:
            verdict.path = path
            verdict.note(f"it is rewritten: {verdicts.for_screen(said)}")
            return FLUTE if flute else RATE
        return None

    def _order(self, flute):
        from chipwise.rewrite import feed
        from chipwise.rewrite.run import Order

        tool = self.machine.tool or None
        if flute:
            return Order(tool=tool)
        if not self.settings["FILTER_RATE"]:
            raise Unreadable("[CHIPWISE]FILTER_RATE is 0", "give a removal rate in cm3/min")
        rates = feed.Rates(self.settings["FILTER_RATE"] * MM3_PER_CM3, ceiling=self.settings["FILTER_CEILING"] or None)
        return Order(rates, tool=tool)
