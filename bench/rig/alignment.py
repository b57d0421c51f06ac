"""Alignment of all channels to the time base of the force.

Bench samples are taken at the load cell's own conversions, so force is never interpolated (decision 0008). Other
channels are brought to these instants: displacement and actuator position by a cubic through their neighbours,
voltage and current linearly, the temperature by its last value. Velocity is the slope of the displacement's own
samples.

A value without samples close by is missing and counted.
"""

from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from bench.rig.acquisition import Batch
from bench.rig.channel_buffer import ChannelBuffer, Instants, Numbers
from bench.rig.clock_map import ClockMap
from drivers import SampleBlock

DriveChannel: TypeAlias = Literal["coil_voltage", "coil_current"]

MAX_LAG_NS = 1_000_000_000
"""[ns] Largest lag of a channel behind the force: above it, its values count as missing."""
MAX_GAP_NS = {
    "displacement": 10_000_000,
    "force_raw": 10_000_000,
    "coil_voltage": 20_000_000,
    "coil_current": 20_000_000,
    "actuator_position": 120_000_000,
    "temperature": 5_000_000_000,
}
"""[ns] Largest gap between samples that is interpolated, for each aligned channel."""
CUBIC_CHANNELS = ("displacement", "actuator_position")
"""Channels that are interpolated by a cubic."""
HELD_CHANNELS = ("temperature",)
"""Channels that keep their last value; no bench sample waits for them."""
_CONTEXT_NS = 60_000_000
"""[ns] Time before the last bench sample for which each channel keeps its samples."""
_QUEUE_LENGTH = 8192
"""Largest number of batches that wait; a discarded batch appears as a gap in the running numbers."""


@dataclass(frozen=True)
class AlignedSamples:
    """Bench samples at the instants of the force."""

    time_ns: Instants
    """Bench clock [ns], increasing, shape (samples,)."""
    columns: dict[str, Numbers]
    """By field of `bench.log.messages.Sample`, each of shape (samples,). A missing value is NaN; displacement,
    velocity, force and coil_drive are never missing."""


class Aligner:
    """Converter of batches to bench samples; batches may come from any thread, samples are taken from one."""

    def __init__(self, maps: Mapping[str, ClockMap], drive_channel: DriveChannel) -> None:
        """Begin without samples.

        Args:
            maps: clock map of each instrument by name, as kept by `bench.rig.acquisition.Acquisition`.
            drive_channel: the channel that drives the damper.
        """
        self._maps = maps
        self._drive: str = drive_channel
        self._queue: deque[Batch] = deque(maxlen=_QUEUE_LENGTH)
        self._buffers: dict[str, ChannelBuffer] = {}
        self._sources: dict[str, str] = {}
        self._expected_number: int | None = None
        self._start_ns: int | None = None
        self._done_ns = -1
        self._lost: Counter[str] = Counter()

    @property
    def lost(self) -> dict[str, int]:
        """Number of bench samples that lack a channel; for ``force``, of those that never came or were bad."""
        return dict(self._lost)

    def feed(self, batch: Batch) -> None:
        """Add a batch; never blocks."""
        self._queue.append(batch)

    def align(self, *, final: bool = False) -> AlignedSamples | None:
        """Return the bench samples that all channels have passed since the last call, or None.

        With ``final``, no more batches will come, so that no channel is waited for.
        """
        self._drain_queue()
        force = self._buffers.get("force")
        if force is None or not force.size or not self._has_started(force):
            return None
        stop = int(np.searchsorted(force.time_ns, self._find_limit(force.newest_ns, final), side="right"))
        start = int(np.searchsorted(force.time_ns, self._done_ns, side="right"))
        if stop <= start:
            return None
        instants, values = force.time_ns[start:stop], force.values[start:stop]
        self._done_ns = int(instants[-1])
        aligned = self._select_complete(instants, self._make_columns(instants, values))
        for buffer in self._buffers.values():
            buffer.discard_before(self._done_ns - _CONTEXT_NS)
        return aligned if aligned.time_ns.size else None

    # Input

    def _drain_queue(self) -> None:
        clocked: dict[tuple[str, str], list[SampleBlock]] = {}
        for _ in range(len(self._queue)):
            batch = self._queue.popleft()
            for block in batch.blocks:
                if self._accept_block(batch.instrument, block):
                    clocked.setdefault((batch.instrument, block.channel), []).append(block)
        for (instrument, channel), blocks in clocked.items():
            self._add_samples(instrument, channel, blocks)

    def _accept_block(self, instrument: str, block: SampleBlock) -> bool:
        """Return whether a block has valid samples with a device clock; add those without a clock at once."""
        is_aligned = block.channel == "force" or block.channel in MAX_GAP_NS
        # If two instruments measure the same channel, the one whose samples came first provides it.
        if not is_aligned or self._sources.setdefault(block.channel, instrument) != instrument:
            return False
        if block.channel == "force":
            self._count_lost(block)
        buffer = self._buffers.setdefault(block.channel, ChannelBuffer())
        if block.quality != "bad" and block.device_ns is None:
            buffer.add(buffer.spread_times(block.received_ns, len(block.values)), block.values)
        return block.quality != "bad" and block.device_ns is not None

    def _add_samples(self, instrument: str, channel: str, blocks: list[SampleBlock]) -> None:
        """Add samples by the instrument's clock, all blocks at once because most hold one or two samples."""
        clock = self._maps.get(instrument)
        if clock is not None and clock.is_known:
            device_ns = np.concatenate([block.device_ns for block in blocks if block.device_ns is not None])
            values = np.concatenate([block.values for block in blocks])
            self._buffers[channel].add(clock.map_instants(device_ns), values)

    def _count_lost(self, block: SampleBlock) -> None:
        """Count force samples since the first bench sample that never came or are bad."""
        if self._start_ns is not None:
            gap = 0 if self._expected_number is None else max(block.first - self._expected_number, 0)
            self._lost["force"] += gap + (len(block.values) if block.quality == "bad" else 0)
        self._expected_number = block.first + len(block.values)

    def _has_started(self, force: ChannelBuffer) -> bool:
        """Return whether bench samples have begun, which needs every required channel."""
        if self._start_ns is not None:
            return True
        required = [self._buffers.get(name) for name in self._list_required()]
        first = [buffer.first_ns for buffer in required if buffer is not None and buffer.size]
        if len(first) < len(required) and force.newest_ns - force.first_ns <= MAX_LAG_NS:
            return False
        self._start_ns = max([force.first_ns, *first])
        self._done_ns = self._start_ns - 1
        return True

    def _list_required(self) -> tuple[str, str]:
        return "displacement", self._drive

    # Output

    def _find_limit(self, newest: int, final: bool) -> int:
        """Return the instant [ns] that all channels have passed, except those that lag too far behind."""
        limit = newest
        for name, buffer in self._buffers.items():
            if name == "force" or name in HELD_CHANNELS or not buffer.size:
                continue
            # Velocity is the slope of the displacement, which needs samples on both sides of an instant.
            needs_slope = name == "displacement" and not final
            reach = buffer.newest_ns - buffer.half_window_ns if needs_slope else buffer.newest_ns
            if newest - reach <= MAX_LAG_NS and not final:
                limit = min(limit, reach)
        return limit

    def _make_columns(self, instants: Instants, force: Numbers) -> dict[str, Numbers]:
        columns = {"force": force}
        for name, gap in MAX_GAP_NS.items():
            buffer = self._buffers.get(name)
            if buffer is not None:
                columns[name] = (
                    buffer.hold_last(instants, gap)
                    if name in HELD_CHANNELS
                    else buffer.interpolate(instants, gap, name in CUBIC_CHANNELS)
                )
            elif name in self._list_required():
                columns[name] = np.full(len(instants), np.nan)
        displacement = self._buffers.get("displacement", ChannelBuffer())
        columns["velocity"] = displacement.differentiate(MAX_GAP_NS["displacement"]).interpolate(
            instants, MAX_GAP_NS["displacement"], False
        )
        columns["coil_drive"] = columns[self._drive]
        return columns

    def _select_complete(self, instants: Instants, columns: dict[str, Numbers]) -> AlignedSamples:
        """Return the samples with all required values, and count every missing value."""
        for name in MAX_GAP_NS:
            buffer = self._buffers.get(name)
            if name in columns:
                # An optional channel is missing only after its first sample.
                due = instants >= (0 if buffer is None or name in self._list_required() else buffer.start_ns)
                self._lost[name] += int(np.count_nonzero(np.isnan(columns[name]) & due))
        self._lost = +self._lost  # removes channels with a count of zero
        complete = np.all(
            [np.isfinite(columns[name]) for name in (*self._list_required(), "velocity", "force")], axis=0
        )
        return AlignedSamples(instants[complete], {name: column[complete] for name, column in columns.items()})
