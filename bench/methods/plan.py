"""Programme parts of a method, in order of time.

A part is a segment with its fades, a move between centres, a warm-up or a rest. Every part begins and ends at rest
at the positions of its neighbours, so that displacement and velocity are continuous. Times are real numbers; only
``compile.py`` computes samples.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bench.methods.checks import check_segment
from bench.methods.document import ConditioningStage, Method, MethodLimits, MethodSegment, WarmUp
from bench.methods.drive import Constant, Staircase, sample_drive
from bench.methods.kinematics import Array, Kinematics, apply_fade, compute_move, compute_move_duration, make_rest
from bench.methods.motion import Sine, Sweep, Triangle, find_end_positions, find_period, is_oscillating
from bench.methods.motion_samples import sample_motion

MOVE_VELOCITY = 0.05
"""Largest velocity [m/s] of moves between centres; the limits may require a smaller one."""
MOVE_ACCELERATION = 0.5
"""Largest acceleration [m/s²] of moves between centres; the limits may require a smaller one."""


@dataclass(frozen=True)
class PlannedSegment:
    """Segment of the log within a programme part."""

    name: str
    begin: float
    """Time [s] since the start of the counted part."""
    end: float
    """Time [s] since the start of the counted part."""
    motion: str
    drive: str
    amplitude: float | None
    """[m]; None if the motion has none."""
    frequency: float | None
    """[Hz]; None if the motion has none."""
    drive_value: float | None
    """[V or A]; None if the drive varies."""
    checkpoint: bool
    shunt: bool


@dataclass(frozen=True)
class ProgrammePart:
    """Continuous part of a programme."""

    lead_time: float
    """Time [s] from the start to the counted part, at which the local time is zero."""
    duration: float
    """Total duration [s]."""
    motion: Callable[[Array], Kinematics]
    """Function that returns displacement [m] and its derivatives at local times [s]."""
    drive: Callable[[Array], Array]
    """Function that returns the drive [V or A] at local times [s]."""
    segments: tuple[PlannedSegment, ...] = ()


def plan(method: Method) -> Iterator[ProgrammePart]:
    """Yield the parts of a method, from displacement zero back to displacement zero.

    Raises:
        MethodError: a segment cannot be sampled.
    """
    position = 0.0
    names: set[str] = set()
    drive = 0.0
    for index, segment in enumerate(method.segments):
        stage = method.conditioning.between if index else method.conditioning.before
        if stage is not None and (stage.warm_up or stage.rest_s):
            yield from _plan_move(position, 0.0, drive, method.limits)
            yield from _plan_conditioning(stage)
            position = 0.0
        part = _make_part(method, segment, names)
        # The move to a segment uses the segment's first drive, so that the drive does not jump at its start.
        start, end = (segment.centre_m + offset for offset in find_end_positions(segment.motion))
        first, drive = (float(value) for value in part.drive(np.array([0.0, part.duration])))
        yield from _plan_move(position, start, first, method.limits)
        yield part
        position = end
    yield from _plan_move(position, 0.0, drive, method.limits)


def _make_part(method: Method, segment: MethodSegment, names: set[str]) -> ProgrammePart:
    """Make the part of a segment with its fades; each level of a staircase is a segment of the log."""
    duration = check_segment(segment, method.rate_hz)
    fade = segment.fade_s if is_oscillating(segment.motion) else 0.0
    cycle = find_period(segment.motion)

    def motion(time: Array) -> Kinematics:
        steady = sample_motion(segment.motion, time, duration)
        return (apply_fade(steady, time, duration, fade) if fade else steady).shift(segment.centre_m)

    def drive(time: Array) -> Array:
        return sample_drive(segment.drive, time, duration, cycle)

    return ProgrammePart(
        fade, duration + 2 * fade, motion, drive, _plan_segments(segment, duration, method.drive_unit, names)
    )


def _plan_segments(
    segment: MethodSegment, duration: float, unit: str, names: set[str]
) -> tuple[PlannedSegment, ...]:
    motion, drive = segment.motion, segment.drive
    amplitude = motion.amplitude_m if isinstance(motion, Sine | Triangle | Sweep) else None
    frequency = motion.frequency_hz if isinstance(motion, Sine | Triangle) else None
    sections: list[tuple[str, float, float, str, float | None]]
    if isinstance(drive, Staircase):
        share = duration / len(drive.levels)
        sections = [
            (f"{segment.name}_{level:g}{unit}", index * share, (index + 1) * share, "constant", level)
            for index, level in enumerate(drive.levels)
        ]
    else:
        value = drive.value if isinstance(drive, Constant) else None
        sections = [(segment.name, 0.0, duration, drive.kind, value)]
    return tuple(
        PlannedSegment(
            _make_unique_name(name, names),
            begin,
            end,
            motion.kind,
            kind,
            amplitude,
            frequency,
            level,
            segment.checkpoint and end == sections[-1][2],
            segment.shunt,
        )
        for name, begin, end, kind, level in sections
    )


def _make_unique_name(name: str, names: set[str]) -> str:
    """Return the name, with a number if it was used before."""
    number, unused = 1, name
    while unused in names:
        number += 1
        unused = f"{name}_{number}"
    names.add(unused)
    return unused


def _plan_move(start: float, end: float, drive: float, limits: MethodLimits) -> Iterator[ProgrammePart]:
    """Yield the move between two positions if they differ, at most at half of the limits."""
    if start == end:
        return
    duration = compute_move_duration(
        end - start,
        min(MOVE_VELOCITY, limits.velocity_mps / 2),
        min(MOVE_ACCELERATION, limits.acceleration_mps2 / 2),
    )
    yield ProgrammePart(
        0.0, duration, lambda time: compute_move(start, end, duration, time), _make_constant_drive(drive)
    )


def _plan_conditioning(stage: ConditioningStage) -> Iterator[ProgrammePart]:
    if stage.warm_up is not None:
        yield _plan_warm_up(stage.warm_up)
    if stage.rest_s:
        yield ProgrammePart(0.0, stage.rest_s, make_rest, _make_constant_drive(0.0))


def _plan_warm_up(warm_up: WarmUp) -> ProgrammePart:
    cycle = 1 / warm_up.motion.frequency_hz
    duration = warm_up.cycles * cycle

    def motion(time: Array) -> Kinematics:
        return apply_fade(sample_motion(warm_up.motion, time, duration), time, duration, cycle)

    return ProgrammePart(cycle, duration + 2 * cycle, motion, _make_constant_drive(warm_up.drive.value))


def _make_constant_drive(value: float) -> Callable[[Array], Array]:
    return lambda time: np.full_like(time, value)
