"""The methods of a trial: rich ones, poor ones, and for each kind others that no diagnosis sees.

Each is a document that the bench compiles, and beside it the same strokes as samples, from which the sizes of the
effects are chosen; the bench's own fades and rests differ from those by less than matters there.
"""

from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from sim_rig.compiled import Array
from sim_rig.trial.specimens import SIZES

Kind = Literal["rich", "poor", "unseen_poor", "unseen_rich"]
RATE = 1000.0
"""[Hz] of commands and log."""
FADE = 0.5
"""[s] soft start and stop of a stroke."""
VARIANTS = 2
"""Methods of one kind for one damper."""
_QUICK = 0.4
"""[s] between the drive steps of the one segment that has many."""


class Stroke(NamedTuple):
    """One segment: a sine under a drive that goes in steps, or a rest."""

    amplitude: float
    """[m]; 0 for a rest."""
    frequency: float
    """[Hz]"""
    duration: float
    """[s] without fades."""
    drives: tuple[float, ...]
    """[V or A], each for the same time."""


def strokes(kind: Kind, size: str, seed: int, variant: int) -> tuple[Stroke, ...]:
    """The segments of a method for a damper of a size."""
    chance = np.random.default_rng([seed, 12, list(SIZES).index(size), variant, get_args(Kind).index(kind)])
    if kind == "poor":
        return (_sine(chance, size, 0.85, 1.5, 6, 5),)
    if kind == "unseen_poor":
        return (_sine(chance, size, 0.65, 1.1, 4, 4), _sine(chance, size, 0.95, 1.7, 5, 4))
    pause = Stroke(0.0, 1.0, 4.0, (0.0,))
    # Amplitudes, frequencies and the order of the drives of a run that no diagnosis sees are others.
    return (
        _sine(chance, size, 0.45, 2.6, 7, 4),
        _sine(chance, size, 1.0, 0.6, 2, 3),
        pause,
        _sine(chance, size, 1.0, 1.8, 5, 4),
        _steps(chance, size, 0.75, 1.25),
        pause,
        _sine(chance, size, 0.25, 4.0, 9, 3),
    )


def method_document(name: str, size: str, planned: tuple[Stroke, ...]) -> dict[str, Any]:
    """The method `mrbench.method/1` of these strokes."""
    limits = SIZES[size]
    return {
        "schema": "mrbench.method/1",
        "name": name,
        "title": "Strokes of a blind trial",
        "description": "Sines under constant drives, rests, and drive steps, as a blind trial has drawn them.",
        "rate_hz": RATE,
        "drive_kind": limits.drive_kind,
        "limits": {
            "stroke_m": 3 * limits.stroke,
            "velocity_mps": 1.0,
            "acceleration_mps2": 30.0,
            "force_n": 10 * limits.force,
            "drive": limits.drive,
        },
        "conditioning": {"before": {"rest_s": 0.5}, "between": {"rest_s": 0.3}},
        "segments": [_segment(place, stroke) for place, stroke in enumerate(planned)],
    }


def duration(planned: tuple[Stroke, ...]) -> float:
    """Of all strokes with their fades [s]."""
    return sum(stroke.duration + 2 * FADE for stroke in planned)


def samples(planned: tuple[Stroke, ...]) -> tuple[Array, Array]:
    """The strokes as commands: (N+1,) displacement [m] and (N,) drive [V or A], `RATE` samples a second."""
    parts = [_sampled(stroke) for stroke in planned]
    displacement = np.concatenate([part[0] for part in parts] + [np.zeros(1)])
    return displacement, np.concatenate([part[1] for part in parts])


def _sampled(stroke: Stroke) -> tuple[Array, Array]:
    time = np.arange(round((stroke.duration + 2 * FADE) * RATE)) / RATE - FADE
    into = np.clip(np.minimum(time + FADE, stroke.duration + FADE - time) / FADE, 0.0, 1.0)
    place = np.clip((time / stroke.duration * len(stroke.drives)).astype(int), 0, len(stroke.drives) - 1)
    motion = stroke.amplitude * np.sin(2 * np.pi * stroke.frequency * time)
    return motion * into**3 * (10 - 15 * into + 6 * into**2), np.asarray(stroke.drives)[place]


def _segment(place: int, stroke: Stroke) -> dict[str, Any]:
    if stroke.amplitude == 0:
        motion: dict[str, Any] = {"kind": "hold"}
    else:
        motion = {"kind": "sine", "amplitude_m": stroke.amplitude, "frequency_hz": stroke.frequency}
    step = stroke.duration / len(stroke.drives)
    if step > 2 * _QUICK:
        drive: dict[str, Any] = {"kind": "staircase", "levels": stroke.drives}
    else:
        times = [round(index * step, 9) for index in range(len(stroke.drives))]
        drive = {"kind": "steps", "time_s": times, "values": stroke.drives}
    name = (
        f"{place}_rest"
        if stroke.amplitude == 0
        else f"{place}_{stroke.amplitude * 1e3:.3g}mm_{stroke.frequency:.3g}Hz"
    )
    return {"name": name, "motion": motion, "fade_s": FADE, "duration_s": stroke.duration, "drive": drive}


def _sine(
    chance: np.random.Generator, size: str, share: float, frequency: float, cycles: int, levels: int
) -> Stroke:
    """Some cycles at each of some drives, the shares and frequencies a little off the given ones."""
    amplitude = round(SIZES[size].stroke * share * chance.uniform(0.9, 1.0), 4)
    hertz = round(frequency * chance.uniform(0.85, 1.15), 2)
    drives = np.linspace(0.0, 1.0, levels) * SIZES[size].drive
    order = chance.permutation(levels)
    return Stroke(amplitude, hertz, cycles * levels / hertz, tuple(round(float(drives[i]), 3) for i in order))


def _steps(chance: np.random.Generator, size: str, share: float, frequency: float) -> Stroke:
    """A stroke under a drive that jumps often."""
    sine = _sine(chance, size, share, frequency, 1, 2)
    length = round(8.0 * sine.frequency) / sine.frequency
    count = int(length / _QUICK)
    drives = chance.choice(np.linspace(0.0, 1.0, 6), count) * SIZES[size].drive
    return sine._replace(duration=length, drives=tuple(round(float(drive), 3) for drive in drives))
