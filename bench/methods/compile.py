"""From a method to the exact samples that the actuator and the amplifier are given.

The pieces of ``plan.py`` are laid end to end on one time line; sample k belongs to the piece and the segment that
hold the time k / rate. Nothing is compiled that exceeds the method's own limits.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bench.errors import MethodError
from bench.methods.document import Method
from bench.methods.drive import EDGE
from bench.methods.kinematics import Array
from bench.methods.plan import Mark, Piece, plan

MOST_SAMPLES = 20_000_000
"""[1] longest programme that is held in memory."""
BETWEEN = -1
"""Segment index of fades, moves, warm-ups and rests."""
ROUNDING = 1e-9
"""[1] share by which arithmetic may pass a limit."""


@dataclass(frozen=True)
class ProgrammeSegment:
    """One segment of a programme: the samples from ``start`` up to, not including, ``stop``."""

    index: int
    name: str
    start: int
    stop: int
    motion: str
    """Kind of the motion."""
    drive: str
    """Kind of the drive; each level of a staircase is ``constant``."""
    amplitude: float | None
    """[m] where the motion has one."""
    frequency: float | None
    """[Hz] where the motion has one."""
    drive_value: float | None
    """[V or A] where the drive is constant."""
    checkpoint: bool = False
    """Whether an interrupted run may be taken up after it."""


@dataclass(frozen=True)
class Programme:
    """A method as samples, each array of shape (samples,)."""

    method: Method
    rate: float
    """[Hz] samples a second."""
    time: Array
    """[s] from 0."""
    displacement: Array
    """[m] positive extends the damper."""
    velocity: Array
    """[m/s] its exact derivative."""
    acceleration: Array
    """[m/s²] the derivative of that."""
    drive: Array
    """[V or A] as the method's drive kind says."""
    segment: npt.NDArray[np.int64]
    """Index into ``segments``; -1 between them."""
    segments: tuple[ProgrammeSegment, ...]
    """The segments in their order."""

    @property
    def duration(self) -> float:
        """Length [s] from the first sample to the last."""
        return float(self.time[-1])


def compile_method(method: Method) -> Programme:
    """The samples of a method.

    Raises:
        MethodError: a segment cannot be made into samples, the programme is too long, or a limit is exceeded.
    """
    pieces = list(plan(method))
    starts = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])
    programme = _empty(method, float(starts[-1]))
    # There is one edge more than pieces.
    for piece, start, end in zip(pieces, starts, starts[1:], strict=False):
        _lay(piece, float(start), _sample_at(float(end), method.rate_hz), programme)
    segments = _segments(pieces, starts, method.rate_hz)
    for one in segments:
        programme.segment[one.start : one.stop] = one.index
    compiled = replace(programme, segments=segments)
    _check_limits(compiled)
    return compiled


def _empty(method: Method, duration: float) -> Programme:
    """Room for the samples; the last sample stands at the end of the last piece, at rest."""
    count = _sample_at(duration, method.rate_hz) + 1
    if count > MOST_SAMPLES:
        raise MethodError(
            f"method {method.name}: {duration:.0f} s at {method.rate_hz:g} Hz are {count} samples, more than "
            f"{MOST_SAMPLES}; split it into several runs"
        )
    return Programme(
        method=method,
        rate=method.rate_hz,
        time=np.arange(count) / method.rate_hz,
        displacement=np.zeros(count),
        velocity=np.zeros(count),
        acceleration=np.zeros(count),
        drive=np.zeros(count),
        segment=np.full(count, BETWEEN, dtype=np.int64),
        segments=(),
    )


def _lay(piece: Piece, start: float, stop: int, programme: Programme) -> None:
    """Write a piece's samples from its start [s] on; the next piece overwrites what it shares."""
    first = _sample_at(start, programme.rate)
    here = slice(first, stop + 1)
    local = programme.time[here] - start - piece.lead
    motion = piece.motion(local)
    programme.displacement[here] = motion.displacement
    programme.velocity[here] = motion.velocity
    programme.acceleration[here] = motion.acceleration
    programme.drive[here] = piece.drive(local)


def _segments(pieces: list[Piece], starts: Array, rate: float) -> tuple[ProgrammeSegment, ...]:
    placed: list[tuple[float, Mark]] = [
        (float(start) + piece.lead, mark)
        for piece, start in zip(pieces, starts, strict=False)
        for mark in piece.marks
    ]
    return tuple(
        ProgrammeSegment(
            index,
            mark.name,
            _sample_at(begin + mark.begin, rate),
            _sample_at(begin + mark.end, rate),
            mark.motion,
            mark.drive,
            mark.amplitude,
            mark.frequency,
            mark.drive_value,
            mark.checkpoint,
        )
        for index, (begin, mark) in enumerate(placed)
    )


def _sample_at(time: float, rate: float) -> int:
    """The first sample at or after a time [s], forgiving rounding."""
    return math.ceil((time - EDGE) * rate)


def _check_limits(programme: Programme) -> None:
    limits = programme.method.limits
    for word, values, limit, unit, advice in (
        ("displacement", programme.displacement, limits.stroke_m, "m", "lower the amplitude or the centre"),
        ("velocity", programme.velocity, limits.velocity_mps, "m/s", "lower amplitude or frequency"),
        (
            "acceleration",
            programme.acceleration,
            limits.acceleration_mps2,
            "m/s²",
            "lower amplitude or frequency, or lengthen the fade",
        ),
        ("drive", programme.drive, limits.drive, programme.method.drive_unit, "lower the drive"),
    ):
        worst = int(np.argmax(np.abs(values)))
        if abs(values[worst]) > limit * (1 + ROUNDING):
            raise MethodError(
                f"method {programme.method.name}, {_where(programme, worst)}: {word} {values[worst]:.4g} {unit} "
                f"exceeds the limit of {limit:g} {unit}; {advice}"
            )


def _where(programme: Programme, sample: int) -> str:
    index = int(programme.segment[sample])
    if index != BETWEEN:
        return f"segment {programme.segments[index].name}"
    later = [segment.name for segment in programme.segments if segment.start > sample]
    return f"before segment {later[0]}" if later else "after the last segment"
