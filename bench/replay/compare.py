"""Bit-exact comparison of a log's readings with those decoded again from its raw frames.

A sample is identified by channel and running number. Frames and readings do not begin and end at the same instant.
Compared are the readings received after the first frame given to the decoder, and not after the last one.
"""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.errors import LogError
from bench.replay.raw import RawRecording, read_raw_recordings
from drivers import DriverError, SampleBlock
from drivers.replay import make_decoder


class ReplayResult(NamedTuple):
    """Result of decoding one instrument's frames again."""

    instrument: str
    frames: int
    samples: int
    """Number of compared readings."""
    differences: int
    """Number of readings that are missing, additional or different."""
    message: str
    """First difference, or reason why nothing was compared; empty if all readings are equal."""

    @property
    def is_equal(self) -> bool:
        """True if at least one reading was compared and none differs, or if the log contains no frames."""
        return not self.differences and (self.samples > 0 or not self.frames)

    def __str__(self) -> str:
        """Return one line for a person."""
        if not self.samples:
            return f"{self.instrument}: {self.frames} frames, nothing compared: {self.message}"
        verdict = f"{self.differences} differ, the first: {self.message}" if self.differences else "all equal"
        return f"{self.instrument}: {self.frames} frames, {self.samples} samples, {verdict}"


def replay_frames(path: Path) -> list[ReplayResult]:
    """Decode the frames of a log again and compare; empty for a log that was recorded without wires.

    Raises:
        LogError: the log cannot be read, or no decoder accepts an instrument's snapshot.
    """
    return [_replay_instrument(path, name, raw) for name, raw in read_raw_recordings(path).items()]


def _replay_instrument(path: Path, name: str, raw: RawRecording) -> ReplayResult:
    if not raw.frames:
        return ReplayResult(name, 0, 0, 0, "the log contains no frames of its wire")
    if raw.description is None:
        return ReplayResult(name, len(raw.frames), 0, 0, "the log contains no snapshot of its decoder")
    try:
        decoding = make_decoder(raw.description)
    except DriverError as error:
        raise LogError(f"{path}: {name}: {error}") from error
    began = max(raw.frames[0].received_ns, raw.description["state"]["at_ns"])
    ended = raw.frames[-1].received_ns
    decoded = _collect_samples(block for frame in raw.frames for block in decoding.feed(frame))
    recorded = _collect_samples(raw.blocks)
    return _compare_samples(name, len(raw.frames), decoded, recorded, (began, ended))


class _Sample(NamedTuple):
    """One reading, without the quantities that depend on the division into blocks."""

    device_ns: int
    value: bytes
    raw: float
    quality: str


_Key = tuple[str, int]


def _collect_samples(blocks: Iterable[SampleBlock]) -> dict[_Key, tuple[_Sample, int]]:
    """Return each sample with the bench clock of its receipt [ns]."""
    found = {}
    for block in blocks:
        device = np.full(len(block.values), -1) if block.device_ns is None else block.device_ns
        parts = zip(device.tolist(), block.values, block.raw.tolist(), strict=True)
        for place, (device_ns, value, raw) in enumerate(parts):
            # Bytes, for a bit-exact comparison; none for NaN, which is not equal to itself.
            sample = _Sample(device_ns, value.tobytes() if value == value else b"", raw, block.quality)
            found[block.channel, block.first + place] = sample, block.received_ns
    return found


def _compare_samples(name: str, frames: int, decoded: Any, recorded: Any, span: tuple[int, int]) -> ReplayResult:
    """Compare all decoded and recorded samples that were received within a span of the bench clock [ns]."""
    begin, end = _find_edges(decoded, min), _find_edges(recorded, max)
    due = [k for k, (_, came) in recorded.items() if span[0] < came <= span[1] and k[1] >= begin.get(k[0], 0)]
    due += [k for k in decoded if k not in recorded and k[1] < end.get(k[0], -1)]
    wrong = [key for key in due if decoded.get(key, (None,))[0] != recorded.get(key, (None,))[0]]
    words = _describe_difference(wrong[0], decoded, recorded) if wrong else ""
    return ReplayResult(
        name, frames, len(due), len(wrong), words if due else "no reading was received while frames were recorded"
    )


def _find_edges(samples: Iterable[_Key], outer: Callable[[int, int], int]) -> dict[str, int]:
    """Return the first or the last running number of each channel."""
    edges: dict[str, int] = {}
    for channel, number in samples:
        edges[channel] = outer(number, edges.get(channel, number))
    return edges


def _describe_difference(key: _Key, decoded: Any, recorded: Any) -> str:
    channel, number = key
    if key not in decoded:
        return f"{channel} {number} was recorded but is not in the frames"
    if key not in recorded:
        return f"{channel} {number} is in the frames but was not recorded"
    return f"{channel} {number}: recorded raw {recorded[key][0].raw:g}, in the frames {decoded[key][0].raw:g}"
