# SPDX-License-Identifier: GPL-2.0-or-later
"""bin/chipwise filter as a GUI calls it: `sh -c`, standard output in a file, standard error in a pipe, standard input closed."""

import os
import re
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from chipwise.filter import verdict as verdicts, work
from chipwise.filter.loops import may_loop
from chipwise.filter.process import Work
from chipwise.processes import descendants, lives
from chipwise.settings import parse_settings
from support import ROOT
from support.filter_rig import BAD, BINARY, CLEAN, ENDLESS, HEAD, HUGE, RAPID, UNKNOWN
from support.rewrite_rig import check_status, make_machine

sys.path.insert(0, os.path.join(ROOT, 'tools'))

COMMAND = f"{ROOT / 'bin' / 'chipwise'} filter"
PATIENCE_S = 120        # for what takes seconds on a machine that does nothing else
PIPE_BYTES = 65536
DEEP = HEAD.replace('G0 Z-4\n', 'G0 Z-18\n') + 'G1 X110 F400\nG0 Z5\nM2\n'        # flutes of 12 mm
LOOP = HEAD.replace('G0 Z-4\n', 'G0 Z-18\n') + 'o1 repeat [1]\nM66 E0 L0\nG1 X110 F400\no1 endrepeat\nG0 Z5\nM2\n'


@pytest.fixture(name='ini')
def make_ini(tmp_path):
    """A mill whose filter has 60 s; more(lines) adds settings."""
    path = make_machine(tmp_path / 'machine')

    def more(*lines):
        text = path.read_text()
        path.write_text(text.replace('[CHIPWISE]\n', '[CHIPWISE]\n' + ''.join(line + '\n' for line in lines), 1))
        return path
    more('FILTER_TIME = 60')
    more.path = path
    return more


def start(ini, program, out, environment=None):
    clean = {key: value for key, value in os.environ.items() if key not in ('INI_FILE_NAME', 'AXIS_PROGRESS_BAR')}
    quoted = os.fspath(program).replace("'", "'\\''")
    with open(out, 'wb') as file:
        child = subprocess.Popen(['sh', '-c', f"{COMMAND} --ini {ini} '{quoted}'"], stdin=subprocess.PIPE, stdout=file,
                                 stderr=subprocess.PIPE, env={**clean, **(environment or {})})
    child.stdin.close()
    return child


def run(ini, program, tmp_path, environment=None):
    """-> status, data on standard output, text on standard error but progress, progress in percent."""
    child = start(ini, program, tmp_path / 'out', environment)
    errors = child.stderr.read()            # up to the end of the pipe, as AXIS
    assert len(errors) < PIPE_BYTES and (not errors or errors.endswith(b'\n'))
    lines = errors.decode().splitlines()
    progress = [int(line.partition('=')[2]) for line in lines if line.startswith('FILTER_PROGRESS=')]
    assert len(progress) <= 100 and progress == sorted(set(progress))
    said = '\n'.join(line for line in lines if not line.startswith('FILTER_PROGRESS='))
    assert 'Traceback' not in said and 'internal error' not in said, said
    return SimpleNamespace(status=child.wait(PATIENCE_S), data=(tmp_path / 'out').read_bytes(), said=said, progress=progress)


def put(tmp_path, text, name='part.nc'):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


# ---- what goes through -------------------------------------------------------------------------------------------

@pytest.mark.parametrize('data', [
    CLEAN.encode(), CLEAN.encode().rstrip(), CLEAN.replace('\n', '\r\n').encode(), CLEAN.replace('M2', '(\u00e4\u20ac) M2').encode(),
    CLEAN.encode().replace(b'M2', b'(Fr\xe4ser \xff\xfe) ; \x80\nM2'), b'%\n' + CLEAN.encode() + b'%\n',
    CLEAN.encode() + b'after the end \xff\n' * 2000])
def test_a_clean_program_goes_through_byte_for_byte(data, ini, tmp_path):
    done = run(ini.path, put(tmp_path, data), tmp_path)
    assert (done.status, done.said) == (0, '') and done.data == data


def test_names_that_a_shell_or_a_message_could_break(ini, tmp_path):
    for name in ("it's $(here) a \"part\".nc", b'M\xfcller\n.nc'):
        path = os.path.join(os.fsencode(tmp_path), os.fsencode(name))
        with open(path, 'wb') as file:
            file.write(BAD.encode())
        done = run(ini.path, os.fsdecode(path), tmp_path)
        assert done.status == 2 and done.said.count('\n') == 0 and '(line 7)' in done.said


REFUSED = {
    'syntax': (BAD, 'Attempt to divide by zero; correct the line (line 7)'),
    'binary': (BINARY, 'it is not a text file; name a G-code program'),
    'utf16': (CLEAN.encode('utf-16'), 'it is not a text file'),
    'empty': (b'', 'it is empty'),
    'no end': (CLEAN.replace('M2\n', ''), 'end it with M2'),
}


@pytest.mark.parametrize('name', REFUSED)
def test_a_file_that_cannot_be_used_is_not_opened(name, ini, tmp_path):
    content, words = REFUSED[name]
    path = put(tmp_path, content)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (2, b'')
    assert done.said.startswith(f'chipwise: {path}: it is not opened: ') and words in done.said, done.said


def test_what_is_no_program_at_all(ini, tmp_path):
    os.mkfifo(tmp_path / 'fifo.nc')
    (tmp_path / 'folder.nc').mkdir()
    huge = put(tmp_path, 'G1 X1\n' * 1000, 'huge.nc')
    os.truncate(huge, HUGE)
    for name, words in (('fifo.nc', 'not a regular file'), ('folder.nc', 'not a regular file'), ('none.nc', 'No such file'),
                        ('huge.nc', 'it has 200 MB, more than 100')):
        done = run(ini.path, tmp_path / name, tmp_path)
        assert (done.status, done.data) == (2, b'') and words in done.said and str(tmp_path / name) in done.said


def test_findings_are_said_and_the_setting_refuses_them(ini, tmp_path):
    path = put(tmp_path, RAPID)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, RAPID.encode())
    assert re.search(rf'{path}: line 7, tool 1: a traverse meets 4 mm of stock', done.said), done.said
    ini('FILTER_REFUSE = findings')
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (1, b'') and 'line 7, tool 1: a traverse meets' in done.said


def test_unknown_flutes_are_said_and_are_no_reason_to_refuse(ini, tmp_path):
    (ini.path.parent / 'tools.toml').write_text('')
    ini('FILTER_REFUSE = findings')
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and 'the depth of tool 1 is not checked' in done.said
    done = run(ini.path, put(tmp_path, RAPID), tmp_path)
    assert done.status == 1 and re.search('part.nc: line 7, tool 1: a traverse.*\n.*the depth of tool 1', done.said), done.said


UNCHECKED = {
    'no stock': (UNKNOWN, 'no stock is defined; add M250'),
    'G93': ('G21 G90\nG93\nG1 X1 F2\nG1 X2 F2\nM2\n', 'G93 (inverse time) is not judged; use G94 (line 2)'),
    'probe': ('G21\nG38.2 Z-5 F50\nG0 Z5\nM2\n', 'probes'),
    'loop with an end': ('G21 G90\no1 repeat [3]\nG1 X2 F200\no1 endrepeat\nM2\n', 'no stock is defined'),
    'only settings': ('G21\n#1 = 5\nM2\n', 'it has no moves'),
}


@pytest.mark.parametrize('name', UNCHECKED)
def test_a_program_that_cannot_be_judged_is_opened_as_it_is(name, ini, tmp_path):
    content, words = UNCHECKED[name]
    path = put(tmp_path, content)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, content.encode())
    assert f'{path}: it is opened unchecked: ' in done.said and words in done.said and '--' not in done.said, done.said


def test_the_setting_refuses_what_cannot_be_judged(ini, tmp_path):
    ini('FILTER_REFUSE = unchecked')
    done = run(ini.path, put(tmp_path, UNKNOWN), tmp_path)
    assert (done.status, done.data) == (2, b'') and 'no stock is defined' in done.said


def test_a_broken_setting_or_machine_opens_the_program_unchecked(ini, tmp_path):
    ini('FILTER_REFUSE = often')
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and '[CHIPWISE]FILTER_REFUSE = often is not' in done.said
    done = run(tmp_path / 'none.ini', put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and 'none.ini' in done.said


def test_no_advice_of_the_command_line_reaches_the_screen():
    """Every message of the check that names an option is one that for_screen() changes."""
    import message_source
    found = [text for message in message_source.messages() for text in [f'{message[0]}; {message[1]}'] if '--stock' in text]
    assert len(found) >= 4
    for text in found:
        if not text.startswith('--'):
            assert '--' not in verdicts.for_screen(text), text


@pytest.mark.parametrize('tool, status', [(0, 2), (1, 0)])
def test_a_program_may_count_on_the_tool_in_the_spindle(tool, status, ini, tmp_path, monkeypatch):
    """G13 with the tool that an operator has loaded before."""
    monkeypatch.setenv('INI_FILE_NAME', str(ini.path))
    monkeypatch.setattr(work, 'spindle_tool', lambda: tool)
    path = put(tmp_path, HEAD.replace('T1 M6\n', '') + 'F400\nG13 X50 Y30 I20 Z-5 R1\nM2\n')
    verdict = work.judged(str(path), str(ini.path), {'cpu_s': 60, 'quiet_s': 10}, str(tmp_path), False, lambda share: None)
    assert verdict.status == status and (status or not verdict.notes), verdict.notes


# ---- rewriting ---------------------------------------------------------------------------------------------------

def test_rewriting_for_the_flutes(ini, tmp_path):
    ini('FILTER_REWRITE = flute')
    path = put(tmp_path, DEEP)
    done = run(ini.path, path, tmp_path)
    assert done.status == 0 and done.data != DEEP.encode() and f'{path}: it is rewritten: line 7 in 2 levels' in done.said, done.said
    assert check_status(put(tmp_path, done.data, 'new.ngc'), ini.path)[0] == 0
    assert 'cuts 18 mm deep' not in done.said and 'rewritten.ngc' not in done.said
    assert run(ini.path, put(tmp_path, CLEAN), tmp_path).data == CLEAN.encode()


def test_a_program_that_cannot_be_rewritten_is_opened_as_it_is_or_refused(ini, tmp_path):
    ini('FILTER_REWRITE = flute')
    path = put(tmp_path, LOOP)
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (0, LOOP.encode())
    assert 'M66 there cannot be written out' in done.said and 'cuts 18 mm deep' in done.said, done.said
    ini('FILTER_REFUSE = findings')
    done = run(ini.path, path, tmp_path)
    assert (done.status, done.data) == (1, b'') and 'not rewritten' in done.said


def test_rewriting_for_a_removal_rate(ini, tmp_path):
    ini('FILTER_REWRITE = feed')
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert (done.status, done.data) == (0, CLEAN.encode()) and '[CHIPWISE]FILTER_RATE is 0; give a removal rate' in done.said
    ini('FILTER_RATE = 4.8', 'FILTER_CEILING = 1000')
    done = run(ini.path, put(tmp_path, CLEAN), tmp_path)
    assert done.status == 0 and 'it is rewritten: F of 1 of 1 feed moves changed' in done.said
    feeds = [float(text) for text in re.findall(rb'F([\d.]+)', done.data.partition(b'G0 Z-4')[2])]
    assert max(feeds) <= 1000 and any(abs(feed - 200) < 4 for feed in feeds), feeds        # 4.8 cm3/min over 24 mm2


# ---- time, memory, end -------------------------------------------------------------------------------------------

def family(child):
    """Wait until the filter, its process and LinuxCNC's interpreter are there; -> their numbers, the filter's first."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        found = descendants(child.pid)
        if len(found) >= 3 and child.poll() is None:
            return found
        time.sleep(0.02)
    raise AssertionError('the filter has not started its processes')


def gone(pids):
    end = time.monotonic() + PATIENCE_S
    while any(map(lives, pids)) and time.monotonic() < end:
        time.sleep(0.02)
    return not any(map(lives, pids))


@pytest.mark.parametrize('text', [ENDLESS, 'G21\no1 while [1]\no1 endwhile\nM2\n', HEAD + 'F100\no1 while [1]\nG1 X1\nG1 X0\no1 endwhile\nM2\n',
                                  'G21\nF10\no1 while [1]\nG38.3 Z-5\nG1 X1\no1 endwhile\nM2\n'])
def test_an_endless_loop_ends_at_the_limit_and_is_not_opened(text, ini, tmp_path):
    ini('FILTER_TIME = 3')
    path = put(tmp_path, text)
    begun = time.monotonic()
    child = start(ini.path, path, tmp_path / 'out')
    pids = set()
    while child.poll() is None:
        pids.update(descendants(child.pid))
        time.sleep(0.02)
    said = child.stderr.read().decode()
    assert child.returncode == 2 and (tmp_path / 'out').read_bytes() == b''
    assert time.monotonic() - begun >= 3 and not any(map(lives, pids))      # at once: the filter has waited for them
    assert f'{path}: it is not opened: it takes more than 3 s to check, and its loops or subs may have no end' in said


PLAIN = 'G21 (no loop here) G1 X1 F100\nM2\n'


def judged_by(tmp_path, monkeypatch, text, work_of_it, seconds, **settings):
    """The Verdict when work.judged is another function."""
    monkeypatch.setattr(work, 'judged', work_of_it)
    process = Work(str(put(tmp_path, text)), '', parse_settings(settings), str(tmp_path))
    try:
        return process.verdict(time.monotonic() + seconds, lambda share: None)
    finally:
        process.end()


@pytest.mark.parametrize('text, status', [(PLAIN, 0), (ENDLESS, 2)])
def test_a_program_that_takes_too_long_is_opened_as_it_is_unless_it_may_have_no_end(text, status, tmp_path, monkeypatch):
    verdict = judged_by(tmp_path, monkeypatch, text, lambda *_: time.sleep(3600), 10.0)
    assert verdict.status == status and not verdict.path and 'it takes more than 30 s to check' in verdict.notes[0][0]
    assert ('opened unchecked' in verdict.notes[0][0]) == (status == 0)


@pytest.mark.parametrize('text, status', [(PLAIN, 0), (ENDLESS, 2)])
def test_want_of_memory_ends_the_check_only(text, status, tmp_path, monkeypatch):
    verdict = judged_by(tmp_path, monkeypatch, text, lambda *_: [bytearray(1 << 20) for _ in range(400)], PATIENCE_S, PLAN_MEMORY='100')
    assert verdict.status == status and 'want of memory' in verdict.notes[0][0]


@pytest.mark.parametrize('text, loops', [
    (PLAIN, False), ('O1 while [1]', True), ('n10 o<x> call', True), ('/ o 1 do', True), ('M98 P1', True), ('m 99', True),
    ('(o1 while)\nG1 X1', False), ('G1 X1 ' * 300_000 + '\n\to2 repeat', True), ('G1 X0\r\no1 while [1]', True)])
def test_which_programs_may_have_no_end(text, loops, tmp_path):
    assert may_loop(put(tmp_path, text)) == loops


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGKILL])
def test_a_filter_that_is_ended_leaves_nothing(number, ini, tmp_path):
    child = start(ini.path, put(tmp_path, ENDLESS), tmp_path / 'out', environment={'TMPDIR': str(tmp_path)})
    pids = family(child)
    os.kill(pids[0], number)                # below sh
    assert child.wait(PATIENCE_S) == 128 + number
    assert gone(pids) and (tmp_path / 'out').read_bytes() == b''
    child.stderr.read()                     # no child holds the pipe open
    if number == signal.SIGKILL:            # the next one removes what it has left
        assert list(tmp_path.glob('chipwise-*'))
        run(ini.path, put(tmp_path, b'', 'empty.nc'), tmp_path, environment={'TMPDIR': str(tmp_path)})
    assert not list(tmp_path.glob('chipwise-*'))


def test_a_filter_ends_with_its_gui(ini, tmp_path):
    ini('FILTER_TIME = 3600')               # the first of equal keys counts
    program, out = put(tmp_path, ENDLESS), tmp_path / 'out'
    gui = subprocess.Popen([sys.executable, '-c', 'import subprocess, sys, time\n'
                            'subprocess.Popen(["sh", "-c", sys.argv[1]], stdout=open(sys.argv[2], "w"), stderr=subprocess.PIPE)\ntime.sleep(600)',
                            f'{COMMAND} --ini {ini.path} {program}', out])
    pids = family(gui)
    gui.kill()
    gui.wait()
    assert gone(pids) and out.read_bytes() == b''


@pytest.mark.parametrize('closed', ['<&-', '>&-', '2>&-', '<&- >&- 2>&-'])
def test_closed_handles(closed, ini, tmp_path):
    program, out = put(tmp_path, RAPID), tmp_path / 'out'
    done = subprocess.run(['sh', '-c', f'{COMMAND} --ini {ini.path} {program} >{out} {closed}'], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, timeout=PATIENCE_S)
    assert b'Traceback' not in done.stderr and b'internal' not in done.stderr
    assert out.read_bytes() == (b'' if '>&-' in closed.replace('2>&-', '') else RAPID.encode())


# ---- no room -----------------------------------------------------------------------------------------------------

def test_no_room_on_the_disk(ini, tmp_path):
    long = CLEAN.replace('M2\n', 'G0 Z6\nG0 Z5\n' * 4000 + 'M2\n')
    path, disk = put(tmp_path, long), tmp_path / 'disk'
    disk.mkdir()
    done = subprocess.run(['unshare', '--user', '--map-root-user', '--mount', 'sh', '-c', f'mount -t tmpfs -o size=16k none {disk} || exit 77\n'
                           f'{COMMAND} --ini {ini.path} {path} >{disk}/out\necho $? $(wc -c <{disk}/out)'],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 77 and 'unshare:' not in done.stderr:
        assert done.stdout.split() == ['2', '0'] and f'{path}: it is not opened: No space left on device where the GUI' in done.stderr
    full = subprocess.run(['sh', '-c', f'{COMMAND} --ini {ini.path} {tmp_path / "part.nc"} >/dev/full'], stderr=subprocess.PIPE, text=True)
    assert full.returncode == 2 and 'No space left on device where the GUI keeps a copy' in full.stderr


# ---- what each GUI can take --------------------------------------------------------------------------------------

@pytest.mark.parametrize('display, bar, heard', [('axis', '1', True), ('gmoccapy', '1', False), ('qtvcp qtdragon', None, True),
                                                 ('/usr/bin/axis -x', '1', True)])
def test_standard_error_is_silent_where_a_line_of_it_breaks_the_gui(display, bar, heard, ini, tmp_path):
    ini.path.write_text(ini.path.read_text().replace('DISPLAY = axis', f'DISPLAY = {display}'))
    for text in (BAD, RAPID):
        done = run(ini.path, put(tmp_path, text), tmp_path, environment={'AXIS_PROGRESS_BAR': bar} if bar else None)
        assert bool(done.said) == heard and (heard or not done.progress)
