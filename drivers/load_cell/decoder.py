"""Decoder of the load cell's bytes into numbered samples.

`LoadCellDecoder` numbers the samples that `FrameDecoder` extracts, counts the lost ones and removes the wraps of
the device clock.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from drivers.channel import Quality, SampleBlock
from drivers.counters import compute_step, split_at_gaps
from drivers.load_cell.frames import CONTRACT, Acknowledgement, FrameDecoder, Identity, Reply, Sample
from drivers.load_cell.stream_decoder import StreamStatistics

_STATUS = CONTRACT["status"]
_UNUSABLE = _STATUS["overload"] | _STATUS["sensor_fault"]
_SHIFTED = _STATUS["shunt"]
"""Status of samples that contain more than the force on the cell."""
_COUNTS_PER_NEWTON = float(CONTRACT["instrument"]["counts_per_newton"])
_FULL_SCALE = CONTRACT["instrument"]["full_scale_n"] * _COUNTS_PER_NEWTON
"""[counts]"""
_SEQUENCE_PERIOD = 1 << 16
"""Samples after which the sequence wraps."""
_CLOCK_PERIOD = 1 << 32
"""Time after which the device clock wraps [us]."""


class _NumberedSample(NamedTuple):
    number: int
    time: int
    """Device clock without its wraps [us]."""
    sample: Sample


class LoadCellDecoder:
    """Decoder of bytes into blocks of samples.

    Samples count from an acknowledged ``start`` to an acknowledged ``stop``. Both are found in the bytes, so that
    samples of an earlier session are ignored. The numbering continues after a new start.
    """

    def __init__(self) -> None:
        self.replies: dict[int, Reply] = {}
        """Latest reply to each token."""
        self.reply_ns: dict[int, int] = {}
        """Bench clock when each reply was complete, by token [ns]."""
        self.latest: Sample | None = None
        self.last_ns: int | None = None
        """Bench clock at the last good frame [ns]."""
        self.repeat_count = 0
        """Consecutive samples that repeat the previous counts."""
        self.rate: int | None = None
        """Sample rate [Hz] while the stream runs."""
        self._frame_decoder = FrameDecoder()
        self._received = 0
        self._lost = 0
        self._restart_count = 0
        self._number = -1
        self._time = 0
        self._last_sample_ns = self._last_feed_ns = 0
        self._just_started = True

    def get_statistics(self) -> StreamStatistics:
        """Return the counts of frames received, samples lost, frames corrupted, and resynchronisations."""
        resynchronised = self._frame_decoder.resynchronised + self._restart_count
        return StreamStatistics(self._received, self._lost, self._frame_decoder.corrupted, resynchronised)

    def feed(self, received_ns: int, data: bytes) -> list[SampleBlock]:
        """Return the blocks of the samples that are complete with ``data``, both channels of each stretch.

        Args:
            received_ns: bench clock at the last byte [ns].
            data: any part of the stream.
        """
        self._last_feed_ns = received_ns
        numbered = []
        for packet in self._frame_decoder.feed(data):
            self._received += 1
            if isinstance(packet, Acknowledgement | Identity):
                # The time first: another thread reads both as soon as the reply is there.
                self.reply_ns[packet.token] = received_ns
                self._record_reply(packet)
            elif isinstance(packet, Sample) and self.rate is not None:
                numbered.append(self._number_sample(packet, self.rate, received_ns))
            self.last_ns = received_ns
        return list(_make_blocks(numbered, received_ns))

    def unwrap_clock(self, clock: int) -> int:
        """Return the device clock without its wraps [us], from a reading near the latest sample, signed or not."""
        if self.latest is None:
            return clock % _CLOCK_PERIOD
        return self._time + compute_step(clock, self.latest.time, _CLOCK_PERIOD)

    def snapshot(self) -> dict[str, Any]:
        """Return the state that `restore` needs to decode the bytes after ``at_ns``."""
        return {
            "at_ns": self._last_feed_ns,
            "buffer": self._frame_decoder.pending_bytes.hex(),
            "rate": self.rate,
            "fresh": self._just_started,
            "number": self._number,
            "time": self._time,
            "sampled_ns": self._last_sample_ns,
            "latest": None if self.latest is None else list(self.latest),
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot."""
        self._frame_decoder.pending_bytes = bytes.fromhex(state["buffer"])
        self.rate, self._just_started, self._number = state["rate"], state["fresh"], state["number"]
        self._time, self._last_sample_ns = state["time"], state["sampled_ns"]
        self.latest = None if state["latest"] is None else Sample(*state["latest"])

    def _record_reply(self, reply: Reply) -> None:
        self.replies[reply.token] = reply
        if isinstance(reply, Identity) or reply.code != CONTRACT["codes"]["done"]:
            return
        if reply.command == CONTRACT["commands"]["start"]:
            self.rate, self._just_started = reply.value, True
        elif reply.command == CONTRACT["commands"]["stop"]:
            self.rate = None

    def _number_sample(self, sample: Sample, rate: int, received_ns: int) -> _NumberedSample:
        """Return the sample with its running number and unwrapped time, counting lost samples before it."""
        elapsed = self._compute_elapsed(sample, received_ns)
        steps = self._count_steps(sample, elapsed * rate / 1e6)
        repeats = self.latest is not None and self.latest.counts == sample.counts
        self.repeat_count = self.repeat_count + 1 if repeats else 0
        self._number += steps
        self._lost += steps - 1
        self._time += elapsed
        self._just_started, self.latest, self._last_sample_ns = False, sample, received_ns
        return _NumberedSample(self._number, self._time, sample)

    def _compute_elapsed(self, sample: Sample, received_ns: int) -> int:
        """Return the device time since the previous sample [us], with whole wraps counted by the bench clock."""
        if self.latest is None:
            return sample.time
        elapsed = (sample.time - self.latest.time) % _CLOCK_PERIOD
        wraps = round(((received_ns - self._last_sample_ns) / 1e3 - elapsed) / _CLOCK_PERIOD)
        return elapsed + max(wraps, 0) * _CLOCK_PERIOD

    def _count_steps(self, sample: Sample, steps_by_clock: float) -> int:
        """Return the samples since the previous one, this one included; 1 if none is missing.

        The sequence gives the count except for whole wraps, which the clock gives. If the sequence goes backwards,
        the instrument has restarted and the clock alone gives the count.
        """
        if self._just_started or self.latest is None:
            # A start resets the sequence to 0: smaller numbers that did not arrive are lost.
            return 1 + sample.sequence
        steps = (sample.sequence - self.latest.sequence) % _SEQUENCE_PERIOD
        steps += _SEQUENCE_PERIOD * round((steps_by_clock - steps) / _SEQUENCE_PERIOD)
        if steps >= 1:
            return steps
        self._restart_count += 1
        return max(round(steps_by_clock), 1)


def _assess_quality(sample: Sample) -> Quality:
    if sample.status & _UNUSABLE or abs(sample.counts) > _FULL_SCALE:
        return "bad"
    return "uncertain" if sample.status & _SHIFTED else "good"


def _make_blocks(samples: list[_NumberedSample], received_ns: int) -> Iterator[SampleBlock]:
    """Yield both channels of every stretch without gap and of one quality."""
    for stretch in split_at_gaps(samples, lambda numbered: _assess_quality(numbered.sample)):
        first, quality = stretch[0].number, _assess_quality(stretch[0].sample)
        device_ns = np.array([numbered.time for numbered in stretch], dtype=np.int64) * 1000
        counts = np.array([numbered.sample.counts for numbered in stretch], dtype=np.float64)
        tare = np.array([numbered.sample.tare for numbered in stretch], dtype=np.float64)
        for channel, raw in (("force", counts - tare), ("force_raw", counts)):
            values = raw / _COUNTS_PER_NEWTON
            yield SampleBlock(channel, first, device_ns, received_ns, values, raw, quality)
