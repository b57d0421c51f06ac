"""What has to fit together before a segment can be made into samples: lengths, cycles, rates and steps."""

from bench.errors import MethodError
from bench.methods.document import Segment
from bench.methods.drive import Staircase, Steps
from bench.methods.motion import (
    MotionTable,
    Multisine,
    Ramp,
    Random,
    Sine,
    Triangle,
    ends,
    highest_frequency,
    period,
)

SAMPLES_PER_CYCLE = 10
"""[1] fewest samples a cycle of the fastest content of a motion."""
LINES_IN_BAND = 10
"""[1] fewest lines of a random motion; below, it is no noise."""
WHOLE = 1e-6
"""[cycles] a length this close to whole cycles is whole."""


def counted_length(segment: Segment, rate: float) -> float:
    """Length [s] of a segment without its fades, once everything in it has been found to fit together.

    Args:
        segment: what the document says.
        rate: [Hz] samples a second.

    Raises:
        MethodError: lengths, cycles, rate, corners or drive steps do not fit together.
    """
    duration = _seconds(segment)
    _check_rate(segment, duration, rate)
    if isinstance(segment.motion, Ramp):
        _check_corners(segment.name, segment.motion, duration)
    if isinstance(segment.motion, Random):
        _check_band(segment.name, segment.motion, duration)
    _check_drive(segment, duration)
    return duration


def _seconds(segment: Segment) -> float:
    motion = segment.motion
    cycle = period(motion)
    if segment.cycles is not None:
        if cycle is None:
            raise MethodError(f"segment {segment.name}: a {motion.kind} has no cycles; give duration_s")
        _check_table_returns(segment)
        return segment.cycles * cycle
    duration = segment.duration_s or 0.0
    if isinstance(motion, MotionTable):
        raise MethodError(f"segment {segment.name}: a table has a length of its own; give cycles, not duration_s")
    if isinstance(motion, Sine | Triangle) and not _is_whole(duration * motion.frequency_hz):
        raise MethodError(
            f"segment {segment.name}: {duration:g} s is {duration * motion.frequency_hz:.4g} cycles; "
            "whole cycles are needed, best give cycles"
        )
    return duration


def _check_table_returns(segment: Segment) -> None:
    start, end = ends(segment.motion)
    if segment.cycles != 1 and start != end:
        raise MethodError(
            f"segment {segment.name}: a table that is repeated must end where it starts; it starts at {start:g} m "
            f"and ends at {end:g} m"
        )


def _check_rate(segment: Segment, duration: float, rate: float) -> None:
    fastest = highest_frequency(segment.motion)
    if fastest * SAMPLES_PER_CYCLE > rate:
        raise MethodError(
            f"segment {segment.name}: {fastest:g} Hz needs {SAMPLES_PER_CYCLE} samples a cycle, "
            f"but rate_hz is {rate:g}; raise it to {fastest * SAMPLES_PER_CYCLE:g}"
        )
    if duration * rate < 2:
        raise MethodError(
            f"segment {segment.name}: {duration:g} s hold fewer than 2 samples at {rate:g} Hz; make it longer"
        )


def _check_corners(name: str, ramp: Ramp, duration: float) -> None:
    way = abs(ramp.end_m - ramp.start_m)
    # With this much the two corners meet half way, and nothing straight is left between them.
    needed = 4 * way / duration**2
    if ramp.corner_acceleration_mps2 < needed:
        raise MethodError(
            f"segment {name}: a ramp over {way:g} m in {duration:g} s needs corner_acceleration_mps2 of at least "
            f"{needed:.4g} m/s², not {ramp.corner_acceleration_mps2:g}"
        )


def _check_band(name: str, motion: Random, duration: float) -> None:
    lines = (motion.spectrum.high_hz - motion.spectrum.low_hz) * duration
    if lines < LINES_IN_BAND:
        raise MethodError(
            f"segment {name}: {duration:g} s hold {lines:.3g} lines of this band, fewer than {LINES_IN_BAND}; "
            "make it longer or the band wider"
        )


def _check_drive(segment: Segment, duration: float) -> None:
    cycle = _whole_cycle(segment)
    if isinstance(segment.drive, Steps) and segment.drive.phase_cycles and cycle is None:
        raise MethodError(
            f"segment {segment.name}: drive steps at phases need whole cycles; this {segment.motion.kind} has "
            "none, give time_s"
        )
    if isinstance(segment.drive, Staircase) and cycle is not None:
        levels = len(segment.drive.levels)
        if not _is_whole(duration / cycle / levels):
            raise MethodError(
                f"segment {segment.name}: {duration / cycle:g} cycles do not divide into {levels} levels of "
                f"whole cycles; take a multiple of {levels}"
            )


def _whole_cycle(segment: Segment) -> float | None:
    """Length of a cycle [s] where the segment is made of whole ones."""
    if segment.cycles is None and isinstance(segment.motion, Multisine):
        return None
    return period(segment.motion)


def _is_whole(cycles: float) -> bool:
    return abs(cycles - round(cycles)) < WHOLE and round(cycles) > 0
