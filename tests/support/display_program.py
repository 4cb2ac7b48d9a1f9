# SPDX-License-Identifier: GPL-2.0-or-later
"""Steps of scripted_display.py that run a program and stop it: as the buttons of a screen do.  Its head says what each
step is."""

import operator as relations
import tempfile
import time

import hal
import linuxcnc

from chipwise.headless import session

IDLE_POLLS = 20  # a program that has been idle so often is over, however short it was
# In real time, however fast the clock is: a busy computer takes that longer.
WAIT_S = 400 * session.SPEED  # for a step
REST_LOOKS = 4  # at a machine at rest, one after the other, each after a servo period: see rest()
RELATIONS = {">": relations.gt, "<": relations.le, "=": relations.eq}
PERIOD_PIN = "motion-controller.time"  # of the last servo period, ns: never twice the same but by chance
RUNNING_PIN = "chipwise-monitor.program-running"
REST_PIN, VELOCITY_PIN = "motion.in-position", "motion.current-vel"
STEP_TURNS = 20  # of the task, in which a single step has begun


class ProgramSteps:
    """Of an Operator, which has a machine (chipwise.headless.session) and a record (servo_record.py)."""

    def taken(self):
        """Wait until the task has the last command, in whose place it would get the next one."""
        machine = self.machine
        machine.wait("the task has the command", lambda s: s.echo_serial_number >= machine.command.serial, WAIT_S)

    def open(self, program):
        self.machine.open(program)

    def run_from(self, line=0):
        self.machine.set_mode(linuxcnc.MODE_AUTO, "auto")
        self.run(line)

    def run_until_stopped(self, seconds, line=0):
        self.run_from(line)
        end, idle = time.monotonic() + max(seconds, WAIT_S), 0
        while time.monotonic() < end and idle < IDLE_POLLS:
            self.machine.poll()
            status = self.machine.status
            if self.pins("chipwise-guard.0.stop") == ["TRUE"]:
                self.machine.wait("stand", lambda s: s.current_vel == 0)
                time.sleep(0.2)
                self.monitor_looks()  # and says why, before an abort ends the reason
                return True
            idle = idle + 1 if status.interp_state == linuxcnc.INTERP_IDLE and status.inpos else 0
            time.sleep(0.01)
        return False

    def run_until(self, axis, value):
        self.run_from()
        self.machine.wait("axis %d at %g" % (axis, value), lambda s: s.position[axis] > value, WAIT_S)

    def start(self, text):
        self.open_text(text)
        self.run()

    def open_text(self, text):
        with tempfile.NamedTemporaryFile("w", suffix=".ngc", delete=False) as program:
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

        self.machine.wait("start", started)

    def until(self, pin, relation, number):
        holds = RELATIONS[relation]
        if pin in self.record.columns:
            self.machine.wait(
                f"{pin} {relation} {number}", self.record.first(pin, lambda value: holds(value, number)), WAIT_S
            )
            return self.record.row(self.record.mark)[self.record.columns[pin]]
        self.machine.wait(f"{pin} {relation} {number}", lambda _s: holds(hal.get_value(pin), number), WAIT_S)
        self.record.now()
        return hal.get_value(pin)

    @staticmethod
    def stands(status):
        """Whether nothing moves, in the status and as the servo thread has it: one may be behind the other."""
        return status.current_vel < 1e-9 and hal.get_value(VELOCITY_PIN) < 1e-9

    def pause(self):
        self.machine.command.auto(linuxcnc.AUTO_PAUSE)
        self.machine.wait("pause", lambda s: s.paused and self.stands(s))

    def until_paused(self):
        self.machine.wait(
            "a pause of the program", lambda s: s.interp_state == linuxcnc.INTERP_PAUSED and self.stands(s), WAIT_S
        )

    def optional_stop(self, stops):
        self.machine.command.set_optional_stop(stops)
        self.machine.wait("optional stop", lambda s: s.optional_stop == stops)

    def resume(self):
        self.machine.command.auto(linuxcnc.AUTO_RESUME)
        self.machine.wait("resume", lambda s: not s.paused)

    def rest(self, what):
        """Wait until the line or program is over and the axes rest.

        A machine that has taken a move and not begun it looks like one at rest, for as long as a busy computer lets the
        task or the servo thread wait.  So it has to rest in several looks, between which the servo thread has been at
        work; it says itself whether it has a move that the task's status does not show yet."""
        looks, period = 0, None

        def at_rest(status):
            nonlocal looks, period
            before, period = period, hal.get_value(PERIOD_PIN)
            rests = session.is_at_rest(status) and hal.get_value(REST_PIN)
            looks = looks + (period != before) if rests else 0
            return looks >= REST_LOOKS

        self.machine.wait(what, at_rest, WAIT_S)

    def end_is_seen(self):
        """Wait until chipwise-monitor knows that no program runs, which a busy computer lets it see long after the
        task's status says so."""
        self.follow_monitor(lambda: not hal.get_value(RUNNING_PIN))
        time.sleep(0.02)  # and a few servo periods more for those that read the pin

    def reverse(self):
        self.machine.command.auto(linuxcnc.AUTO_REVERSE)
        self.taken()

    def forward(self):
        self.machine.command.auto(linuxcnc.AUTO_FORWARD)
        self.taken()

    def step_to_end(self, most=20):
        """Single steps until the program has ended; -> how many."""
        for count in range(1, most + 1):
            self.machine.command.auto(linuxcnc.AUTO_STEP)
            self.taken()  # not wait_complete(): the task calls a program in single steps under way until its end
            self.record.now()
            self.sleep(0.2)
            self.task_looks(STEP_TURNS)
            self.machine.wait("step", self.stands, WAIT_S)
            if self.machine.status.interp_state == linuxcnc.INTERP_IDLE:
                self.end_is_seen()
                return count
        return None

    def abort(self):
        self.machine.command.abort()
        self.taken()
        self.machine.wait(
            "abort", lambda s: s.interp_state == linuxcnc.INTERP_IDLE and s.inpos and hal.get_value(REST_PIN)
        )
        self.end_is_seen()

    def stop(self, how, seconds):
        machine = self.machine
        machine.set_mode(linuxcnc.MODE_AUTO, "auto")
        machine.command.auto(linuxcnc.AUTO_RUN, 0)
        time.sleep(seconds)
        machine.poll()
        busy = machine.status.interp_state != linuxcnc.INTERP_IDLE
        waited, began = self.waited(), time.monotonic()
        if how == "abort":
            machine.command.abort()
        else:
            machine.command.state(linuxcnc.STATE_ESTOP)
        times = []
        for done in (
            lambda s: (
                s.task_state == linuxcnc.STATE_ESTOP if how == "estop" else s.interp_state == linuxcnc.INTERP_IDLE
            ),
            lambda s: s.current_vel == 0,
        ):
            while True:
                machine.poll()
                if done(machine.status) or time.monotonic() - began > WAIT_S:
                    break
                time.sleep(0.002)
            times.append(time.monotonic() - began - (self.waited() - waited))
        if how == "estop":
            machine.switch_on()
        return dict(served=times[0], stood=times[1], busy=busy)

    def begin(self):
        self.machine.set_mode(linuxcnc.MODE_AUTO, "auto")
        self.machine.command.auto(linuxcnc.AUTO_RUN, 0)
        self.taken()

    def finish(self):
        self.rest("end of program")
        self.end_is_seen()
        return self.errors()

    def over(self, seconds, *pins):
        if all(pin in self.record.columns for pin in pins):
            return self.record.span(seconds, pins)
        end, found = time.monotonic() + seconds, [[float("inf"), float("-inf")] for _ in pins]
        while time.monotonic() < end:
            for span, pin in zip(found, pins):
                value = float(hal.get_value(pin))
                span[:] = min(span[0], value), max(span[1], value)
            time.sleep(0.001)
        return found
