"""Checks of a segment before it is sampled: duration, cycles, sampling rate, corners, drive steps and shunt."""

from bench.errors import MethodError
from bench.methods.document import MethodSegment
from bench.methods.drive import Constant, Staircase, Steps
from bench.methods.motion import (
    Hold,
    MotionTable,
    Multisine,
    Ramp,
    Random,
    Sine,
    Triangle,
    find_end_positions,
    find_highest_frequency,
    find_period,
)

MIN_SAMPLES_PER_CYCLE = 10
"""Smallest number of samples per cycle of the highest frequency of a motion."""
MIN_BAND_LINES = 10
"""Smallest number of spectral lines of a random motion; with fewer lines it is not noise."""
CYCLE_TOLERANCE = 1e-6
"""Largest deviation of a duration from whole cycles [cycles]."""


def check_segment(segment: MethodSegment, rate: float) -> float:
    """Check a segment and return its duration [s] without fades.

    Args:
        segment: segment of a method.
        rate: sampling rate [Hz].

    Raises:
        MethodError: duration, cycles, rate, corners or drive steps are inconsistent, or the shunt is not allowed.
    """
    duration = _find_duration(segment)
    _check_rate(segment, duration, rate)
    if isinstance(segment.motion, Ramp):
        _check_corners(segment.name, segment.motion, duration)
    if isinstance(segment.motion, Random):
        _check_band(segment.name, segment.motion, duration)
    _check_drive(segment, duration)
    _check_shunt(segment)
    return duration


def _find_duration(segment: MethodSegment) -> float:
    motion = segment.motion
    period = find_period(motion)
    if segment.cycles is not None:
        if period is None:
            raise MethodError(f"segment {segment.name}: a {motion.kind} has no cycles; give duration_s")
        _check_table_returns(segment)
        return segment.cycles * period
    duration = segment.duration_s or 0.0
    if isinstance(motion, MotionTable):
        raise MethodError(
            f"segment {segment.name}: the duration of a table is that of its points; give cycles, not duration_s"
        )
    if isinstance(motion, Sine | Triangle) and not _is_whole(duration * motion.frequency_hz):
        raise MethodError(
            f"segment {segment.name}: {duration:g} s is {duration * motion.frequency_hz:.4g} cycles, "
            "but whole cycles are needed; give cycles instead"
        )
    return duration


def _check_table_returns(segment: MethodSegment) -> None:
    start, end = find_end_positions(segment.motion)
    if segment.cycles != 1 and start != end:
        raise MethodError(
            f"segment {segment.name}: a repeated table must end at its first position; it starts at {start:g} m "
            f"and ends at {end:g} m"
        )


def _check_rate(segment: MethodSegment, duration: float, rate: float) -> None:
    highest = find_highest_frequency(segment.motion)
    if highest * MIN_SAMPLES_PER_CYCLE > rate:
        raise MethodError(
            f"segment {segment.name}: {highest:g} Hz needs {MIN_SAMPLES_PER_CYCLE} samples per cycle, "
            f"but rate_hz is {rate:g}; raise it to {highest * MIN_SAMPLES_PER_CYCLE:g}"
        )
    if duration * rate < 2:
        raise MethodError(
            f"segment {segment.name}: {duration:g} s contain fewer than 2 samples at {rate:g} Hz; make it longer"
        )


def _check_corners(name: str, ramp: Ramp, duration: float) -> None:
    distance = abs(ramp.end_m - ramp.start_m)
    # At this acceleration the two corners meet in the middle, without a straight part between them.
    needed = 4 * distance / duration**2
    if ramp.corner_acceleration_mps2 < needed:
        raise MethodError(
            f"segment {name}: a ramp over {distance:g} m in {duration:g} s needs corner_acceleration_mps2 of at "
            f"least {needed:.4g} m/s², not {ramp.corner_acceleration_mps2:g}"
        )


def _check_band(name: str, motion: Random, duration: float) -> None:
    lines = (motion.spectrum.high_hz - motion.spectrum.low_hz) * duration
    if lines < MIN_BAND_LINES:
        raise MethodError(
            f"segment {name}: {duration:g} s resolve {lines:.3g} lines of this band, fewer than {MIN_BAND_LINES}; "
            "make it longer or the band wider"
        )


def _check_drive(segment: MethodSegment, duration: float) -> None:
    period = _find_period(segment)
    if isinstance(segment.drive, Steps) and segment.drive.phase_cycles and period is None:
        raise MethodError(
            f"segment {segment.name}: drive steps at phases need whole cycles, but this {segment.motion.kind} has "
            "none; give time_s"
        )
    if isinstance(segment.drive, Staircase) and period is not None:
        levels = len(segment.drive.levels)
        if not _is_whole(duration / period / levels):
            raise MethodError(
                f"segment {segment.name}: {duration / period:g} cycles cannot be divided into {levels} levels of "
                f"whole cycles; give a multiple of {levels}"
            )


def _check_shunt(segment: MethodSegment) -> None:
    """Check that the force is constant while the shunt is on, because it shifts the reading."""
    drive = segment.drive
    is_at_rest = isinstance(segment.motion, Hold) and isinstance(drive, Constant) and drive.value == 0
    if segment.shunt and not is_at_rest:
        raise MethodError(
            f"segment {segment.name}: the shunt needs a rod at rest without drive, not {segment.motion.kind} with "
            f'{drive.kind} drive; use motion "hold" and a constant drive of 0, or leave out shunt'
        )


def _find_period(segment: MethodSegment) -> float | None:
    """Return the length of a cycle [s] if the segment consists of whole cycles."""
    if segment.cycles is None and isinstance(segment.motion, Multisine):
        return None
    return find_period(segment.motion)


def _is_whole(cycles: float) -> bool:
    return abs(cycles - round(cycles)) < CYCLE_TOLERANCE and round(cycles) > 0
