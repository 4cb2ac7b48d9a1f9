# SPDX-License-Identifier: GPL-2.0-or-later
"""Parts that are stopped at any stage and finished by a second plan: gouge, rapids in stock and feed by the oracle;
which file is used."""

import json
import os
import random
from dataclasses import replace

import pytest

from chipwise.errors import CycleError
from chipwise.ini import Ini
from chipwise.settings import load_settings
from chipwise.turning import resume, stock_file
from chipwise.turning import nc
from chipwise.turning.plan import make_plan, total_length
from chipwise.turning.read_part import Machine, job_of, make_order
from chipwise.turning.request import read_request
from support.lathe_preview import machine, preview
from support.random_cases import random_count, random_seed, write_replay
from support.turning_oracle import judge
from support.turning_random import random_case
from support.turning_rest import feed_left, finished, stop, stopped
from support.turning_rig import planned

ZERO = (-120.0, 0.0)


def said(choice):
    return [note.text() for note in choice.notes]


@pytest.mark.parametrize("k", range(random_count(8)))
def test_a_stopped_part_is_finished_without_gouge_or_collision(k, tmp_path):
    seed = random_seed() * 100_019 + k
    rng = random.Random(seed)
    case = random_case(rng)
    replay = write_replay(f"turning_rest_{seed}", {"seed": seed, "text": case.text})
    plan, request, machine, text = planned(case, tmp_path)
    stage, number, count = stop(rng, plan)
    second = finished(plan, stage)
    found, _, _ = judge(
        stopped(text, number, count) + nc.program(second, request, "rest"), request.scale, case, machine.tools
    )
    wrong = f"seed {seed}, step {number}, {count} moves, {replay}: {found}"
    assert found["gouge"] <= 0.001 and found["rapid"] <= 0.002 and found["holder"] <= 0.001, wrong
    assert sum(r.area for r in second.residue) <= sum(r.area for r in plan.residue) + 0.01, wrong
    replay.unlink()


def test_what_is_done_is_not_cut_again(tmp_path):
    """Feed of the second plan against the feed that the first one had left, over several parts."""
    left, again, whole = 0.0, 0.0, 0.0
    for k in range(24):
        rng = random.Random(f"rest {k}")
        plan, *_ = planned(random_case(rng), tmp_path)
        stage, number, count = stop(rng, plan)
        left += feed_left(plan, number, count)
        again, whole = again + total_length(finished(plan, stage).steps), whole + total_length(plan.steps)
    print(f"feed of the second plans: {again / left:.3f} of what was left, {again / whole:.2f} of the whole")
    assert again <= 1.05 * left


def test_the_oracle_sees_stock_that_is_not_gone(tmp_path):
    """A file that says more than has been cut."""
    case = random_case(random.Random(3), "D55", 0.0)
    plan, request, machine, text = planned(case, tmp_path)
    found = resume.stages(plan)
    number, marks = next((n, m) for n, m in found.marks.items() if len(m) > 6)
    program = nc.program(finished(plan, found.stages[marks[-2][1]]), request, "rest")
    assert judge(stopped(text, number, marks[1][0]) + program, request.scale, case, machine.tools)[0]["rapid"] > 0.1


@pytest.fixture
def part(tmp_path):
    """(plan, key, path of a file that says that the machine has come to its fourth stage, Record)."""
    plan, *_ = planned(random_case(random.Random(5)), tmp_path)
    key, path = stock_file.key_of(plan.order, "/nc/part.ngc", ZERO), str(tmp_path / "turning.jsonl")
    record = stock_file.write(path, key, resume.stages(plan).stages)
    stock_file.note(record, 3)
    return plan, key, path, record


def test_a_file_has_what_was_written(part):
    plan, key, path, _record = part
    found, wanted = stock_file.read(path), resume.stages(plan).stages[3]
    assert found.key == key and found.begun and not found.asked and found.stage.step == wanted.step
    assert [p[:7] for p in found.stage.outside] == [p[:7] for p in wanted.outside] and [
        p[:7] for p in found.stage.bore
    ] == [p[:7] for p in wanted.bore]
    choice = resume.choose(plan.order, path, key)
    assert choice.stage == found.stage and said(choice) == [
        f"chipwise: planned from what the step {wanted.step} has left"
    ]
    assert f"in the step {wanted.step} goes on" in resume.question(choice.stage, choice.changed).text()


def test_threads_that_are_cut_are_known(tmp_path):
    """They leave no trace in r(z)."""
    from chipwise.turning.thread_comment import Thread

    plan, *_ = planned(random_case(random.Random(5)), tmp_path)
    thread = Thread(-20.0, -5.0, 10.0, 1.5, 0.92, True, False, 800, False, 12)
    record = stock_file.write(
        str(tmp_path / "t"),
        stock_file.key_of(plan.order, "a", ZERO),
        [resume.stages(plan).stages[0]._replace(step="thread outside", threads=(thread,))],
    )
    found = stock_file.read(record.path)
    assert found.begun and found.stage.threads == (replace(thread, line=0),)


def test_lines_that_were_lost_or_torn_leave_more_stock(part):
    plan, key, path, record = part
    with open(path, "ab") as file:
        file.write(
            b'{"token": "another", "done": 5}\n{"done": 5}\n[1]\nnull\n\xc3\xa9{\n{"token": "%s", "done": 99}\n'
            b'{"token": "%s", "done": 5' % ((record.token.encode(),) * 2)
        )
    assert stock_file.read(path).stage == resume.choose(plan.order, path, key).stage
    assert stock_file.read(path).stage.outside == [p._replace(line=0) for p in resume.stages(plan).stages[3].outside]
    stock_file.note(record, 4)  # it is joined to the torn line, and lost
    assert stock_file.read(path).stage.outside == [p._replace(line=0) for p in resume.stages(plan).stages[3].outside]
    stock_file.note(record, 5)
    assert stock_file.read(path).stage.outside == [p._replace(line=0) for p in resume.stages(plan).stages[5].outside]


def test_nothing_cut_is_a_whole_blank(part):
    plan, key, path, _record = part
    stock_file.write(path, key, resume.stages(plan).stages)
    assert resume.choose(plan.order, path, key).stage is None and resume.choose(plan.order, path, key).notes == ()
    assert (
        resume.choose(plan.order, path + ".other", key).stage is None and resume.choose(plan.order, "", key).notes == ()
    )


def test_in_doubt_the_whole_blank_is_planned(part):
    """Another program, part, blank or work offset; a question without an answer.  The reason is said."""
    plan, key, path, record = part
    for changed, words in (
        (dict(program="/nc/other.ngc"), "it is of another program, part.ngc"),
        (dict(part="0"), "the part is drawn in another way"),
        (dict(blank="0"), "the blank is another one"),
        (dict(zero=(-120.002, 0.0)), "the work offset has changed"),
    ):
        choice = resume.choose(plan.order, path, key._replace(**changed))
        assert (
            choice.stage is None and words in said(choice)[0] and said(choice)[0].endswith("the whole blank is planned")
        ), said(choice)
        assert total_length(choice.plan.steps) == total_length(plan.steps)
    stock_file.note(record, stock_file.ASKED)
    choice = resume.choose(plan.order, path, key)
    assert choice.stage is None and "nobody has confirmed" in said(choice)[0]
    stock_file.note(record, stock_file.CONFIRMED)
    assert resume.choose(plan.order, path, key).stage is not None
    stock_file.end(record)
    stock_file.end(record)
    assert resume.choose(plan.order, path, key).stage is None


def test_what_another_blank_or_part_is(tmp_path):
    """Every number of the drawing and of the WORKPIECE line counts, the line that it is on does not."""
    case = random_case(random.Random(8))
    plan, *_ = planned(case, tmp_path)
    key = stock_file.key_of(plan.order, "a", ZERO)
    moved = [p._replace(line=p.line + 7) for p in plan.order.part.outside]
    assert stock_file.key_of(replace(plan.order, part=replace(plan.order.part, outside=moved)), "a", ZERO) == key
    wider = [p._replace(xr=p.xr + 1e-9) for p in plan.order.blank.outside]
    assert (
        stock_file.key_of(replace(plan.order, blank=replace(plan.order.blank, outside=wider)), "a", ZERO).blank
        != key.blank
    )
    thinner = [p._replace(xr=p.xr - 1e-9) for p in plan.order.part.outside]
    assert (
        stock_file.key_of(replace(plan.order, part=replace(plan.order.part, outside=thinner)), "a", ZERO).part
        != key.part
    )


def test_a_finished_part_is_not_nothing_to_do(part):
    """The end of the file was lost when LinuxCNC was killed: the next blank is not left as it is."""
    plan, key, path, record = part
    stock_file.note(record, len(resume.stages(plan).stages) - 1)
    choice = resume.choose(plan.order, path, key)
    assert choice.stage is None and "is finished" in said(choice)[0] and any(s.needed for s in choice.plan.steps)


def test_what_cannot_be_planned_from_is_left_alone(part):
    """A stage that the blank's check refuses: smaller than the part."""
    plan, key, path, _record = part
    stages = resume.stages(plan).stages
    thin = [p._replace(xr=p.xr - 5.0) for p in stages[3].outside]
    stock_file.note(stock_file.write(path, key, [stages[0], stages[3]._replace(outside=thin)]), 1)
    choice = resume.choose(plan.order, path, key)
    assert choice.stage is None and "cannot be planned: the blank is smaller than the part" in said(choice)[0]
    with pytest.raises(CycleError, match="no stock is left"):
        resume.blank_of(stages[3]._replace(outside=[p._replace(xr=-1.0, slope=0.0, r=0.0) for p in stages[3].outside]))


def damaged(text):
    head, *lines = text.split("\n")
    yield text.replace('"slope"', "").replace("0.0, 0.0, 0]", "0.0, 0.1, 0]", 1)
    yield "\n".join([head, *lines[1:]])
    yield "\n".join([json.dumps({**json.loads(head), "stages": 10**9}), *lines])
    yield "\n".join([json.dumps({**json.loads(head), "stages": 0}), *lines])
    yield "\n".join([json.dumps({**json.loads(head), "chipwise turning stock": 2}), *lines])
    yield from ("", "\n", "{}", "[]\n", "null\n", "[" * 100_000, "\0" * 100, text[:200])


def test_a_file_that_cannot_be_used_is_named(part, tmp_path):
    plan, key, path, _record = part
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for k, wrong in enumerate(damaged(text)):
        with open(path, "w", encoding="utf-8") as file:
            file.write(wrong)
        choice = resume.choose(plan.order, path, key)
        assert choice.stage is None and said(choice)[0].startswith(
            "chipwise: turning.jsonl: it is not what chipwise has written; remove the file; "
        ), (k, said(choice))
    with open(path, "wb") as file:
        file.write(b"\xff\xfe\x00")
    assert "it is not UTF-8" in said(resume.choose(plan.order, path, key))[0]
    os.unlink(path)
    os.mkfifo(path)
    assert "it is not a regular file" in said(resume.choose(plan.order, path, key))[0]
    os.truncate(tmp_path / "part.ngc", stock_file.MAX_BYTES + 1)
    assert f"more than {stock_file.MAX_BYTES}" in said(resume.choose(plan.order, str(tmp_path / "part.ngc"), key))[0]


def test_a_long_profile_makes_no_long_file(part):
    """More cuts than a file holds: every second or third of them is kept, and the end of each step."""
    plan, *_ = part
    many = [
        replace(s, cuts=[(k + 1, s.after[False] * 30) for k in range(200)]) if s.name == "rough outside" else s
        for s in plan.steps
    ]
    found = resume.stages(replace(plan, steps=tuple(many)))
    pieces = sum(len(s.outside) for s in found.stages)
    assert pieces < 1.2 * resume.MOST_PIECES + 20 * len(found.stages)
    assert [m[-1][0] for m in found.marks.values()] == [len(s.moves) for s in plan.steps if s.needed]


PROGRAM = """(WORKPIECE,CYLINDER,AXIS=Z,DIAMETER=30,ZMIN=-60,ZMAX=1)
(LATHE,ROUGH=1,FINISH=2)
G21 G18 G8 G94 G97 S500 M3
G0 X60 Z40
(begin)
G26 Q100 I0.3 D1 F100 E50
(end)
M2
O100 sub
G0 X8 Z0
G1 Z-20
G1 X12
G1 Z-30
O100 endsub
"""


def test_the_preview_shows_what_a_run_would_do_and_writes_nothing(tmp_path):
    """G26 plans what is left, H1 too; G27 and a machine without TURNING_STOCK plan the whole blank."""
    ini = machine(tmp_path)
    (tmp_path / "program.ngc").write_text(PROGRAM)
    request, lathe = read_request(PROGRAM), Machine(Ini(str(ini)), load_settings(str(ini)), str(ini))
    order = make_order(job_of(str(tmp_path / "program.ngc"), request, lathe), PROGRAM, request, lathe)
    stages = resume.stages(make_plan(order)).stages
    stock_file.note(
        stock_file.write(
            str(tmp_path / "turning.stock"), stock_file.key_of(order, str(tmp_path / "program.ngc"), (0.0, 0.0)), stages
        ),
        4,
    )
    content = (tmp_path / "turning.stock").read_bytes()

    def feeds(text):
        seen = preview(tmp_path, ini, text)
        assert not seen.error, seen.error
        return [m for m in seen.between("begin", "end") if m[0] != "rapid"], seen.messages

    (left, said), (shown, whole_plan) = feeds(PROGRAM), feeds(PROGRAM.replace("G26 Q100", "G26 Q100 H1"))
    assert (
        said[0] == "chipwise: G26: planned from what the step rough outside has left (line 6)"
        and whole_plan[0] == said[0]
        and shown == []
    )
    assert feeds(PROGRAM.replace("G26 Q100", "G27 Q100 L3"))[1][0].startswith(
        "chipwise: G27: step 3, rough outside: T1"
    )
    moved, words = feeds(PROGRAM.replace("G0 X60", "G10 L2 P1 Z-1\nG0 X60"))
    assert "the work offset has changed" in words[0]
    ini.write_text(ini.read_text().replace("[CHIPWISE]\n", "[CHIPWISE]\nTURNING_STOCK =\n"))
    whole, words = feeds(PROGRAM)
    assert len(words) == 1 and len(left) < len(whole) == len(moved)
    assert (tmp_path / "turning.stock").read_bytes() == content
