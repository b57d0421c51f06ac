"""Methods of a trial: rich and poor ones for the diagnosis, and further ones of each kind for validation.

Each exists as a document that the bench compiles, and as samples by which the sizes of the effects are chosen.
Fades and rests of the bench differ slightly from those of the samples, which does not matter for the sizes.
"""

from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from sim_rig.plant import Array
from sim_rig.trial.cases.specimens import SIZES

RunKind = Literal["rich", "poor", "validation_poor", "validation_rich"]
"""Kind of a method; the position in this list seeds its random numbers, so the order must stay."""
RATE = 1000.0
"""[Hz] sampling rate of commands and log."""
FADE = 0.5
"""[s] fade at the start and the end of a stroke."""
VARIANTS = 2
"""Number of methods of one kind for one damper."""
_STEP_PERIOD = 0.4
"""[s] between the drive steps of the segment with many steps."""


class PlannedStroke(NamedTuple):
    """One segment: a sine under a stepwise drive, or a rest."""

    amplitude: float
    """[m]; 0 for a rest."""
    frequency: float
    """[Hz]"""
    duration: float
    """[s] without fades."""
    drives: tuple[float, ...]
    """[V or A], each for the same duration."""


def make_strokes(kind: RunKind, size: str, seed: int, variant: int) -> tuple[PlannedStroke, ...]:
    """Draw the segments of a method for a damper of a size."""
    random = np.random.default_rng([seed, 12, list(SIZES).index(size), variant, get_args(RunKind).index(kind)])
    if kind == "poor":
        return (_draw_sine(random, size, 0.85, 1.5, 6, 5),)
    if kind == "validation_poor":
        return (_draw_sine(random, size, 0.65, 1.1, 4, 4), _draw_sine(random, size, 0.95, 1.7, 5, 4))
    pause = PlannedStroke(0.0, 1.0, 4.0, (0.0,))
    # A validation method has other amplitudes, frequencies and drive orders, by its seed.
    return (
        _draw_sine(random, size, 0.45, 2.6, 7, 4),
        _draw_sine(random, size, 1.0, 0.6, 2, 3),
        pause,
        _draw_sine(random, size, 1.0, 1.8, 5, 4),
        _draw_steps(random, size, 0.75, 1.25),
        pause,
        _draw_sine(random, size, 0.25, 4.0, 9, 3),
    )


def make_method_document(name: str, size: str, strokes: tuple[PlannedStroke, ...]) -> dict[str, Any]:
    """Return the method document `mrbench.method/1` of these strokes."""
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
        "segments": [_make_segment(index, stroke) for index, stroke in enumerate(strokes)],
    }


def compute_duration(strokes: tuple[PlannedStroke, ...]) -> float:
    """Return the duration of all strokes with their fades [s]."""
    return sum(stroke.duration + 2 * FADE for stroke in strokes)


def sample_strokes(strokes: tuple[PlannedStroke, ...]) -> tuple[Array, Array]:
    """Return the strokes as commands at `RATE`: (N+1,) displacement [m] and (N,) drive [V or A]."""
    parts = [_sample_stroke(stroke) for stroke in strokes]
    displacement = np.concatenate([part[0] for part in parts] + [np.zeros(1)])
    return displacement, np.concatenate([part[1] for part in parts])


def _sample_stroke(stroke: PlannedStroke) -> tuple[Array, Array]:
    time = np.arange(round((stroke.duration + 2 * FADE) * RATE)) / RATE - FADE
    fade = np.clip(np.minimum(time + FADE, stroke.duration + FADE - time) / FADE, 0.0, 1.0)
    index = np.clip((time / stroke.duration * len(stroke.drives)).astype(int), 0, len(stroke.drives) - 1)
    motion = stroke.amplitude * np.sin(2 * np.pi * stroke.frequency * time)
    return motion * fade**3 * (10 - 15 * fade + 6 * fade**2), np.asarray(stroke.drives)[index]


def _make_segment(index: int, stroke: PlannedStroke) -> dict[str, Any]:
    if stroke.amplitude == 0:
        motion: dict[str, Any] = {"kind": "hold"}
    else:
        motion = {"kind": "sine", "amplitude_m": stroke.amplitude, "frequency_hz": stroke.frequency}
    step = stroke.duration / len(stroke.drives)
    if step > 2 * _STEP_PERIOD:
        drive: dict[str, Any] = {"kind": "staircase", "levels": stroke.drives}
    else:
        times = [round(i * step, 9) for i in range(len(stroke.drives))]
        drive = {"kind": "steps", "time_s": times, "values": stroke.drives}
    name = (
        f"{index}_rest"
        if stroke.amplitude == 0
        else f"{index}_{stroke.amplitude * 1e3:.3g}mm_{stroke.frequency:.3g}Hz"
    )
    return {"name": name, "motion": motion, "fade_s": FADE, "duration_s": stroke.duration, "drive": drive}


def _draw_sine(
    random: np.random.Generator, size: str, amplitude_ratio: float, frequency: float, cycles: int, levels: int
) -> PlannedStroke:
    """Draw a sine with some cycles at each of some drives, near the given amplitude ratio and frequency."""
    amplitude = round(SIZES[size].stroke * amplitude_ratio * random.uniform(0.9, 1.0), 4)
    hertz = round(frequency * random.uniform(0.85, 1.15), 2)
    drives = np.linspace(0.0, 1.0, levels) * SIZES[size].drive
    order = random.permutation(levels)
    return PlannedStroke(
        amplitude, hertz, cycles * levels / hertz, tuple(round(float(drives[i]), 3) for i in order)
    )


def _draw_steps(random: np.random.Generator, size: str, amplitude_ratio: float, frequency: float) -> PlannedStroke:
    """Draw a stroke under a drive with many steps."""
    sine = _draw_sine(random, size, amplitude_ratio, frequency, 1, 2)
    length = round(8.0 * sine.frequency) / sine.frequency
    count = int(length / _STEP_PERIOD)
    drives = random.choice(np.linspace(0.0, 1.0, 6), count) * SIZES[size].drive
    return sine._replace(duration=length, drives=tuple(round(float(drive), 3) for drive in drives))
