"""Live rig: plant and sensors simulated along a clock, with commands at any time.

A thread advances the plant in batches of some milliseconds. Sample grid and channels are those of an offline run,
so the same commands and seed give the same readings. The amplifier updates its output, and the drive its demand,
once per sample. Old samples are discarded.
"""

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sim_rig.errors import CommandsError
from sim_rig.live.clock import RigClock
from sim_rig.live.command_queue import LinearInterpolator, ZeroOrderHold
from sim_rig.live.interface import TimeArray
from sim_rig.live.sample_buffer import RingBuffer
from sim_rig.plant import Array, TrueSignals, make_plant
from sim_rig.scenario import Scenario
from sim_rig.sensors import (
    ChannelStream,
    add_shunt,
    apply_channel_faults,
    compute_true_values,
    make_streams,
    select_faults,
)

SAMPLE_PERIOD_NS = 1_000_000
"""[ns] sample period of the rig."""
TRANSITION_NS = 4_000_000
"""[ns] over which the actuator follows a demand; a demand handed over later than this acts too late."""
_IDLE_AFTER_NS = 2_000_000_000
"""Threshold on the time without a command [ns]: above it, the rig is idle."""
_IDLE_BATCHES = 4
"""Batches simulated together while idle: larger batches save processor time."""
_MAX_SAMPLES = 200
"""Largest number of samples simulated at once, even if the thread is late."""
_BUFFER_SAMPLES = 8192
"""Samples of each channel that instruments can read back."""
_TRUTH_SAMPLES = 10_000
"""Samples of the true signals that are kept."""


class TruthRecord(NamedTuple):
    """True signals from an instant on."""

    start_ns: int
    """On the rig's clock [ns]."""
    truth: TrueSignals


class LiveRig:
    """Specimen and rig along a clock, a context manager; implements `RigInterface`."""

    def __init__(
        self,
        scenario: Scenario,
        clock: RigClock,
        displacement: float = 0.0,
        drive: float = 0.0,
        batch: int = 2,
    ) -> None:
        """Settle the specimen at the clock's present instant; nothing moves before `start` or `catch_up`.

        Args:
            scenario: damper, effects, sensors and faults.
            clock: the rig's time.
            displacement: [m] of the actuator.
            drive: [V or A] of the amplifier.
            batch: samples that the thread simulates together; more for an accelerated clock.

        Raises:
            PlantError: the effects have no finite force there.
        """
        self.periodic_tasks: Sequence[Callable[[], object]] = ()
        """Functions for devices that act by time: called once per batch, and twice while one returns True."""
        self.failure: Exception | None = None
        """Error by which the thread ended, if it did."""
        self.lag_ns = 0
        """[ns] by which the plant was behind the clock after the last batch."""
        self._clock, self._scenario, self._batch_ns = clock, scenario, batch * SAMPLE_PERIOD_NS
        self._origin = self._simulated_ns = self._last_command_ns = clock.now_ns()
        self._plant = make_plant(scenario, displacement, drive)
        self._channels = {
            name: _Channel(scenario, name, stream, self._origin)
            for name, stream in make_streams(scenario, SAMPLE_PERIOD_NS * 1e-9, mapped=False)[0].items()
        }
        self._displacement = LinearInterpolator(displacement, TRANSITION_NS)
        self._drive, self._shunt = ZeroOrderHold(drive), ZeroOrderHold(0.0)
        self._truth: deque[TruthRecord] = deque()
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="plant", daemon=True)

    def now_ns(self) -> int:
        """Return the rig's clock [ns]."""
        return self._clock.now_ns()

    def read_latest(self, channel: str, count: int, before_ns: int) -> tuple[TimeArray, Array]:
        """Return the newest samples of a channel, see `RigInterface`."""
        with self._lock:
            return self._channels[channel].buffer.read_latest(count, before_ns)

    def schedule_position(self, position: float, at_ns: int, since_ns: int) -> None:
        """Command a displacement [m] for a future instant [ns], by a straight line from ``since_ns`` [ns] on."""
        self._last_command_ns = self._clock.now_ns()
        with self._lock:
            self._displacement.add(at_ns, position, since_ns)

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        """Command ``displacement`` [m], ``drive`` [V or A] or ``shunt`` [N] from an instant [ns] on; None for now.

        Raises:
            CommandsError: there is no such command, or the value is not finite.
        """
        signals: dict[str, LinearInterpolator | ZeroOrderHold] = {
            "displacement": self._displacement,
            "drive": self._drive,
            "shunt": self._shunt,
        }
        if channel not in signals:
            raise CommandsError(f"the rig takes no command {channel!r}; it takes {', '.join(signals)}")
        if not math.isfinite(value):
            raise CommandsError(f"the commanded {channel} is {value}; it must be finite")
        self._last_command_ns = self._clock.now_ns()
        with self._lock:
            signals[channel].add(self._clock.now_ns() if at_ns is None else at_ns, value)

    def read_truth(self) -> TruthRecord:
        """Return the true signals of the last ten seconds or so, for tests and measurements only."""
        with self._lock:
            records = list(self._truth)
        if not records:
            return TruthRecord(self._origin, TrueSignals(*(np.empty(0) for _ in TrueSignals._fields)))
        parts = zip(*(record.truth for record in records), strict=True)
        return TruthRecord(records[0].start_ns, TrueSignals(*(np.concatenate(part) for part in parts)))

    def catch_up(self) -> None:
        """Advance the plant to the present instant; called by the thread, or by a test without it.

        Raises:
            PlantError: the motion is not finite.
        """
        now = self._clock.now_ns()
        # In chunks, so that a stop need not wait for a plant that is far behind.
        while (
            count := min((now - self._simulated_ns) // SAMPLE_PERIOD_NS, _MAX_SAMPLES)
        ) > 0 and not self._stopping.is_set():
            self._simulate(int(count))
        self.lag_ns = self._clock.now_ns() - self._simulated_ns

    def start(self) -> "LiveRig":
        """Start the thread that follows the clock."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """Stop the thread; harmless when repeated."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()

    def __enter__(self) -> "LiveRig":
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _run(self) -> None:
        due = self._clock.now_ns()
        try:
            while not self._stopping.is_set():
                if not self._clock.wait_until(due):
                    continue
                idle = due - self._last_command_ns > _IDLE_AFTER_NS
                changes = [run_task() for run_task in self.periodic_tasks]
                batch_ns = self._batch_ns * (_IDLE_BATCHES if idle else 1)
                if self._clock.now_ns() - self._simulated_ns >= batch_ns:
                    self.catch_up()
                complete = self._simulated_ns + batch_ns
                # An idle rig looks for a command, which ends the larger batches, as often as for changes.
                turn = min(complete, due + self._batch_ns // 2) if idle or any(changes) else complete
                # Missed turns are not repeated: `catch_up` simulates all that is due at once.
                due = max(turn, self._clock.now_ns())
        except Exception as error:  # reported by the process that runs the rig
            self.failure = error

    def _simulate(self, count: int) -> None:
        """Simulate the next samples, all before the present instant."""
        edges = self._simulated_ns + SAMPLE_PERIOD_NS * np.arange(count + 1)
        with self._lock:
            command, drive = self._displacement.evaluate(edges), self._drive.evaluate(edges[:-1])
            shunt = self._shunt.evaluate(edges[:-1])
        # Without the lock, so that instruments can read samples meanwhile.
        truth = self._plant.simulate(SAMPLE_PERIOD_NS * 1e-9, command, drive)
        start = (self._simulated_ns - self._origin) * 1e-9
        true_values = compute_true_values(self._scenario, truth, start, SAMPLE_PERIOD_NS * 1e-9)
        true_values = add_shunt(true_values, shunt)
        for name, channel in self._channels.items():
            times, values = channel.convert(true_values[name])
            with self._lock:
                channel.buffer.add(times, values)
        with self._lock:
            self._truth.append(TruthRecord(self._simulated_ns, truth))
            while self._simulated_ns - self._truth[0].start_ns > _TRUTH_SAMPLES * SAMPLE_PERIOD_NS:
                self._truth.popleft()
        self._simulated_ns = int(edges[-1])


class _Channel:
    """One channel with its newest readings and its faults."""

    def __init__(self, scenario: Scenario, name: str, stream: ChannelStream, origin_ns: int) -> None:
        self.buffer = RingBuffer(_BUFFER_SAMPLES)
        self._stream, self._origin = stream, origin_ns
        self._faults = select_faults(scenario, name)
        self._last = math.nan

    def convert(self, true_values: Array) -> tuple[TimeArray, Array]:
        """Return the readings that further true values allow: instants [ns] and values."""
        self._stream.feed(true_values)
        ready = self._stream.count_ready()
        if not ready:
            return np.empty(0, np.int64), np.empty(0)
        stamps, values = self._stream.make_readings(ready)
        if self._faults:
            values = apply_channel_faults(self._faults, stamps, values, self._last)
            self._last = float(values[-1])
        return self._origin + np.rint(stamps * 1e9).astype(np.int64), values
