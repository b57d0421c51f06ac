"""Whether the raw frames of a log, decoded anew, give the readings that it recorded, bit for bit.

A sample is known by channel and running number. Frames and readings do not begin and end at the same moment: a
reading counts where it came later than the first frame that the decoder is given, and no later than the last one.
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
    """What became of one instrument's frames."""

    instrument: str
    frames: int
    samples: int
    """Readings that were compared."""
    differences: int
    """Readings that are missing, new, or not the same."""
    message: str
    """The first difference, or why nothing was compared; empty where all is well."""

    @property
    def is_equal(self) -> bool:
        """Whether nothing differs, and there was something that could; always where the log has no frames."""
        return not self.differences and (self.samples > 0 or not self.frames)

    def __str__(self) -> str:
        """One line for a person."""
        if not self.samples:
            return f"{self.instrument}: {self.frames} frames, nothing compared: {self.message}"
        verdict = f"{self.differences} differ, the first: {self.message}" if self.differences else "all equal"
        return f"{self.instrument}: {self.frames} frames, {self.samples} samples, {verdict}"


def replay_frames(path: Path) -> list[ReplayResult]:
    """Decode the frames of a log anew, instrument by instrument; empty for a log that was made without wires.

    Raises:
        LogError: the log cannot be read, or says of an instrument what no decoder understands.
    """
    return [_replay_instrument(path, name, raw) for name, raw in read_raw_recordings(path).items()]


def _replay_instrument(path: Path, name: str, raw: RawRecording) -> ReplayResult:
    if not raw.frames:
        return ReplayResult(name, 0, 0, 0, "the log holds no frames of its wire")
    if raw.description is None:
        return ReplayResult(name, len(raw.frames), 0, 0, "the log does not say how its frames are decoded")
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
    """One reading, without what depends on how samples came together."""

    device_ns: int
    value: bytes
    raw: float
    quality: str


_Key = tuple[str, int]


def _collect_samples(blocks: Iterable[SampleBlock]) -> dict[_Key, tuple[_Sample, int]]:
    """Each sample, and when it came [ns]."""
    found = {}
    for block in blocks:
        device = np.full(len(block.values), -1) if block.device_ns is None else block.device_ns
        parts = zip(device.tolist(), block.values, block.raw.tolist(), strict=True)
        for place, (device_ns, value, raw) in enumerate(parts):
            # Bit for bit; a NaN, which equals nothing, as no bytes at all.
            sample = _Sample(device_ns, value.tobytes() if value == value else b"", raw, block.quality)
            found[block.channel, block.first + place] = sample, block.received_ns
    return found


def _compare_samples(name: str, frames: int, decoded: Any, recorded: Any, span: tuple[int, int]) -> ReplayResult:
    """Every sample that either has within the span, against the other."""
    begin, end = _find_edges(decoded, min), _find_edges(recorded, max)
    due = [k for k, (_, came) in recorded.items() if span[0] < came <= span[1] and k[1] >= begin.get(k[0], 0)]
    due += [k for k in decoded if k not in recorded and k[1] < end.get(k[0], -1)]
    wrong = [key for key in due if decoded.get(key, (None,))[0] != recorded.get(key, (None,))[0]]
    words = _describe_difference(wrong[0], decoded, recorded) if wrong else ""
    return ReplayResult(
        name, frames, len(due), len(wrong), words if due else "no reading came while frames were recorded"
    )


def _find_edges(samples: Iterable[_Key], outer: Callable[[int, int], int]) -> dict[str, int]:
    """The first or the last number of each channel."""
    edges: dict[str, int] = {}
    for channel, number in samples:
        edges[channel] = outer(number, edges.get(channel, number))
    return edges


def _describe_difference(key: _Key, decoded: Any, recorded: Any) -> str:
    channel, number = key
    if key not in decoded:
        return f"{channel} {number} was recorded and is not in the frames"
    if key not in recorded:
        return f"{channel} {number} is in the frames and was not recorded"
    return f"{channel} {number}: recorded raw {recorded[key][0].raw:g}, in the frames {decoded[key][0].raw:g}"
