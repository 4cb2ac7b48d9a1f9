# SPDX-License-Identifier: GPL-2.0-or-later
"""The guards on a running LinuxCNC: they stop what they must, in time, and nothing else."""

import os
import re

import random

import numpy as np
import pytest

from chipwise.headless import runner
from support.random_cases import random_count, random_seed, write_replay
from support.demo_runs import DEMOS, GROUP, demo_run
from support.operate import Shared, operate
from support.headless_rig import WITH_LOG

pytestmark = pytest.mark.machine

SPEED = 10
STOPPED = Shared('guards that stop')
QUIET = {machine: Shared('quiet guards, ' + machine, ini=machine + '.ini', edit=WITH_LOG, speed=SPEED) for machine in ('mill', 'mill_inch')}
HEAD = 'G21 G90 G17 G40 G64 P0.01\nT1 M6\nM250 P0 Q0 R-10 I60 J40 K10\nM3 S10000\nF1200\n'
GUARD = ['pins', 'chipwise-guard.0.stop', 'chipwise-guard.0.reason', 'motion.feed-inhibit', 'motion.feed-hold']


def log_of(path):
    with np.load(path) as stored:
        return {name: stored[name] for name in stored.files}


def crash(approach, target):
    """Steps: run into the stock as a program, then go on."""
    return [['open text', HEAD + approach + target + '\nG0 Z10\nM2\n'], ['run_until_stopped', 60], GUARD, ['position'], ['abort'],
            ['errors'], GUARD, ['jog', 2, 15, 20], ['position'], ['mdi', 'G0 X-30 Y20'], ['position'],
            ['pins', 'stock-tracker.0.removed-volume']]


@pytest.mark.parametrize('approach, target, axis, edge, sign', [
    ('G0 X-40 Y20\nG0 Z-5\n', 'G0 X30', 0, -3.0, 1),
    ('G0 X-40 Y-40\nG0 Z-5\n', 'G0 X30 Y30', 0, -3.0, 1),
    ('G0 X20 Y20 Z60\n', 'G0 Z-2', 2, 0.0, -1),
])
@pytest.mark.scene(STOPPED, lambda approach, target, **_rest: crash(approach, target))
def test_a_traverse_stops_before_the_stock(answers, approach, target, axis, edge, sign):
    """Position, message, and the machine is usable afterwards; not a cell was cut."""
    _open, stopped, guard, position, _abort, said, after, jogged, _up, moved, away, removed = answers
    print('stopped', position, 'left', sign * (edge - position[axis]))
    assert stopped is True
    assert guard[:2] == ['TRUE', '1'] and guard[2:] == ['TRUE', 'TRUE']
    left = sign * (edge - position[axis])
    assert 0.0 < left < 25.0
    line = HEAD.count('\n') + approach.count('\n') + 1
    assert len(said) == 1, said
    assert re.match(rf'chipwise: rapid stopped [\d.]+ mm before stock \(line {line}, tool 1, 6.00 mm\); press Stop, jog away', said[0])
    assert after == ['FALSE', '0', 'FALSE', 'FALSE']
    assert jogged == [1.0] and moved == []
    assert away[:2] == pytest.approx([-30, 20], abs=1e-5)
    assert float(removed[0]) == 0.0


GAP = ''.join(f'G0 Z5\nG0 X{x} Y50\nG0 Z-5\nG1 X{x} Y-10\n' for x in (26, 30, 34))     # 14 mm free in the middle, up to X 37


def test_let_go_on_it_passes_the_place_and_stops_at_the_next(tmp_path):
    """A traverse through two ribs.  Released before the first it goes through that in one go; the second one stops it again."""
    program = tmp_path / 'ribs.ngc'
    program.write_text(HEAD + GAP + 'G0 Z5\nG0 X-40 Y20\nG0 Z-5\nG0 X100\nG0 Z10\nM2\n')
    release = ['hal', 'setp', 'chipwise-guard.0.release']
    answers = operate(tmp_path, [
        ['open', str(program)], ['run_until_stopped', 60], ['position'], [*release, '1'], ['sleep', 0.3], [*release, '0'],
        ['until', 'chipwise-guard.0.stop', '>', 0.5], ['sleep', 2.0], ['position'], [*release, '1'], ['sleep', 0.3],
        [*release, '0'], ['finish'], ['position']], edit='s/^MAX_LINEAR_VELOCITY = .*/MAX_LINEAR_VELOCITY = 20/')
    stopped, first, second, last = answers[1], answers[2], answers[8], answers[-1]
    print('stopped', first[0], 'then', second[0])
    assert stopped is True and -30.0 < first[0] < -3.0             # at 20 mm/s the gap is longer than the braking
    assert 20.0 < second[0] < 60.0                      # past the first rib, which ends at X 23
    assert last[0] == pytest.approx(100.0, abs=1e-4)


# (approach, target): traverses that go over into the one that meets stock, and how LinuxCNC joins them
BLENDS = {
    'down beside it, then in: parabola': ('G64\nG0 X-23 Y20\nG0 Z60\nG0 Z-5\n', 'G0 X30'),
    'further away': ('G64\nG0 X-40 Y20\nG0 Z60\nG0 Z-5\n', 'G0 X30'),
    'along, then in: arc': ('G64\nG0 X-25 Y-40 Z10\nG0 Z-5\nG4 P0.1\nG0 Y20\n', 'G0 X30'),
    'the same near': ('G64 P5\nG0 X-12 Y-40 Z10\nG0 Z-5\nG4 P0.1\nG0 Y20\n', 'G0 X30'),
    'over it, then down': ('G64\nG0 X-40 Y20 Z5\nG4 P0.1\nG0 X30\n', 'G0 Z-5'),
    'a shallow corner': ('G64 P1\nG0 X-30 Y-40 Z10\nG0 Z-5\nG4 P0.1\nG0 X-12 Y10\n', 'G0 X30 Y40'),
    'a feed before it: LinuxCNC stops': ('G64\nF6000\nG0 X-25 Y-40 Z10\nG0 Z-5\nG4 P0.1\nG1 Y20\n', 'G0 X30'),
}


def blended(what):
    """Steps: a program of BLENDS, with a guard."""
    approach, target = BLENDS[what]
    return [['open text', HEAD + approach + target + '\nG0 Z10\nM2\n'], ['run_until_stopped', 60],
            ['pins', 'stock-tracker.0.removed-volume'], ['errors']]


def removed_before_the_stop(answers):
    """mm3 that traverses have removed before the guard stopped them, with its message."""
    _open, stopped, removed, said = answers
    assert stopped is True and len(said) == 1 and 'rapid stopped ' in said[0] and 'tool 1, 6.00 mm)' in said[0], said
    return float(removed[0])


@pytest.mark.parametrize('what', BLENDS, ids=[name.replace(' ', '_') for name in BLENDS])
@pytest.mark.scene(STOPPED, blended)
def test_a_blended_traverse_stops_before_the_stock(answers, what):
    assert removed_before_the_stop(answers) == 0.0


def test_a_blend_that_is_not_known_is_stopped_late(tmp_path):
    """Without the planner's path the line is judged only when the blend is over (docs/design/hal.md): the check above sees that."""
    answers = operate(tmp_path, blended('down beside it, then in: parabola'), edit='s#^GUARD_RAPID#READ_PATH = no\\n&#')
    assert removed_before_the_stop(answers) > 100.0


def test_the_inch_machine_is_stopped(tmp_path):
    """A program in inch: a traverse into the side, then a cut deeper than the flutes; messages in inch, no cell cut by either
    the traverse or the shank."""
    crash, deep = tmp_path / 'crash.ngc', tmp_path / 'deep.ngc'
    head = 'G20 G90 G17 G40 G64 P0.0004\nT1 M6\nM250 P0 Q0 R-0.4 I2.4 J1.6 K0.4\nM3 S10000\nF50\n'
    crash.write_text(head + 'G0 X-1.6 Y0.8\nG0 Z-0.2\nG0 X1.2\nG0 Z0.4\nM2\n')
    deep.write_text(head + 'G0 Z0.2\nG0 X-0.4 Y0.4\nG0 Z-0.1\nG1 X2.8\nG0 Z0.2\nG0 X-0.4 Y1.2\nG0 Z-0.16\nG1 X2.8\nM2\n')
    geometry = tmp_path / 'tools.toml'
    geometry.write_text('[tool.1]\nshape = "flat"\nflute_length = 3\n')
    removed = ['pins', 'stock-tracker.0.removed-volume']
    answers = operate(tmp_path, [
        ['open', str(crash)], ['run_until_stopped', 20], GUARD, ['position'], ['abort'], ['errors'], removed,
        ['jog', 2, 0.6, 0.8], ['open', str(deep)], ['run_until_stopped', 40], GUARD, ['position'], ['abort'], ['errors'], removed],
        ini='mill_inch.ini', edit=f's#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {geometry}#')
    radius = 3 / 25.4
    _open, stopped, guard, position, _abort, said, cut, _jog = answers[:8]
    assert stopped is True and guard == ['TRUE', '1', 'TRUE', 'TRUE']
    assert 0.0 < -radius - position[0] < 25.0 / 25.4
    assert len(said) == 1 and re.match(r'chipwise: rapid stopped 0\.\d{4} in before stock \(line 8, tool 1, 0.2362 in\)', said[0]), said
    assert float(cut[0]) == 0.0
    _open, stopped, guard, position, _abort, said, cut = answers[8:]
    assert stopped is True and guard == ['TRUE', '2', 'TRUE', 'TRUE']
    assert -radius <= position[0] < -1.0 / 25.4 and position[1] == pytest.approx(1.2, abs=1e-5)
    assert len(said) == 1 and re.search(r'cut stopped at 0\.1600 in or more of depth, flutes 0\.1181 in long', said[0]), said
    assert float(cut[0]) == pytest.approx(2.4 * 25.4 * 6 * 2.54, rel=0.02)


TWICE = [['run_until_stopped', 60], ['position'], ['abort'], ['errors']]


@pytest.mark.scene(STOPPED, [
    ['open text', HEAD + 'G0 X-40 Y20\nG0 Z-5\nG0 X30\nM2\n'], *TWICE, ['mdi', 'G0 Z10'], *TWICE, ['mdi', 'G0 Z10'],
    ['open text', HEAD + 'G0 Z5\nG0 X-40 Y20\nG0 Z-5\nG1 X30\nG0 Z5\nM2\n'], ['run_until_stopped', 60], ['errors']])
def test_the_program_can_be_run_again(answers):
    """After the abort the same program stops at the same place, and a mended one runs to its end."""
    assert answers[1] is answers[6] is True
    assert answers[2] == pytest.approx(answers[7], abs=0.2)
    assert answers[-2:] == [False, []]


def test_flute_excess_holds_the_feed(tmp_path):
    """T6 has flutes of 3 mm: a feed 4 mm deep is held as the shank touches; one of 2.5 mm is not."""
    program = tmp_path / 'deep.ngc'
    program.write_text(HEAD + 'G0 Z5\nG0 X-10 Y10\nG0 Z-2.5\nG1 X70\nG0 Z5\nG0 X-10 Y30\nG0 Z-4\nG1 X70\nM2\n')
    geometry = tmp_path / 'tools.toml'
    geometry.write_text('[tool.1]\nshape = "flat"\nflute_length = 3\n')
    answers = operate(tmp_path, [['open', str(program)], ['run_until_stopped', 40], GUARD, ['position'], ['abort'], ['errors'],
                                 ['jog', 2, 15, 20], ['mdi', 'G0 X-30']],
                      edit=f's#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {geometry}#')
    _open, stopped, guard, position, _abort, said, jogged, moved = answers
    assert stopped is True and guard[:2] == ['TRUE', '2']
    assert position[1] == pytest.approx(30, abs=1e-5)
    assert -3.0 <= position[0] < -1.0           # touched, and stood after v^2/2A = 0.4 mm
    assert said == ['chipwise: cut stopped at 4.00 mm or more of depth, flutes 3.00 mm long (line 13, tool 1, 6.00 mm); '
                    'press Stop, jog away and take more passes (guard: [CHIPWISE]GUARD_FLUTE)']
    assert jogged == [1.0] and moved == []


def test_both_can_be_switched_off(tmp_path):
    program = tmp_path / 'both.ngc'
    program.write_text(HEAD + 'G0 Z5\nG0 X-10 Y10\nG0 Z-4\nG1 X20\nG0 X70\nG0 Z5\nM2\n')
    geometry = tmp_path / 'tools.toml'
    geometry.write_text('[tool.1]\nshape = "flat"\nflute_length = 3\n')
    answers = operate(tmp_path, [['open', str(program)], ['run_until_stopped', 40], ['errors'], GUARD[:3],
                                 ['pins', 'stock-tracker.0.removed-volume']],
                      edit=f's#^TOOL_GEOMETRY = .*#TOOL_GEOMETRY = {geometry}#; s#^GUARD_\\(.*\\) = yes#GUARD_\\1 = no#')
    assert answers[1:3] == [False, []] and answers[3] == ['FALSE', '0']
    assert float(answers[4][0]) == pytest.approx(60 * 6 * 4, rel=0.003)


def alarms(log):
    """Rows of a log in which a guard would stop the machine."""
    return np.flatnonzero((log['rapid_contact'] != 0) | (log['flute_excess'] != 0))


def check_quiet(log):
    rows = alarms(log)
    assert len(rows) == 0, (f"{len(rows)} alarms, the first at line {log['line'][rows[0]]}, x {log['x'][rows[0]]:.3f} "
                            f"y {log['y'][rows[0]]:.3f} z {log['z'][rows[0]]:.3f}")


def test_the_checker_sees_an_alarm():
    log = {name: np.zeros(5) for name in ('rapid_contact', 'flute_excess', 'line', 'x', 'y', 'z')}
    check_quiet(log)
    log['rapid_contact'][3] = 1
    with pytest.raises(AssertionError, match='1 alarms'):
        check_quiet(log)


# stations.ngc is a robot's (tests/machine/test_robot.py), turning_*.ngc a lathe's (tests/turning)
PROGRAMS = sorted(name for name in os.listdir(os.path.join(runner.ROOT, 'nc_files'))
                  if name.endswith('.ngc') and not name.startswith(('turning', 'stations')))


def ran_quietly(answer):
    """The log of a program (step "log") that ran to its end without an error and without an alarm."""
    errors, path = answer
    assert errors == []
    log = log_of(path)
    check_quiet(log)
    return log


@pytest.mark.parametrize('name, machine', [
    pytest.param(name, machine, marks=pytest.mark.scene(QUIET[machine], [['log', os.path.join(runner.ROOT, 'nc_files', name)]]))
    for machine in QUIET for name in PROGRAMS if machine != 'mill' or name.removesuffix('.ngc') not in DEMOS])
def test_no_false_alarm_on_our_programs(answers, name, machine):
    ran_quietly(*answers)


@pytest.mark.parametrize('name', DEMOS)
@pytest.mark.together(GROUP)
def test_no_false_alarm_on_a_demo(name):
    """The rest of our programs on the metric mill."""
    summary, log = demo_run(name)
    assert summary['finished'] and summary['errors'] == [], summary
    check_quiet(log)


SANE = {
    'own slot, back and forth, and a second pass deeper than the flutes': '''
G0 X-10 Y20 Z5
G0 Z-4
G1 X50
G0 X-10
G0 X45
G0 Z5
G0 X-10
G0 Z-8
G1 X50
G0 X-8
G0 Z5
''',
    'a turned slot and its retraces': '''
G0 X-8 Y3 Z5
G0 Z-5
G1 X50 Y33
G0 X-8 Y3
G0 X50 Y33
G0 Z0.3
G0 X30 Y10
''',
    'clearances of a tenth': '''
G0 X-3.1 Y20 Z5
G0 Z-3
G0 Z0.1
G0 X30
G0 X50 Y5
G0 X-3.1 Y-3.1
G0 Z-5
G0 X-3.1 Y43.1
G0 X63.1
G0 Z0.05
G0 X10 Y10
''',
    'down to the surface itself': '''
G0 X20 Y20 Z10
G0 Z0
G0 Z10
G0 X-3 Y20
G0 Z-5
G0 Z10
''',
    'canned cycles': '''
G0 X10 Y10 Z5
G98 G81 X10 Y10 Z-6 R0.5
X20
G99 G83 X30 Y20 Z-9 R0.2 Q2
X40
G73 X50 Y20 Z-9 R0.2 Q2
G82 X10 Y30 Z-4 R0.1 P0.1
G85 X20 Y30 Z-4 R0.1
G80
G0 Z5
''',
    'tool change and probing': '''
G0 X10 Y10 Z5
G1 Z-4
G1 X40
G0 Z5
T3 M6
G43
G0 X25 Y10
G1 Z-2
G1 X30
G0 Z5
T2 M6
G0 X25 Y10
G0 Z-3.9
G0 X38
G0 X12
G0 Z5
G38.3 Z-0.5 F100
G0 Z10
''',
    'G64 without tolerance': '''
G64
G0 X-40 Y20 Z5
G0 Z-4
G1 X50
G0 X-40
G0 Y80
G0 X-40 Y-40
G0 Z20
G0 X30 Y20
G0 Z1
G1 Z-3
G0 Z20
''',
    'a pocket and traverses in it': '''
G0 X30 Y20 Z5
G13 X30 Y20 I4 K14 Q4 Z-6 R0.5 J3 E600
G0 Z-5.9
G0 X40
G0 X20
G0 X30 Y10
G0 Y30
G0 Z5
''',
}


@pytest.mark.parametrize('what', SANE, ids=[name.replace(' ', '_') for name in SANE])
@pytest.mark.scene(QUIET['mill'], lambda what: [['log', HEAD + 'G0 Z20' + SANE[what] + 'M2\n']])
def test_no_false_alarm(answers, what):
    ran_quietly(*answers)


def pocket_paths(mode):
    """Traverses 1 mm above the floor of a pocket of 50 mm by 30 mm, to within 0.3 to 2 mm of its walls, each ending otherwise:
    down to the floor and on by feed, or by feed at once (before which LinuxCNC stops)."""
    lines = [mode, 'G0 X30 Y20 Z-5']
    for gap in (0.3, 0.7, 2.0):
        x, y = 22 - gap, 12 - gap
        for dx, dy in ((x, -y), (x, y), (-x, y), (-x, -y), (0, y), (x, 0), (0, -y), (x, y), (-x, -y)):
            across, back = f'G0 X{30 + dx:.3f} Y{20 + dy:.3f}', f'G1 X{30 + dx / 2:.3f} Y{20 + dy / 2:.3f}'
            lines += [across, 'G0 Z-6', back, 'G0 Z-5', across, back]
    return '\n'.join(lines) + '\n'


def pocket_cleared():
    """Two levels of rows 4 mm apart and the outline; T1, 6 mm."""
    lines = ['F3000', 'G0 X8 Y8 Z1']
    for z in (-3, -6):
        lines.append(f'G1 Z{z}')
        for row, y in enumerate(range(8, 33, 4)):
            lines += [f'G1 Y{y}', f'G1 X{8 if row % 2 else 52}']
        lines += ['G1 X8', 'G1 Y8', 'G1 X52', 'G1 Y32', 'G0 Z1', 'G0 X8 Y8', f'G0 Z{z + 1}']
    return '\n'.join(lines) + '\n'


def across_a_pocket(modes):
    return [['log', HEAD + 'G0 Z20\n' + pocket_cleared() + ''.join(pocket_paths(mode) for mode in modes) + 'G0 Z20\nM2\n']]


@pytest.mark.parametrize('modes', [('G64 P0.01', 'G61'), ('G64 P0.1', 'G64')])
@pytest.mark.scene(QUIET['mill'], across_a_pocket)
def test_no_false_alarm_across_a_pocket(answers, modes):
    """The tool brakes towards a wall at 100 mm/s and stands or turns just before it; the guard is on and stops nothing.  As it
    begins to brake two periods show less than the planner does: one traverse in ten was stopped for braking too weakly."""
    data = ran_quietly(*answers)
    low = (data['motion_type'] == 1) & (data['z'] < -4.9)
    assert data['velocity'][low].max() > 99.0                                        # at the rapid's speed inside the pocket
    assert np.diff(data['removed_volume'])[low[1:]].max() < 1e-3                     # and none of them met stock


# --- random traverses round the stock, judged by its box and by whether anything was left to cut there -------------

RADIUS, MODES = 3.0, ('G64', 'G64', 'G64 P1', 'G64 P5', 'G64 P20', 'G61')
THIN_MM = 0.15          # half a cell: so thin a layer is ignored (docs/design/hal.md)
CHIP_MM = 0.36          # 1.4 cells: nor is what a step of the probe takes off an upright edge of the stock


def gap(points):
    """How far the tool (flat) is from the box of HEAD, above or beside it, mm; below 0: in it."""
    x, y, z = np.asarray(points, float).T
    beside = np.hypot(np.maximum(np.maximum(-x, x - 60), 0), np.maximum(np.maximum(-y, y - 40), 0)) - RADIUS
    return np.maximum(z, beside)


def random_traverses(generator, count):
    """A program of traverses whose corners all lie outside the box, half of them close to it; the blends may cut corners."""
    at, lines = np.array([-20.0, -20.0, 20.0]), [generator.choice(MODES), 'G0 X-20 Y-20']
    while len(lines) < count + 2:
        away, beside = RADIUS + generator.choice([0.05, 0.3, 1, 5]), generator.uniform(-20, 60)
        to = np.array(generator.choice([
            [generator.uniform(-45, 110), generator.uniform(-45, 85), generator.uniform(-8, 25)], [-away, beside, -5],
            [60 + away, beside, -5], [beside, -away, -5], [beside, 40 + away, -5], [beside, beside, away - RADIUS]]), float)
        if generator.random() < 0.3:
            to = at + (to - at) * generator.uniform(0.05, 0.3)
        if gap(at + (to - at) * np.linspace(0, 1, 200)[:, None]).min() > 0.02:
            lines.append('G0 X%.3f Y%.3f Z%.3f' % tuple(to))
            at = to
    return HEAD + 'G0 Z20\n' + '\n'.join(lines) + '\nG0 Z30\nM2\n'


def judge_traverses(log):
    """Raise where an alarm has no contact near it, or a contact no alarm the braking distance v2 / 2A before."""
    places = np.column_stack([log[axis] for axis in 'xyz'])
    space, said = gap(places), np.asarray(log['rapid_contact'], bool)
    toolpath = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    stopped = toolpath + np.asarray(log['velocity']) ** 2 / (2 * 500)           # where braking from here would end
    at_edge = ((places[:, 0] < 0) | (places[:, 0] > 60)) & ((places[:, 1] < 0) | (places[:, 1] > 40))
    touched, inside = np.flatnonzero(space < 0.0), space < -np.where(at_edge, CHIP_MM, THIN_MM)
    for row in np.flatnonzero(np.diff(said, prepend=False) & said):        # it may last while the tool is in the stock
        near = np.count_nonzero((touched > row - 1500) & (touched < row + 700))
        assert near > 0, \
            f"alarm without a contact at line {log['line'][row]}, {space[row]:.3f} mm from the stock"
    for row in np.flatnonzero(inside[1:] & ~inside[:-1]):
        if np.ptp(log['removed_volume'][row:row + 300]) == 0.0:             # a contact before has taken this stock away
            continue
        before = slice(max(0, row - 1500), row)
        assert (said[before] & (stopped[before] < toolpath[row])).any(), \
            f"no alarm in time before the contact at line {log['line'][row]}"
    return len(touched)


def test_random_traverses(tmp_path):
    """With the guard announced but switched off: every alarm is followed by a contact, every contact was announced in time."""
    seeds = range(random_seed(), random_seed() + random_count(2))
    programs = [random_traverses(random.Random(seed), 60) for seed in seeds]
    answers = operate(tmp_path, [step for text in programs for step in (['log', text], ['fresh'])], speed=SPEED,
                      edit=WITH_LOG + '; s/^GUARD_RAPID = .*/GUARD_RAPID = no/', timeout=150 + 60 * len(programs))
    for seed, text, (errors, log) in zip(seeds, programs, answers[::2]):
        assert errors == []
        try:
            touched = judge_traverses(log_of(log))
        except AssertionError:
            print('replay:', write_replay(f'traverses-{seed}', text))
            raise
        print(f'seed {seed}: {touched} ms in the stock')


def test_the_judge_of_traverses_sees_both_faults():
    """A traverse along X into the box at 100 mm/s: told 0.2 s before, not at all, too late; and told beside it."""
    x = np.arange(-40.0, 10.0, 0.1)
    log = {'x': x, 'y': 0 * x + 20, 'z': 0 * x - 5, 'velocity': 0 * x + 100, 'line': 0 * x, 'rapid_contact': 0 * x,
           'removed_volume': np.maximum(x + 3, 0)}
    contact = int(np.argmax(x > -RADIUS))
    log['rapid_contact'][contact - 200:] = 1
    judge_traverses(log)
    for first in (contact - 90, len(x)):
        log['rapid_contact'][:] = np.arange(len(x)) >= first
        with pytest.raises(AssertionError, match='no alarm'):
            judge_traverses(log)
    log['rapid_contact'][:], log['z'] = 1, 0 * x + 0.2         # above it
    with pytest.raises(AssertionError, match='without a contact'):
        judge_traverses(log)
