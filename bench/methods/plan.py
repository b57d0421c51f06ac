"""From a method to the pieces that follow one another on its time line.

A piece is a stroke with its fades, a move from one centre to the next, a warm-up or a rest. Every piece begins and
ends at rest where its neighbours do, so displacement and velocity are continuous over the whole programme.
Times are real numbers here; only ``compile.py`` knows samples.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bench.methods.checks import counted_length
from bench.methods.document import Limits, Method, Segment, Stage, WarmUp
from bench.methods.drive import Constant, Staircase, drive_values
from bench.methods.kinematics import Array, Kinematics, at_rest, faded, move, move_duration
from bench.methods.motion import Sine, Sweep, Triangle, ends, oscillates, period
from bench.methods.strokes import stroke

MOVE_VELOCITY = 0.05
"""[m/s] velocity of moves between centres, where the limits allow it."""
MOVE_ACCELERATION = 0.5
"""[m/s²] acceleration of these moves, where the limits allow it."""


@dataclass(frozen=True)
class Mark:
    """A named part of a piece: a segment of the log."""

    name: str
    begin: float
    """[s] from the start of the piece's counted part."""
    end: float
    """[s] from there."""
    motion: str
    drive: str
    amplitude: float | None
    """[m] where the motion has one."""
    frequency: float | None
    """[Hz] where the motion has one."""
    drive_value: float | None
    """[V or A] where the drive is constant."""
    checkpoint: bool


@dataclass(frozen=True)
class Piece:
    """A part of the time line."""

    lead: float
    """[s] from the piece's start to its counted part, where its local time is zero."""
    duration: float
    """[s] of the piece as a whole."""
    motion: Callable[[Array], Kinematics]
    """Displacement [m] and its derivatives at local times [s]."""
    drive: Callable[[Array], Array]
    """Drive [V or A] at local times [s]."""
    marks: tuple[Mark, ...] = ()
    """The segments in it."""


def plan(method: Method) -> Iterator[Piece]:
    """The pieces of a method, from displacement zero back to displacement zero.

    Raises:
        MethodError: a segment asks for what cannot be made into samples.
    """
    place = 0.0
    names: set[str] = set()
    drive = 0.0
    for index, segment in enumerate(method.segments):
        stage = method.conditioning.between if index else method.conditioning.before
        if stage is not None and (stage.warm_up or stage.rest_s):
            yield from _moved(place, 0.0, drive, method.limits)
            yield from _conditioning(stage)
            place = 0.0
        piece = _piece(method, segment, names)
        # A move to the segment is made under its first drive: the coil need not jump when it begins.
        start, end = (segment.centre_m + offset for offset in ends(segment.motion))
        first, drive = (float(value) for value in piece.drive(np.array([0.0, piece.duration])))
        yield from _moved(place, start, first, method.limits)
        yield piece
        place = end
    yield from _moved(place, 0.0, drive, method.limits)


def _piece(method: Method, segment: Segment, names: set[str]) -> Piece:
    """One segment with its fades; each level of a staircase is marked."""
    duration = counted_length(segment, method.rate_hz)
    fade = segment.fade_s if oscillates(segment.motion) else 0.0
    cycle = period(segment.motion)

    def motion(time: Array) -> Kinematics:
        steady = stroke(segment.motion, time, duration)
        return (faded(steady, time, duration, fade) if fade else steady).about(segment.centre_m)

    def drive(time: Array) -> Array:
        return drive_values(segment.drive, time, duration, cycle)

    return Piece(fade, duration + 2 * fade, motion, drive, _marks(segment, duration, method.drive_unit, names))


def _marks(segment: Segment, duration: float, unit: str, names: set[str]) -> tuple[Mark, ...]:
    motion, drive = segment.motion, segment.drive
    amplitude = motion.amplitude_m if isinstance(motion, Sine | Triangle | Sweep) else None
    frequency = motion.frequency_hz if isinstance(motion, Sine | Triangle) else None
    parts: list[tuple[str, float, float, str, float | None]]
    if isinstance(drive, Staircase):
        share = duration / len(drive.levels)
        parts = [
            (f"{segment.name}_{level:g}{unit}", index * share, (index + 1) * share, "constant", level)
            for index, level in enumerate(drive.levels)
        ]
    else:
        value = drive.value if isinstance(drive, Constant) else None
        parts = [(segment.name, 0.0, duration, drive.kind, value)]
    return tuple(
        Mark(
            _unused(name, names),
            begin,
            end,
            motion.kind,
            kind,
            amplitude,
            frequency,
            level,
            segment.checkpoint and end == parts[-1][2],
        )
        for name, begin, end, kind, level in parts
    )


def _unused(name: str, names: set[str]) -> str:
    """The name, with a number where a level comes again."""
    number, unused = 1, name
    while unused in names:
        number += 1
        unused = f"{name}_{number}"
    names.add(unused)
    return unused


def _moved(start: float, end: float, drive: float, limits: Limits) -> Iterator[Piece]:
    """The move between two places, if they differ, at half of what the limits allow or slower."""
    if start == end:
        return
    duration = move_duration(
        end - start,
        min(MOVE_VELOCITY, limits.velocity_mps / 2),
        min(MOVE_ACCELERATION, limits.acceleration_mps2 / 2),
    )
    yield Piece(0.0, duration, lambda time: move(start, end, duration, time), _steady(drive))


def _conditioning(stage: Stage) -> Iterator[Piece]:
    if stage.warm_up is not None:
        yield _warm_up(stage.warm_up)
    if stage.rest_s:
        yield Piece(0.0, stage.rest_s, at_rest, _steady(0.0))


def _warm_up(warm_up: WarmUp) -> Piece:
    cycle = 1 / warm_up.motion.frequency_hz
    duration = warm_up.cycles * cycle

    def motion(time: Array) -> Kinematics:
        return faded(stroke(warm_up.motion, time, duration), time, duration, cycle)

    return Piece(cycle, duration + 2 * cycle, motion, _steady(warm_up.drive.value))


def _steady(value: float) -> Callable[[Array], Array]:
    return lambda time: np.full_like(time, value)
