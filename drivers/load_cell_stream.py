"""From the load cell's bytes to numbered samples, without any wire.

`SampleStream` numbers the samples that `Decoder` finds, counts the lost ones and unwraps the instrument's clock.
It depends on nothing but the bytes and their stamps, so that a replay of the recorded bytes gives the same blocks
bit for bit.
"""

from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from drivers.channel import Block, Quality
from drivers.load_cell_frames import CONTRACT, Acknowledgement, Answer, Decoder, Identity, Sample

_STATUS = CONTRACT["status"]
_UNUSABLE = _STATUS["overload"] | _STATUS["sensor_fault"]
_COUNTS_PER_NEWTON = float(CONTRACT["instrument"]["counts_per_newton"])
_FULL_SCALE = CONTRACT["instrument"]["full_scale_n"] * _COUNTS_PER_NEWTON
"""[counts]"""
_SEQUENCES = 1 << 16
"""In one turn of the sequence."""
_TICKS = 1 << 32
"""[us] in one turn of the instrument's clock."""


class Counts(NamedTuple):
    """What a stream has been through."""

    received: int = 0
    lost: int = 0
    corrupted: int = 0
    resynchronised: int = 0

    def since(self, before: "Counts") -> "Counts":
        """What has been added."""
        return Counts(*(now - then for now, then in zip(self, before, strict=True)))


class _Numbered(NamedTuple):
    """A sample in its place."""

    number: int
    time: int
    """Instrument's clock, unwrapped [us]."""
    sample: Sample


class SampleStream:
    """Stamped bytes in, blocks of samples out.

    Samples count from an acknowledged ``start`` to an acknowledged ``stop``, both seen in the bytes themselves:
    what an earlier session left on the line is nobody's sample. Their numbers go on over a new start.
    """

    def __init__(self) -> None:
        self.answers: dict[int, Answer] = {}
        """The last answer to each token."""
        self.answered_ns: dict[int, int] = {}
        """Bench clock when it was complete, by token [ns]."""
        self.latest: Sample | None = None
        """The newest sample."""
        self.last_ns: int | None = None
        """Bench clock of the last good frame [ns]."""
        self.unchanged = 0
        """Samples in a row that repeat the counts before them."""
        self.rate: int | None = None
        """Samples a second [Hz], while the stream runs."""
        self._decoder = Decoder()
        self._received = 0
        self._lost = 0
        self._restarted = 0
        self._number = -1
        self._time = 0
        self._sampled_ns = self._fed_ns = 0
        self._fresh = True

    def counts(self) -> Counts:
        """Frames received, samples lost, frames corrupted, times resynchronised."""
        found_again = self._decoder.resynchronised + self._restarted
        return Counts(self._received, self._lost, self._decoder.corrupted, found_again)

    def feed(self, received_ns: int, data: bytes) -> list[Block]:
        """Blocks of the samples that are complete with ``data``, both channels of each stretch without gap.

        Args:
            received_ns: bench clock of the last byte [ns].
            data: as it came from the line, cut anywhere.
        """
        self._fed_ns = received_ns
        numbered = []
        for packet in self._decoder.feed(data):
            self._received += 1
            if isinstance(packet, Acknowledgement | Identity):
                # First when, then what: another thread takes both as soon as the answer is there.
                self.answered_ns[packet.token] = received_ns
                self._answered(packet)
            elif isinstance(packet, Sample) and self.rate is not None:
                numbered.append(self._placed(packet, self.rate, received_ns))
            self.last_ns = received_ns
        return list(_blocks(numbered, received_ns))

    def unwrapped(self, clock: int) -> int:
        """Its clock [us] without its turns, from a reading, signed or not, that is close to the newest sample."""
        if self.latest is None:
            return clock % _TICKS
        return self._time + (clock - self.latest.time + _TICKS // 2) % _TICKS - _TICKS // 2

    def state(self) -> dict[str, Any]:
        """Where it stands: what `resume` needs to go on with the bytes after ``at_ns`` as this one does."""
        return {
            "at_ns": self._fed_ns,
            "buffer": self._decoder.rest.hex(),
            "rate": self.rate,
            "fresh": self._fresh,
            "number": self._number,
            "time": self._time,
            "sampled_ns": self._sampled_ns,
            "latest": None if self.latest is None else list(self.latest),
        }

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state`."""
        self._decoder.rest = bytes.fromhex(state["buffer"])
        self.rate, self._fresh, self._number = state["rate"], state["fresh"], state["number"]
        self._time, self._sampled_ns = state["time"], state["sampled_ns"]
        self.latest = None if state["latest"] is None else Sample(*state["latest"])

    def _answered(self, answer: Answer) -> None:
        self.answers[answer.token] = answer
        if isinstance(answer, Identity) or answer.code != CONTRACT["codes"]["done"]:
            return
        if answer.command == CONTRACT["commands"]["start"]:
            self.rate, self._fresh = answer.value, True
        elif answer.command == CONTRACT["commands"]["stop"]:
            self.rate = None

    def _placed(self, sample: Sample, rate: int, received_ns: int) -> _Numbered:
        """The sample with its running number and unwrapped time; gaps before it are counted as lost."""
        elapsed = self._elapsed(sample, received_ns)
        steps = self._steps(sample, elapsed * rate / 1e6)
        repeats = self.latest is not None and self.latest.counts == sample.counts
        self.unchanged = self.unchanged + 1 if repeats else 0
        self._number += steps
        self._lost += steps - 1
        self._time += elapsed
        self._fresh, self.latest, self._sampled_ns = False, sample, received_ns
        return _Numbered(self._number, self._time, sample)

    def _elapsed(self, sample: Sample, received_ns: int) -> int:
        """[us] since the sample before; the bench clock says how often the instrument's has turned unseen."""
        if self.latest is None:
            return sample.time
        elapsed = (sample.time - self.latest.time) % _TICKS
        turns = round(((received_ns - self._sampled_ns) / 1e3 - elapsed) / _TICKS)
        return elapsed + max(turns, 0) * _TICKS

    def _steps(self, sample: Sample, by_clock: float) -> int:
        """Samples since the one before, itself included; 1 means that none is missing.

        The sequence knows them but for whole turns, which the clock tells. A sequence that goes backwards is an
        instrument that began anew: then the clock alone speaks.
        """
        if self._fresh or self.latest is None:
            # A start begins the sequence at 0: what it lacks of that has been lost on the way.
            return 1 + sample.sequence
        steps = (sample.sequence - self.latest.sequence) % _SEQUENCES
        steps += _SEQUENCES * round((by_clock - steps) / _SEQUENCES)
        if steps >= 1:
            return steps
        self._restarted += 1
        return max(round(by_clock), 1)


def _quality(sample: Sample) -> Quality:
    return "bad" if sample.status & _UNUSABLE or abs(sample.counts) > _FULL_SCALE else "good"


def _blocks(samples: list[_Numbered], received_ns: int) -> Iterator[Block]:
    """Both channels of every stretch without gap and of one quality."""
    placed = enumerate(samples)
    # Number less place stays the same for as long as none is missing.
    for (_, quality), group in groupby(placed, lambda it: (it[1].number - it[0], _quality(it[1].sample))):
        stretch = [numbered for _, numbered in group]
        first = stretch[0].number
        device_ns = np.array([numbered.time for numbered in stretch], dtype=np.int64) * 1000
        counts = np.array([numbered.sample.counts for numbered in stretch], dtype=np.float64)
        tare = np.array([numbered.sample.tare for numbered in stretch], dtype=np.float64)
        for channel, raw in (("force", counts - tare), ("force_raw", counts)):
            newtons = raw / _COUNTS_PER_NEWTON
            yield Block(channel, first, device_ns, received_ns, newtons, raw, quality)
