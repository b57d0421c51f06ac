"""Compilation of a method to the exact samples for actuator and amplifier.

The programme parts of ``plan.py`` follow one another without gaps. Sample k belongs to the part and the segment at
the time k / rate. A method that exceeds its own limits is refused.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bench.errors import MethodError
from bench.methods.document import Method
from bench.methods.drive import EDGE_TOLERANCE
from bench.methods.kinematics import Array
from bench.methods.plan import PlannedSegment, ProgrammePart, plan

MAX_SAMPLES = 20_000_000
"""Largest number of samples of a programme, which limits the memory."""
NO_SEGMENT = -1
"""Segment index of fades, moves, warm-ups and rests."""
ROUNDING_TOLERANCE = 1e-9
"""Relative excess over a limit that is attributed to rounding."""


@dataclass(frozen=True)
class ProgrammeSegment:
    """One segment of a programme: the samples from ``start`` up to ``stop``, exclusive."""

    index: int
    name: str
    start: int
    stop: int
    motion: str
    """Kind of motion."""
    drive: str
    """Kind of drive; each level of a staircase is ``constant``."""
    amplitude: float | None
    """[m]; None if the motion has none."""
    frequency: float | None
    """[Hz]; None if the motion has none."""
    drive_value: float | None
    """[V or A]; None if the drive varies."""
    checkpoint: bool = False
    """True if an interrupted run can be resumed after this segment."""
    shunt: bool = False
    """True if the shunt of the load cell is on."""


@dataclass(frozen=True)
class Programme:
    """A method compiled to samples; each array has shape (samples,)."""

    method: Method
    rate: float
    """Sampling rate [Hz]."""
    time: Array
    """[s] from 0."""
    displacement: Array
    """[m], positive in extension."""
    velocity: Array
    """Exact derivative of the displacement [m/s]."""
    acceleration: Array
    """Exact derivative of the velocity [m/s²]."""
    drive: Array
    """[V or A], according to the method's drive kind."""
    segment: npt.NDArray[np.int64]
    """Index into ``segments``; -1 between them."""
    segments: tuple[ProgrammeSegment, ...]
    """Segments in order."""

    @property
    def duration(self) -> float:
        """Time [s] from the first to the last sample."""
        return float(self.time[-1])

    def find_cycle(self, segment: int, elapsed: float) -> tuple[int, int] | None:
        """Return the present cycle of a segment, from 1, and their number; None without whole cycles.

        Args:
            segment: index of the segment; -1 between segments.
            elapsed: time since the first sample [s].
        """
        frequency = None if segment == NO_SEGMENT else self.segments[segment].frequency
        if frequency is None:
            return None
        one = self.segments[segment]
        cycles = round((one.stop - one.start) / self.rate * frequency)
        done = int((elapsed - float(self.time[one.start])) * frequency)
        return (min(max(done, 0) + 1, cycles), cycles) if cycles else None


def compile_method(method: Method, max_samples: int = MAX_SAMPLES) -> Programme:
    """Compile a method to samples.

    Args:
        method: as planned.
        max_samples: largest number of samples, which limits the memory.

    Raises:
        MethodError: a segment cannot be sampled, the programme is too long, or a limit is exceeded.
    """
    parts = list(plan(method))
    starts = np.concatenate([[0.0], np.cumsum([part.duration for part in parts])])
    programme = _allocate(method, float(starts[-1]), max_samples)
    for part, start, end in zip(parts, starts, starts[1:], strict=False):
        _write_part(part, float(start), _find_sample(float(end), method.rate_hz), programme)
    segments = _make_segments(parts, starts, method.rate_hz)
    for segment in segments:
        programme.segment[segment.start : segment.stop] = segment.index
    compiled = replace(programme, segments=segments)
    _check_limits(compiled)
    return compiled


def _allocate(method: Method, duration: float, max_samples: int) -> Programme:
    """Return a programme of empty samples; the last sample is at the end of the last part, at rest."""
    count = _find_sample(duration, method.rate_hz) + 1
    if count > max_samples:
        raise MethodError(
            f"method {method.name}: {duration:.0f} s at {method.rate_hz:g} Hz are {count} samples, more than "
            f"{max_samples}; divide it into several runs"
        )
    return Programme(
        method=method,
        rate=method.rate_hz,
        time=np.arange(count) / method.rate_hz,
        displacement=np.zeros(count),
        velocity=np.zeros(count),
        acceleration=np.zeros(count),
        drive=np.zeros(count),
        segment=np.full(count, NO_SEGMENT, dtype=np.int64),
        segments=(),
    )


def _write_part(part: ProgrammePart, start: float, stop: int, programme: Programme) -> None:
    """Write the samples of a part that starts at a time [s]; the next part overwrites the common sample."""
    first = _find_sample(start, programme.rate)
    rows = slice(first, stop + 1)
    local_time = programme.time[rows] - start - part.lead_time
    motion = part.motion(local_time)
    programme.displacement[rows] = motion.displacement
    programme.velocity[rows] = motion.velocity
    programme.acceleration[rows] = motion.acceleration
    programme.drive[rows] = part.drive(local_time)


def _make_segments(parts: list[ProgrammePart], starts: Array, rate: float) -> tuple[ProgrammeSegment, ...]:
    segments: list[tuple[float, PlannedSegment]] = [
        (float(start) + part.lead_time, segment)
        for part, start in zip(parts, starts, strict=False)
        for segment in part.segments
    ]
    return tuple(_make_segment(index, *one, rate) for index, one in enumerate(segments))


def _make_segment(index: int, begin: float, segment: PlannedSegment, rate: float) -> ProgrammeSegment:
    return ProgrammeSegment(
        index,
        segment.name,
        _find_sample(begin + segment.begin, rate),
        _find_sample(begin + segment.end, rate),
        segment.motion,
        segment.drive,
        segment.amplitude,
        segment.frequency,
        segment.drive_value,
        segment.checkpoint,
        segment.shunt,
    )


def _find_sample(time: float, rate: float) -> int:
    """Return the first sample at or after a time [s], with a tolerance for rounding."""
    return math.ceil((time - EDGE_TOLERANCE) * rate)


def _check_limits(programme: Programme) -> None:
    limits = programme.method.limits
    for quantity, values, limit, unit, advice in (
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
        if abs(values[worst]) > limit * (1 + ROUNDING_TOLERANCE):
            position = f"method {programme.method.name}, {_describe_position(programme, worst)}"
            excess = f"{quantity} {values[worst]:.4g} {unit} exceeds the limit of {limit:g} {unit}"
            raise MethodError(f"{position}: {excess}; {advice}")


def _describe_position(programme: Programme, sample: int) -> str:
    index = int(programme.segment[sample])
    if index != NO_SEGMENT:
        return f"segment {programme.segments[index].name}"
    later = [segment.name for segment in programme.segments if segment.start > sample]
    return f"before segment {later[0]}" if later else "after the last segment"
