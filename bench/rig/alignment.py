"""Blocks of all instruments onto one time base: that of the force.

The bench samples stand at the load cell's own conversions, so force is never interpolated (decision 0008). What
else is measured is brought there: displacement and rod position along a cubic through their neighbours, voltage
and current along straight lines, the temperature as last read. Velocity is the slope of the displacement's own
samples.

Nothing is invented: where a channel has no samples close by, its value is missing, and counted.
"""

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from bench.rig.acquisition import Batch
from bench.rig.clock_map import ClockMap
from bench.rig.track import Instants, Numbers, Track
from drivers.channel import Block

DriveChannel: TypeAlias = Literal["coil_voltage", "coil_current"]

PATIENCE_NS = 1_000_000_000
"""[ns] by which a channel may be behind the force before its values count as missing."""
LONGEST_GAP_NS = {
    "displacement": 10_000_000,
    "force_raw": 10_000_000,
    "coil_voltage": 20_000_000,
    "coil_current": 20_000_000,
    "actuator_position": 120_000_000,
    "temperature": 5_000_000_000,
}
"""[ns] across which a value is made from a channel's samples; these are the channels that are aligned."""
SMOOTH = ("displacement", "actuator_position")
"""Channels that follow a cubic between their samples."""
HELD = ("temperature",)
"""Channels that keep their last value; nobody waits for them."""
_CONTEXT_NS = 60_000_000
"""[ns] of each channel that is kept behind the last bench sample."""
_BATCHES = 8192
"""Batches that wait at most; what is pushed out shows as a gap in the running numbers."""


@dataclass(frozen=True)
class AlignedSamples:
    """Bench samples, ready to be recorded."""

    time_ns: Instants
    """Bench clock [ns], increasing, shape (samples,)."""
    columns: dict[str, Numbers]
    """By field of `bench.recorder.messages.Sample`, each of shape (samples,); NaN where there is no value, but
    never in displacement, velocity, force and coil_drive."""


class Aligner:
    """Takes batches from any thread, hands out bench samples on one."""

    def __init__(self, maps: Mapping[str, ClockMap], drive_channel: DriveChannel) -> None:
        """Nothing has come yet.

        Args:
            maps: clock of each instrument, by name, as `bench.rig.acquisition.Acquisition` keeps them.
            drive_channel: the channel that drives the damper.
        """
        self._maps = maps
        self._drive: str = drive_channel
        self._waiting: deque[Batch] = deque(maxlen=_BATCHES)
        self._tracks: dict[str, Track] = {}
        self._source: dict[str, str] = {}
        self._expected: int | None = None
        self._begin: int | None = None
        self._done = -1
        self._lost: Counter[str] = Counter()

    @property
    def lost(self) -> dict[str, int]:
        """Bench samples that lack a channel, by channel; under ``force``, those that never came or were bad."""
        return dict(self._lost)

    def feed(self, batch: Batch) -> None:
        """Take a batch; never blocks."""
        self._waiting.append(batch)

    def ready(self, *, final: bool = False) -> AlignedSamples | None:
        """The bench samples that all channels have passed since the last call; none if there are none.

        Args:
            final: whether nothing more will come: then what is there has to do.
        """
        self._take_waiting()
        force = self._tracks.get("force")
        if force is None or not force.size or not self._has_begun(force):
            return None
        stop = int(np.searchsorted(force.time_ns, self._limit(force.newest, final), side="right"))
        start = int(np.searchsorted(force.time_ns, self._done, side="right"))
        if stop <= start:
            return None
        instants, values = force.time_ns[start:stop], force.values[start:stop]
        self._done = int(instants[-1])
        aligned = self._whole(instants, self._columns(instants, values))
        for track in self._tracks.values():
            track.forget(self._done - _CONTEXT_NS)
        return aligned if aligned.time_ns.size else None

    # What comes in

    def _take_waiting(self) -> None:
        stamped: dict[tuple[str, str], list[Block]] = {}
        for _ in range(len(self._waiting)):
            batch = self._waiting.popleft()
            for block in batch.blocks:
                if self._has_clock(batch.instrument, block):
                    stamped.setdefault((batch.instrument, block.channel), []).append(block)
        for (instrument, channel), blocks in stamped.items():
            self._add(instrument, channel, blocks)

    def _has_clock(self, instrument: str, block: Block) -> bool:
        """Whether a block's samples are wanted and have a clock; those that have none are taken at once."""
        wanted = block.channel == "force" or block.channel in LONGEST_GAP_NS
        # Of two instruments that measure the same, the first that spoke has the channel from then on.
        if not wanted or self._source.setdefault(block.channel, instrument) != instrument:
            return False
        if block.channel == "force":
            self._count(block)
        track = self._tracks.setdefault(block.channel, Track())
        if block.quality != "bad" and block.device_ns is None:
            track.add(track.spread(block.received_ns, len(block.values)), block.values)
        return block.quality != "bad" and block.device_ns is not None

    def _add(self, instrument: str, channel: str, blocks: list[Block]) -> None:
        """Samples by the instrument's own clock, all of a turn at once: most blocks hold but one or two."""
        clock = self._maps.get(instrument)
        if clock is not None and clock.known:
            device_ns = np.concatenate([block.device_ns for block in blocks if block.device_ns is not None])
            values = np.concatenate([block.values for block in blocks])
            self._tracks[channel].add(clock.bench_ns(device_ns), values)

    def _count(self, block: Block) -> None:
        """Force samples that never came, or came to nothing, since the first bench sample."""
        if self._begin is not None:
            gap = 0 if self._expected is None else max(block.first - self._expected, 0)
            self._lost["force"] += gap + (len(block.values) if block.quality == "bad" else 0)
        self._expected = block.first + len(block.values)

    def _has_begun(self, force: Track) -> bool:
        """Bench samples begin where all that each of them must have is there."""
        if self._begin is not None:
            return True
        first = [track.first for name in self._required() if (track := self._tracks.get(name)) and track.size]
        if len(first) < len(self._required()) and force.newest - force.first <= PATIENCE_NS:
            return False
        self._begin = max([force.first, *first])
        self._done = self._begin - 1
        return True

    def _required(self) -> tuple[str, str]:
        return "displacement", self._drive

    # What goes out

    def _limit(self, newest: int, final: bool) -> int:
        """[ns] that all channels have passed, but for those that are too far behind to be waited for."""
        limit = newest
        for name, track in self._tracks.items():
            if name == "force" or name in HELD or not track.size:
                continue
            # Velocity is the displacement's slope, which needs samples on both sides of an instant.
            reach = track.newest if final or name != "displacement" else track.newest - track.half_window
            if newest - reach <= PATIENCE_NS and not final:
                limit = min(limit, reach)
        return limit

    def _columns(self, instants: Instants, force: Numbers) -> dict[str, Numbers]:
        columns = {"force": force}
        for name, gap in LONGEST_GAP_NS.items():
            track = self._tracks.get(name)
            if track is not None:
                columns[name] = (
                    track.held(instants, gap) if name in HELD else track.at(instants, gap, name in SMOOTH)
                )
            elif name in self._required():
                columns[name] = np.full(len(instants), np.nan)
        displacement = self._tracks.get("displacement", Track())
        columns["velocity"] = displacement.slope(LONGEST_GAP_NS["displacement"]).at(
            instants, LONGEST_GAP_NS["displacement"], False
        )
        columns["coil_drive"] = columns[self._drive]
        return columns

    def _whole(self, instants: Instants, columns: dict[str, Numbers]) -> AlignedSamples:
        """The samples that have all that they must have; every value that is missing is counted."""
        for name in LONGEST_GAP_NS:
            track = self._tracks.get(name)
            if name in columns:
                # What a bench need not have is missed only once it has begun.
                due = instants >= (0 if track is None or name in self._required() else track.began)
                self._lost[name] += int(np.count_nonzero(np.isnan(columns[name]) & due))
        self._lost = +self._lost  # without those of which none are missing
        whole = np.all([np.isfinite(columns[name]) for name in (*self._required(), "velocity", "force")], axis=0)
        return AlignedSamples(instants[whole], {name: column[whole] for name, column in columns.items()})
