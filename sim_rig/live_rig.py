"""The rig in motion: plant and sensors along a clock, commands taken as they come.

A thread of its own steps the plant in blocks of some milliseconds, on the same grid of samples and through the
same channels as a run on files, so the same commands and seed give the same readings. The amplifier updates its
output, and the drive its demand, once a sample. What lies far enough back is forgotten.
"""

import math
import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sim_rig.channel import ChannelStream
from sim_rig.clock import Clock
from sim_rig.command_track import HeldTrack, JoinedTrack
from sim_rig.compiled import Array
from sim_rig.errors import CommandsError
from sim_rig.plant import Truth
from sim_rig.recent import Recent
from sim_rig.scenario import Scenario
from sim_rig.sealed_plant import plant_for
from sim_rig.sensors import failed, faults_of, looked_at, streams

STEP_NS = 1_000_000
"""[ns] a sample of the rig."""
TAKE_UP_NS = 4_000_000
"""[ns] over which the actuator takes up a demand: as late may the thread that hands it over be, and no more."""
_CALM_NS = 2_000_000_000
"""[ns] without a command after which the rig counts as calm."""
_CALM_BLOCK = 4
"""Blocks that come together while it is calm: nobody is in a hurry, and the machine has other work."""
_LONGEST = 200
"""Samples played at once, however late the thread is."""
_KEPT = 8192
"""Samples of each channel that may be asked for."""
_TRUTH_KEPT = 10_000
"""Samples of the truth that are kept."""


class Stretch(NamedTuple):
    """A part of what happened."""

    start_ns: int
    """On the rig's clock [ns]."""
    truth: Truth


class LiveRig:
    """The specimen on its rig, for the instruments: the `Signals` of `sim_rig.signals`. A context manager."""

    def __init__(
        self,
        scenario: Scenario,
        clock: Clock,
        displacement: float = 0.0,
        drive: float = 0.0,
        block: int = 2,
    ) -> None:
        """Settle the specimen at the clock's present instant; nothing moves before `start` or `catch_up`.

        Args:
            scenario: what is real.
            clock: the rig's time.
            displacement: [m] where the actuator stands.
            drive: [V or A] of the amplifier.
            block: samples that the thread lets come together; more where the clock runs fast.

        Raises:
            PlantError: the effects have no finite force there.
        """
        self.attend: Sequence[Callable[[], object]] = ()
        """Called by the thread twice a block: devices that act by the time."""
        self.failure: Exception | None = None
        """Why the thread has ended by itself, if it has."""
        self.behind_ns = 0
        """[ns] by which the plant was behind the clock when last looked at."""
        self._clock, self._scenario, self._block_ns = clock, scenario, block * STEP_NS
        self._origin = self._done = self._commanded_ns = clock.now_ns()
        self._plant = plant_for(scenario, displacement, drive)
        self._channels = {
            name: _Channel(scenario, name, stream, self._origin)
            for name, stream in streams(scenario, STEP_NS * 1e-9, mapped=False)[0].items()
        }
        self._displacement = JoinedTrack(displacement, TAKE_UP_NS)
        self._drive = HeldTrack(drive)
        self._truth: deque[Stretch] = deque()
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="plant", daemon=True)

    def now_ns(self) -> int:
        """The rig's clock [ns]."""
        return self._clock.now_ns()

    def latest(
        self, channel: str, count: int, before_ns: int
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """The newest samples of a channel, as `sim_rig.signals.Signals` says."""
        with self._lock:
            return self._channels[channel].recent.latest(count, before_ns)

    def lead(self, position: float, at_ns: int, since_ns: int) -> None:
        """Command a displacement [m] for an instant [ns] to come, straight from where it is to be ``since_ns``."""
        self._commanded_ns = self._clock.now_ns()
        with self._lock:
            self._displacement.add(at_ns, position, since_ns)

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        """Command ``displacement`` [m] or ``drive`` [V or A] from an instant [ns] on, now if none is given.

        Raises:
            CommandsError: there is no such command, or the value is not finite.
        """
        if channel not in ("displacement", "drive"):
            raise CommandsError(f"the rig takes no command {channel!r}; it takes displacement and drive")
        if not math.isfinite(value):
            raise CommandsError(f"the commanded {channel} is {value}; it has to be finite")
        track = self._displacement if channel == "displacement" else self._drive
        self._commanded_ns = self._clock.now_ns()
        with self._lock:
            track.add(self._clock.now_ns() if at_ns is None else at_ns, value)

    def truth(self) -> Stretch:
        """What happened in the last ten seconds or so: for tests and measurements, never for an instrument."""
        with self._lock:
            kept = list(self._truth)
        if not kept:
            return Stretch(self._origin, Truth(*(np.empty(0) for _ in Truth._fields)))
        parts = zip(*(stretch.truth for stretch in kept), strict=True)
        return Stretch(kept[0].start_ns, Truth(*(np.concatenate(part) for part in parts)))

    def catch_up(self) -> None:
        """Let the plant move on to the present instant: the thread's work, or that of a test without it.

        Raises:
            PlantError: the motion is not finite.
        """
        now = self._clock.now_ns()
        # In pieces: a stop does not wait for a plant that is far behind.
        while (count := min((now - self._done) // STEP_NS, _LONGEST)) > 0 and not self._stopping.is_set():
            self._move(int(count))
        self.behind_ns = self._clock.now_ns() - self._done

    def start(self) -> "LiveRig":
        """Follow the clock from now on."""
        self._thread.start()
        return self

    def stop(self) -> None:
        """Stop following it; harmless when repeated."""
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
                for attend in self.attend:
                    attend()
                calm = due - self._commanded_ns > _CALM_NS
                if due - self._done >= self._block_ns * (_CALM_BLOCK if calm else 1):
                    self.catch_up()
                # Late turns are not made up for one by one: `catch_up` plays all that is due at once.
                due = max(due + self._block_ns // 2, self._clock.now_ns())
        except Exception as error:  # the thread's end is looked at by whoever runs the rig
            self.failure = error

    def _move(self, count: int) -> None:
        """Play the next samples, which all lie before now."""
        edges = self._done + STEP_NS * np.arange(count + 1)
        with self._lock:
            command, drive = self._displacement.at(edges), self._drive.at(edges[:-1])
        # Without the lock: the instruments ask for samples meanwhile.
        truth = self._plant.play(STEP_NS * 1e-9, command, drive)
        start = (self._done - self._origin) * 1e-9
        seen = looked_at(self._scenario, truth, start, STEP_NS * 1e-9)
        for name, channel in self._channels.items():
            times, values = channel.report(seen[name])
            with self._lock:
                channel.recent.add(times, values)
        with self._lock:
            self._truth.append(Stretch(self._done, truth))
            while self._done - self._truth[0].start_ns > _TRUTH_KEPT * STEP_NS:
                self._truth.popleft()
        self._done = int(edges[-1])


class _Channel:
    """One channel with its newest readings."""

    def __init__(self, scenario: Scenario, name: str, stream: ChannelStream, origin_ns: int) -> None:
        self.recent = Recent(_KEPT)
        self._stream, self._origin = stream, origin_ns
        self._faults = faults_of(scenario, name)
        self._last = math.nan

    def report(self, truth: Array) -> tuple[npt.NDArray[np.int64], Array]:
        """The readings that more truth allows: instants [ns] and values."""
        self._stream.take(truth)
        ready = self._stream.ready()
        if not ready:
            return np.empty(0, np.int64), np.empty(0)
        stamps, values = self._stream.make(ready)
        if self._faults:
            values = failed(self._faults, stamps, values, self._last)
            self._last = float(values[-1])
        return self._origin + np.rint(stamps * 1e9).astype(np.int64), values
