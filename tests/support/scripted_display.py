#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""A display program that does what a test tells it: CHIPWISE_STEPS, a JSON list of steps, one answer each.

    ["home"]                        E-stop reset, machine on, home all
    ["mdi", "G0 X1"]                execute a line; answer: the operator errors it raised
    ["mdi quietly", "G0 X1"]        the same, but goes on at once
    ["jog", axis, distance, velocity]   jog in teleop mode, mm and mm/s; answer: [lowest adaptive-feed seen]
    ["pins", name, ...]             answer: values, as text
    ["position"]                    answer: [x, y, z] commanded, machine units
    ["modes"]                       answer: what of the program outlives it: active codes, feed, speed, path tolerances, offsets
    ["sleep", seconds]
    ["open", program]
    ["open text", program text]
    ["run_until_stopped", seconds, line]   run from a line (0: the start) until a guard stops it
                                    (answer true) or it ends (false), for so long and WAIT_S at least
    ["run_from", line]              run from a line; goes on at once
    ["run_until", axis, value]      run until the axis is past the value (machine units, rising)
    ["abort"]
    ["errors"]                      answer: the operator errors since the last time
    ["errors", text]                the same, but waits for one that contains the text
    ["kill_monitor"]
    ["kill_worker"]                 only the process of chipwise-monitor that does the work
    ["signal_monitor", "STOP" or "CONT"]    to its processes, at once
    ["freeze_worker"], ["thaw_worker"]   stop that process with SIGSTOP, let it go on
    ["kill_monitor_in", line, what, seconds]    begin an MDI line; kill the monitor so long after it has begun to "hold" the
                                    map, or to write a file in the folder `what`; the line goes on.
                                    A line that is over before that could be seen is begun again
    ["hold status", seconds]        take LinuxCNC's status buffer for so long, in real time, as a process does that is stopped meanwhile
    ["busy", number]                so many processes that do nothing but work, until the end
    ["start_monitor"]               as from a shell, without LinuxCNC's environment; waits until it is ready
    ["mdi_end"]                     wait for the end of that line; answer: the operator errors it raised
    ["map_sum"]                     answer: [checksum of the map's cells, mm3 removed]
    ["messages"]                    answer: messages other than errors since the start
    ["messages", text]              the same, but waits for one that contains the text
    ["map", name]                   saves the heights of the map as NAME (.npy), without one as a file beside the answers;
                                    answer: [mm3 removed, name]

    ["start", program text]         open and run a program; goes on at once
    ["until", pin, ">", "<" or "=", number]   wait until a pin has got to a value since the last step but these; answer: its value
    ["pause"], ["resume"], ["reverse"], ["forward"], ["abort"], ["estop"], ["off"], ["on"]   as the buttons do; pause waits for standstill
    ["step to end"]                 answer: how many single steps that took
    ["finish"]                      wait for the end of the program; answer: the operator errors since the last answer
    ["over", seconds, pin, ...]     answer: [lowest, highest] of each pin in that time, from the "until" before on
    ["feed override", factor]       the operator's slider
    ["hal", word, ...]              a halcmd command
    ["enter", text, argument, ...]  chipwise enter with the text as standard input; answer: [exit status, output, errors]
    ["program", word, ...]          a program in LinuxCNC's environment; answer: [exit status, what it printed]
    ["stop", how, seconds]          abort or estop, so long after the start of the open program; answer: {"served": s until the
                                    task had done it, "stood": s until nothing moved}, both without the time for which
                                    other programs had the processors; "busy": whether the program was still under way
    ["begin"]                       start the open program; goes on at once
    ["planners"]                    answer: how many processes plan cycles
    ["kill", name]                  kill the processes of that name
    ["log", program]                run a program, a path or its text, and save its servo-rate log (chipwise.headless.log); the
                                    sampler is that of hal/headless.hal, so that "until" looks at live pins;
                                    answer: [the operator errors it raised, path of the log]
    ["fresh"]                       the machine as after the step home: idle and at home without a tool and without an offset,
                                    its own modes, no M251, 100 % override; errors and messages are forgotten.  But there is a
                                    stock, of 1 mm, in the machine's corner: removed-volume is 0

The pins of "until" and "over" are recorded every servo period (servo_record.py): however late a loaded machine lets this
program look, nothing that was there for a period is missed.  Pins that are not there at the start are looked at live.

The answers go to CHIPWISE_ANSWERS as one JSON list.  CHIPWISE_PATIENCE: s of real time that they may take.
"""

import contextlib
import ctypes
import json
import operator as relations
import os
import signal
import subprocess
import sys
import tempfile
import time
import zlib

sys.path[:0] = [os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', folder) for folder in ('../remap', '')]

import hal                                                      # noqa: E402
import linuxcnc                                                 # noqa: E402

from chipwise import halcmd, processes                          # noqa: E402
from chipwise.headless import log as runlog                     # noqa: E402
from chipwise.headless import sampling, session                 # noqa: E402

from support.servo_record import Record, RecordError     # noqa: E402

# Steps that set the machine going: what comes of them counts from their beginning, of all others from their end.
BEGINNING = ('start', 'begin', 'run from', 'run_from', 'mdi quietly', 'resume', 'reverse', 'forward')
LOOKING = ('until', 'over', 'sleep', 'pins', 'program')            # these do nothing to the machine
IDLE_POLLS = 20             # a program that has been idle so often is over, however short it was
SETTLE_S = 0.3      # the monitor's messages come this late at most
# In real time, however fast the clock is: a busy computer takes that longer.
PATIENCE_S = float(os.environ.get('CHIPWISE_PATIENCE', '240')) * session.SPEED     # for all steps from the start, or a step "fresh", on
WAIT_S = 400 * session.SPEED        # for one
FRESH = ('M252', 'M52 P0', 'G17 G21 G40 G49 G54 G80 G90 G91.1 G94 G97 G64 P0.01 M48 M5', 'G10 L2 P1 X0 Y0 Z0 R0', 'G92.1',
         'G53 G0 Z89.9', 'G53 G0 X0 Y0', 'T0 M6', 'M250 P-49 Q-49 R-59 I1 J1 K1')   # RS274NGC_STARTUP_CODE of the INI files, and more

STATUS_KEY = 1002


class SemaphoreOperation(ctypes.Structure):
    """struct sembuf of <sys/sem.h>."""
    _fields_ = [(name, ctypes.c_short) for name in ('sem_num', 'sem_op', 'sem_flg')]


def send(pid, number):
    """A signal to a process, which may be gone by now: the worker of chipwise-monitor ends with its parent."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


class Operator:
    def __init__(self, steps):
        session.wait_for_task(time.monotonic() + session.STEP_TIMEOUT_S)
        self.machine = session.Session(time.monotonic() + PATIENCE_S)
        self.component = hal.component('scripted-display')      # hal.get_value wants one
        self.component.ready()
        pins = [step[1:2] if step[0] == 'until' else step[2:] for step in steps if step[0] in ('until', 'over')]
        period_ns = linuxcnc.ini(os.environ['INI_FILE_NAME']).find('EMCMOT', 'SERVO_PERIOD')
        self.record = Record(dict.fromkeys(sum(pins, [])), int(period_ns) / 1e9)

    def home(self):
        self.machine.switch_on()
        self.machine.home()

    def fresh(self):
        self.machine.deadline = time.monotonic() + PATIENCE_S
        self.abort()
        self.errors()
        self.machine.command.feedrate(1.0)
        for line in FRESH:
            said = [text for text in self.mdi(line) if not text.startswith('Note:')]        # of a homing long ago
            if said:
                raise session.SessionError(f'{line}: {said}')
        self.messages()
        self.machine.messages = []

    def log(self, program):
        descriptor, path = tempfile.mkstemp(suffix='.npz', dir=os.path.dirname(os.environ['CHIPWISE_ANSWERS']))
        os.close(descriptor)
        with tempfile.NamedTemporaryFile(suffix='.samples') as samples:
            sampler = sampling.Sampling(samples.name)
            self.open_text(program) if '\n' in program else self.open(program)
            sampler.start()
            try:
                idle_s = self.machine.run_program()
            finally:
                sampler.stop()
            runlog.save(path, runlog.without_tail(sampler.load(), self.record.period_s, idle_s), period=self.record.period_s,
                        units_per_mm=self.machine.status.linear_units)
        return [self.errors(), path]

    def errors(self, text=None):
        self.hear(lambda: self.machine.errors, text)
        found, self.machine.errors = self.machine.errors, []
        return found

    def messages(self, text=None):
        self.hear(lambda: self.machine.messages, text)
        return self.machine.messages

    def hear(self, said, text):
        """What is said for a while, or until something said contains the text (WAIT_S at most)."""
        time.sleep(SETTLE_S)
        self.machine.poll()
        end = time.monotonic() + WAIT_S
        while text is not None and not any(text in one for one in said()) and time.monotonic() < end:
            time.sleep(0.05)
            self.machine.poll()

    def mdi(self, line):
        self.machine.set_mode(linuxcnc.MODE_MDI, 'MDI')
        self.machine.command.mdi(line)
        self.machine.command.wait_complete(WAIT_S)
        self.machine.wait('end of ' + line, lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos, WAIT_S)
        return self.errors()

    def mdi_quietly(self, line):
        self.machine.set_mode(linuxcnc.MODE_MDI, 'MDI')
        self.machine.command.mdi(line)

    def jog(self, axis, distance, velocity):
        machine = self.machine
        machine.set_mode(linuxcnc.MODE_MANUAL, 'manual')
        machine.command.teleop_enable(1)
        machine.wait('teleop', lambda s: s.motion_mode == linuxcnc.TRAJ_MODE_TELEOP)
        there = machine.status.position[axis] + distance
        machine.command.jog(linuxcnc.JOG_INCREMENT, False, axis, velocity, distance)
        lowest, end = 1.0, time.monotonic() + abs(distance / velocity) + WAIT_S
        while abs(machine.status.position[axis] - there) > 1e-6 and time.monotonic() < end:
            lowest = min(lowest, float(self.pins('volumetric-feed.0.adaptive-feed')[0]))
            machine.poll()
        machine.wait('end of jog', lambda s: s.inpos)
        time.sleep(0.5)         # the task still treats it as jogging
        return [lowest]

    def pins(self, *names):
        return [halcmd.getp(name) for name in names]

    def position(self):
        self.machine.poll()
        return list(self.machine.status.position[:3])

    def modes(self):
        """Without line numbers, and without codes that are not modal."""
        self.machine.poll()
        s = self.machine.status
        return [list(s.gcodes[1:2] + s.gcodes[3:16]), list(s.mcodes[2:]), [round(v, 9) for v in s.settings[1:]], list(s.g5x_offset), list(s.g92_offset),
                list(s.tool_offset), s.rotation_xy, s.g5x_index]

    def sleep(self, seconds):
        time.sleep(seconds)
        self.record.pass_by(seconds if self.record.columns else 0)

    def open(self, program):
        self.machine.open(program)

    def run_from(self, line=0):
        self.machine.set_mode(linuxcnc.MODE_AUTO, 'auto')
        self.run(line)

    def run_until_stopped(self, seconds, line=0):
        self.run_from(line)
        end, idle = time.monotonic() + max(seconds, WAIT_S), 0
        while time.monotonic() < end and idle < 20:
            self.machine.poll()
            status = self.machine.status
            if self.pins('chipwise-guard.0.stop') == ['TRUE']:
                self.machine.wait('stand', lambda s: s.current_vel == 0)
                time.sleep(0.2)
                return True
            idle = idle + 1 if status.interp_state == linuxcnc.INTERP_IDLE and status.inpos else 0
            time.sleep(0.01)
        return False

    def run_until(self, axis, value):
        self.run_from()
        self.machine.wait('axis %d at %g' % (axis, value), lambda s: s.position[axis] > value, WAIT_S)

    def start(self, text):
        self.open_text(text)
        self.run()

    def open_text(self, text):
        with tempfile.NamedTemporaryFile('w', suffix='.ngc', delete=False) as program:
            program.write(text)
        self.machine.open(program.name)

    def run(self, line=0):
        """Begin the open program; returns when it runs, was refused, or is over already."""
        idle, errors = 0, len(self.machine.errors)
        self.machine.command.auto(linuxcnc.AUTO_RUN, line)

        def started(status):
            nonlocal idle
            idle += status.echo_serial_number >= self.machine.command.serial
            return status.interp_state != linuxcnc.INTERP_IDLE or len(self.machine.errors) > errors or idle > IDLE_POLLS
        self.machine.wait('start', started)

    def until(self, pin, relation, number):
        holds = {'>': relations.gt, '<': relations.le, '=': relations.eq}[relation]
        if pin in self.record.columns:
            self.machine.wait(f'{pin} {relation} {number}', self.record.first(pin, lambda value: holds(value, number)), WAIT_S)
            return self.record.row(self.record.mark)[self.record.columns[pin]]
        self.machine.wait(f'{pin} {relation} {number}', lambda _s: holds(hal.get_value(pin), number), WAIT_S)
        self.record.now()
        return hal.get_value(pin)

    def pause(self):
        self.machine.command.auto(linuxcnc.AUTO_PAUSE)
        self.machine.wait('pause', lambda s: s.paused and s.current_vel < 1e-9)

    def resume(self):
        self.machine.command.auto(linuxcnc.AUTO_RESUME)
        self.machine.wait('resume', lambda s: not s.paused)

    def reverse(self):
        self.machine.command.auto(linuxcnc.AUTO_REVERSE)

    def forward(self):
        self.machine.command.auto(linuxcnc.AUTO_FORWARD)

    def step_to_end(self, most=20):
        """Single steps until the program has ended; -> how many."""
        for count in range(1, most + 1):
            self.machine.command.auto(linuxcnc.AUTO_STEP)
            # not wait_complete(): the task calls a program in single steps under way until its end
            self.machine.wait('the task has the step', lambda s: s.echo_serial_number >= self.machine.command.serial, WAIT_S)
            self.record.now()
            self.sleep(0.2)
            self.machine.wait('step', lambda s: s.current_vel < 1e-9, WAIT_S)
            if self.machine.status.interp_state == linuxcnc.INTERP_IDLE:
                return count
        return None

    def abort(self):
        self.machine.command.abort()
        self.machine.wait('abort', lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos)

    def stop(self, how, seconds):
        machine = self.machine
        machine.set_mode(linuxcnc.MODE_AUTO, 'auto')
        machine.command.auto(linuxcnc.AUTO_RUN, 0)
        time.sleep(seconds)
        machine.poll()
        busy = machine.status.interp_state != linuxcnc.INTERP_IDLE
        waited, began = self.waited(), time.monotonic()
        if how == 'abort':
            machine.command.abort()
        else:
            machine.command.state(linuxcnc.STATE_ESTOP)
        times = []
        for done in (lambda s: s.task_state == linuxcnc.STATE_ESTOP if how == 'estop' else
                     s.interp_state == linuxcnc.INTERP_IDLE, lambda s: s.current_vel == 0):
            while True:
                machine.poll()
                if done(machine.status) or time.monotonic() - began > WAIT_S:
                    break
                time.sleep(0.002)
            times.append(time.monotonic() - began - (self.waited() - waited))
        if how == 'estop':
            machine.switch_on()
        return dict(served=times[0], stood=times[1], busy=busy)

    def begin(self):
        self.machine.set_mode(linuxcnc.MODE_AUTO, 'auto')
        self.machine.command.auto(linuxcnc.AUTO_RUN, 0)

    @staticmethod
    def planners():
        return sum(any(b'planner_runner.py' in word for word in processes.command_line(pid)) for pid in processes.pids())

    @staticmethod
    def kill(name):
        for process in processes.named(name):
            send(process, signal.SIGKILL)

    @staticmethod
    def waited():
        """s for which LinuxCNC and this program have waited for a processor."""
        total = 0
        for process in [os.getpid()] + processes.named('milltask', 'rtapi_app', 'io'):
            for thread in os.listdir(f'/proc/{process}/task'):
                with open(f'/proc/{process}/task/{thread}/schedstat') as handle:
                    total += int(handle.read().split()[1])
        return total / 1e9

    @staticmethod
    def monitors():
        """Processes of chipwise-monitor that live."""
        return [pid for pid in processes.pids() if processes.command_line(pid)[-1:] == [b'monitor']]

    def kill_monitor(self):
        for process in self.monitors():
            send(process, signal.SIGKILL)
        while self.monitors():
            time.sleep(0.01)

    def workers(self):
        """Those of the two that do the work: the children of the others."""
        both = self.monitors()
        return [pid for pid in both if [parent for parent in processes.stat_fields(pid)[1:2] if int(parent) in both]]

    def kill_worker(self):
        """The child of the two; the parent starts another one."""
        workers = self.workers()
        for process in workers:
            send(process, signal.SIGKILL)
        return bool(workers)

    def freeze_worker(self):
        """The process that does the work of chipwise-monitor is stopped until thaw_worker()."""
        self.frozen = self.workers()
        for process in self.frozen:
            send(process, signal.SIGSTOP)
        return len(self.frozen)

    def thaw_worker(self):
        for process in self.frozen:
            send(process, signal.SIGCONT)

    def busy(self, number):
        for _ in range(number):
            subprocess.Popen(['sh', '-c', 'while :; do :; done'], stdin=subprocess.DEVNULL)

    def hold_status(self, seconds):
        """The semaphore of emcStatus, whose key is in linuxcnc.nml."""
        libc = ctypes.CDLL(None, use_errno=True)
        number = libc.semget(STATUS_KEY, 1, 0)
        take, give = (SemaphoreOperation(0, step, 0) for step in (-1, 1))
        for operation, pause in ((take, seconds * session.SPEED), (give, 0)):
            if number < 0 or libc.semop(number, ctypes.byref(operation), 1):
                raise session.SessionError('status buffer: %s' % os.strerror(ctypes.get_errno()))
            time.sleep(pause)

    def signal_monitor(self, name):
        for process in self.monitors():
            send(process, getattr(signal, 'SIG' + name))

    def kill_monitor_in(self, line, what, seconds):
        monitors = self.monitors()
        before = set(os.listdir(what)) if what != 'hold' else ()
        self.machine.set_mode(linuxcnc.MODE_MDI, 'MDI')
        while not self.caught(line, lambda: hal.get_value('chipwise-monitor.hold') if what == 'hold' else set(os.listdir(what)) - before):
            self.errors()               # of the line that was over before this program had a look: it is begun again
        time.sleep(seconds)
        for process in monitors:
            send(process, signal.SIGKILL)
        while self.monitors():
            time.sleep(0.01)

    def caught(self, line, there):
        """Begin an MDI line; -> whether `there()` was seen before the line was over."""
        idle = 0
        self.machine.command.mdi(line)

        def seen(status):
            nonlocal idle
            idle = idle + 1 if status.echo_serial_number >= self.machine.command.serial and status.interp_state == linuxcnc.INTERP_IDLE else 0
            return idle > IDLE_POLLS or bool(there())
        self.machine.wait(line, seen, WAIT_S)
        return idle <= IDLE_POLLS

    def start_monitor(self):
        program = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'bin', 'chipwise')
        env = {name: value for name, value in os.environ.items() if name != 'INI_FILE_NAME'}
        env['PYTHONFAULTHANDLER'] = '1'         # for what_it_does()
        started = subprocess.Popen([program, 'monitor'], cwd='/', env=env, stdin=subprocess.DEVNULL)

        def ready(_status):
            states = [line.split() for line in halcmd.attempt('show', 'comp').stdout.splitlines()]
            if started.poll() is not None:
                raise session.SessionError(f'the new chipwise-monitor has ended with status {started.returncode}')
            return any(words[2].startswith('chipwise-monitor') and words[3:] == [str(started.pid), 'ready']
                       for words in states if len(words) > 3)
        try:
            self.machine.wait('a new chipwise-monitor', ready, WAIT_S)
        except session.SessionError as error:
            raise session.SessionError(f'{error}; {self.what_it_does(started.pid)}') from error

    @staticmethod
    def what_it_does(pid):
        """A process and those it started, and the components in HAL, for a failure's text; where it is in its source it prints."""
        there = [(each, processes.command_line(each), processes.stat_fields(each)[:1]) for each in [pid, *processes.descendants(pid)]]
        text = f'{there}\n{halcmd.attempt("show", "comp").stdout}'
        send(pid, signal.SIGABRT)
        return text

    def mdi_end(self):
        self.machine.wait('end of the line', lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos, WAIT_S)
        return self.errors()

    def map_sum(self):
        from chipwise.stock import shared
        stock = shared.attach()
        head, cells = stock.take()
        stock.close()
        return [zlib.crc32(cells.tobytes()), head.removed]

    def map(self, name=''):
        import numpy as np
        from chipwise.stock import shared
        if not name:
            descriptor, name = tempfile.mkstemp(suffix='.npy', dir=os.path.dirname(os.environ['CHIPWISE_ANSWERS']))
            os.close(descriptor)
        stock = shared.attach()
        seen = stock.snapshot()
        np.save(name, seen.heights)
        stock.close()
        return [seen.removed, name]

    def estop(self):
        self.machine.command.state(linuxcnc.STATE_ESTOP)
        self.machine.wait('E-stop', lambda s: s.task_state == linuxcnc.STATE_ESTOP and s.current_vel < 1e-9)
        time.sleep(0.1)

    def off(self):
        self.machine.command.state(linuxcnc.STATE_OFF)
        self.machine.wait('off', lambda s: s.task_state != linuxcnc.STATE_ON and s.current_vel < 1e-9)
        time.sleep(0.1)

    def on(self):
        self.machine.switch_on()

    def finish(self):
        self.machine.wait('end of program', lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos, WAIT_S)
        return self.errors()

    def over(self, seconds, *pins):
        if all(pin in self.record.columns for pin in pins):
            return self.record.span(seconds, pins)
        end, found = time.monotonic() + seconds, [[float('inf'), float('-inf')] for _ in pins]
        while time.monotonic() < end:
            for span, pin in zip(found, pins):
                value = float(hal.get_value(pin))
                span[:] = min(span[0], value), max(span[1], value)
            time.sleep(0.001)
        return found

    def feed_override(self, factor):
        self.machine.command.feedrate(factor)
        self.machine.wait('feed override', lambda s: abs(s.feedrate - factor) < 1e-6)

    @staticmethod
    def program(*words):
        done = subprocess.run(words, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        return [done.returncode, done.stdout]

    def hal(self, *words):
        return halcmd.attempt(*words).stdout.strip()

    def enter(self, text, *arguments):
        command = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', '..', 'bin', 'chipwise')
        done = subprocess.run([command, 'enter', *arguments], input=text, text=True, capture_output=True, check=False)
        return [done.returncode, done.stdout, done.stderr]


def main():
    steps = json.loads(os.environ['CHIPWISE_STEPS'])
    operator = Operator(steps)
    answers = []
    try:
        for name, *arguments in steps:
            if name in BEGINNING:
                operator.record.now()
            answers.append(getattr(operator, name.replace(' ', '_'))(*arguments))
            if name not in BEGINNING + LOOKING:
                operator.record.now()
    except (session.SessionError, RecordError) as error:
        answers.append('failed: %s' % error)
    operator.record.close()
    with open(os.environ['CHIPWISE_ANSWERS'], 'w') as handle:
        json.dump(answers, handle)


if __name__ == '__main__':
    main()
