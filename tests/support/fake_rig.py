"""Fakes of the parts of a bench: instruments, guard, observer, clock map and recording thread.

Fake instruments append their calls to one list, which tests pass in to check the order.
"""

import threading
import time
from types import SimpleNamespace

import numpy as np

from bench.errors import InterlockError
from drivers.channel import Channel
from drivers.errors import RefusedError
from drivers.modbus.step_table import TableProgress, TableState

BENCH_TOML = """
[instruments]
drive = { driver = "actuator", interface = "socketcan" }
cell = { driver = "load_cell", url = "/dev/ttyUSB0" }
lvdt = { driver = "lvdt", url = "tcp://10.0.0.6" }
coil = { driver = "coil_amplifier", url = "tcp://10.0.0.7" }
"""
CYCLE = 0.004


class FakeActuator:
    """Actuator that keeps its setpoints and the instants at which they are due."""

    name = "actuator"
    unconfirmed = ""
    """Reason why the rest is not confirmed."""

    def __init__(self, calls=None, setpoint_timeout=0.2, refuses_at=None):
        self.settings = SimpleNamespace(cycle=CYCLE, setpoint_timeout=setpoint_timeout, max_speed=1.0)
        self.channels = (Channel("actuator_position", "m", -0.01, 0.01, "read_write", "rod"),)
        self.calls = [] if calls is None else calls
        self.positions, self.due_ns, self.refuses_at = [], [], refuses_at
        self.moving = threading.Event()

    def arm(self):
        self.calls.append("actuator armed")
        return 0.0

    def send_setpoint(self, position, due_ns):
        if len(self.positions) == self.refuses_at:
            raise RefusedError("actuator: the drive has stopped by itself")
        self.positions.append(position)
        self.due_ns.append(due_ns)
        if len(self.positions) == 30:
            self.moving.set()

    def read(self, channel):
        return SimpleNamespace(value=self.positions[-1] if self.positions else 0.0)

    def disable(self):
        self.calls.append("actuator disabled")

    def make_safe(self):
        self.calls.append("actuator safe")
        return self.unconfirmed

    def reset(self):
        self.calls.append("actuator reset")


class FakeAmplifier:
    """Coil amplifier with a table in a given state; arming takes a given time [s]."""

    name, table_capacity, unconfirmed = "amplifier", 500, ""

    def __init__(self, calls=None, state=TableState.RUNNING, output=0.0, arming_time=0.0):
        self.calls = [] if calls is None else calls
        self.state, self.output, self.arming_time = state, output, arming_time
        self.uploaded = None

    def upload_table(self, times, levels):
        self.calls.append("table uploaded")
        self.uploaded = times, levels

    def arm_table(self):
        time.sleep(self.arming_time)
        self.calls.append("table armed")

    def abort_table(self):
        self.calls.append("table aborted")

    def read_table_progress(self):
        return TableProgress(self.state, None)

    def make_safe(self):
        return self.ramp_down()

    def ramp_down(self):
        self.calls.append("coil safe")
        return self.unconfirmed

    def read_status(self):
        return SimpleNamespace(output=self.output)

    def reset(self):
        self.calls.append("coil reset")


class FakeLoadCell:
    """Load cell with a shunt; `refusal` is raised by every command, `late_refusal` by all but the first."""

    name, longest_shunt = "cell", 60.0

    def __init__(self, calls=None, force=1000.0, refusal=None, late_refusal=None):
        self.calls = [] if calls is None else calls
        self.force, self.refusals = force, [refusal, late_refusal or refusal]
        self.is_on, self.durations = False, []

    def switch_shunt_on(self, duration):
        self.durations.append(duration)
        return self._switch(True)

    def switch_shunt_off(self):
        return self._switch(False)

    def _switch(self, is_on):
        self.calls.append(f"shunt {'on' if is_on else 'off'}")
        refusal = self.refusals.pop(0) if len(self.refusals) > 1 else self.refusals[0]
        if refusal is not None:
            raise refusal
        self.is_on = is_on
        return self.force


class FakeGuard:
    """Guard that permits everything until a trip."""

    trip_reason = ""

    def permit(self, position=None, drive=None):
        if self.trip_reason:
            raise InterlockError(self.trip_reason)


class FakeObserver:
    """Observer that keeps the events of a run (`bench.sequencer.RunObserver`)."""

    def __init__(self, calls=None):
        self.calls = [] if calls is None else calls
        self.states, self.active, self.delays, self.failures = [], [], [], []

    def on_state(self, text):
        self.states.append(text)

    def on_setpoints_active(self, active):
        self.active.append(active)

    def on_arrived(self):
        self.calls.append("arrived")

    def on_late_setpoint(self, now_ns, delay):
        self.delays.append(delay)

    def on_setpoints_failed(self, reason):
        self.failures.append(reason)


class FakeClockMap:
    """Known clock map with a constant offset [ns]."""

    is_known = True

    def __init__(self, offset_ns):
        self.offset_ns = offset_ns

    def map_instants(self, device_ns):
        return np.asarray(device_ns) + self.offset_ns


class FakeRecordingThread:
    """Recording thread that receives no samples."""

    newest_ns = 0

    def __init__(self, lost=None):
        self.recording, self.lost = None, lost or {}

    def start_recording(self, recording):
        self.recording = recording

    def count_lost(self):
        return dict(self.lost)

    def finish_recording(self):
        self.recording = None
        return dict(self.lost)


class EventLog:
    """Receiver of events (`bench.recorder.EventReporter`) that keeps kind, text and details."""

    def __init__(self):
        self.events = []

    def __call__(self, kind, text, time_ns=None, **details):
        self.events.append((kind, text, details))

    def list_texts(self, kind):
        return [text for one, text, _ in self.events if one == kind]


def step_cycles(generator, start_ns, cycles, jitter=0):
    """Step a generator through cycles that are late by up to a jitter [ns]; return the next instant [ns]."""
    random = np.random.default_rng(5)
    cycle_ns = round(CYCLE * 1e9)
    for cycle in range(cycles):
        delay = int(random.integers(0, jitter)) if jitter else 0
        generator.step(start_ns + cycle * cycle_ns + delay)
    return start_ns + cycles * cycle_ns
