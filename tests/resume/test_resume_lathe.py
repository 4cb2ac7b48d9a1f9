# SPDX-License-Identifier: GPL-2.0-or-later
"""`chipwise resume` on a lathe says what G26 will do, which goes on by itself."""

import shutil

import pytest

from chipwise.ini import Ini
from chipwise.settings import load_settings
from chipwise.turning import resume as rest, stock_file
from chipwise.turning.plan import make_plan
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_program, read_request
from support import ROOT, forked

STEP = 2  # stages that are done


@pytest.fixture(name="lathe")
def make_lathe(tmp_path):
    """(program, INI file, kept.Record, plan) of a part that was stopped."""
    for name in ("lathe.ini", "lathe.tbl", "lathe_tools.toml", "chipwise_codes.inc", "tools.toml"):
        if (ROOT / "configs" / name).exists():
            shutil.copy(ROOT / "configs" / name, tmp_path / name)
    ini, program = tmp_path / "lathe.ini", tmp_path / "shaft.ngc"
    text = (
        ini.read_text()
        .replace("PATH_PREPEND = remap", f"PATH_PREPEND = {ROOT}/remap")
        .replace("TOPLEVEL = remap", f"TOPLEVEL = {ROOT}/remap")
    )
    ini.write_text(text)
    shutil.copy(ROOT / "nc_files" / "turning_shaft.ngc", program)
    settings = load_settings(str(ini))
    machine, words = Machine(Ini(str(ini)), settings, str(ini)), read_program(str(program))
    request = read_request(words, machine.startup)
    order = make_order(job_of(str(program), request, machine), words, request, machine, machine.steps)
    plan = make_plan(order)
    record = stock_file.write(
        settings.path("TURNING_STOCK"), stock_file.key_of(order, str(program), (-100.0, 0.0)), rest.stages(plan).stages
    )
    return program, ini, record, plan


def resume(program, ini, *options):
    done = forked.run([forked.CHIPWISE, "resume", program, "--ini", ini, *options], timeout=300)
    assert "Traceback" not in done.stderr and "internal error" not in done.stderr
    return done.returncode, done.stdout, done.stderr


def test_a_part_that_was_stopped(lathe):
    program, ini, record, plan = lathe
    before = sorted(path.name for path in program.parent.iterdir())
    status, said, errors = resume(program, ini, "--plan")
    assert status == 2 and "no part is kept that was stopped" in errors and not said
    stock_file.note(record, STEP)
    stage = rest.stages(plan).stages[STEP].step
    status, said, errors = resume(program, ini, "--plan")
    assert status == 0 and not errors, errors
    assert f"in the step {stage}." in said and "Start shaft.ngc again" in said and "no other program is needed" in said
    assert f"{len(plan.steps)} {plan.steps[-1].name}" in said, "what is left"
    status, said, errors = resume(program, ini, "-o", str(program.parent / "out.ngc"))
    assert status == 2 and "start this one again" in errors
    status, said, errors = resume(program, ini, "--plan", "--line", "8")
    assert status == 2 and "are for mills" in errors
    assert sorted(path.name for path in program.parent.iterdir()) == before
    stock_file.note(record, stock_file.ASKED)
    status, said, errors = resume(program, ini, "--plan")
    assert status == 2 and "nobody has confirmed" in errors
