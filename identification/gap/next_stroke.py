"""The stroke that would best separate what the data leave open.

Trial segments inside the limits of the recording are simulated with each of the tied sets. What counts is the
difference of their forces that no refit could take away: linearised in the parameters of damper and effects, each
held as well as the recording already fixes it, over the noise (the T-optimal design of Atkinson and Fedorov 1975).
Whichever of two sets is the true one, the other is refitted: the worse of both cases counts. And where the sets
themselves stand far from the law, the error of their forms is large, too, and hides the difference as noise does.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.gap.explain import JointFit
from identification.prediction import rmse
from identification.problem import COORDINATE_COUNT
from identification.simulate import UNKNOWNS, ActiveEffect, Setting, Stroke, simulate

_RATE = 1000.0
_SECONDS = 6.0
"""[s] about as long as a segment is to be."""
_FADE = 0.5


@dataclass(frozen=True)
class Rival:
    """One set of effects with its best parameters."""

    names: tuple[str, ...]
    point: Coordinates
    effects: tuple[ActiveEffect, ...]
    probability: float
    """[1] weight among the rivals."""
    left: float
    """[1] part of the gap that the error of its forms leaves."""
    information: Array
    """(13 + P, 13 + P) what the recording says of coordinates and parameters of the effects [1/SI²]."""


@dataclass(frozen=True)
class Limits:
    """What a trial segment may reach: what the recording reached."""

    amplitude: float
    """[m]"""
    centre: float
    """[m]"""
    velocity: float
    """[m/s]"""
    frequency: float
    """[Hz]"""
    drives: tuple[float, float]
    """[V or A]"""


@dataclass(frozen=True)
class Choice:
    """The segment chosen."""

    segment: dict[str, Any]
    separates: list[list[str]]
    difference: float
    """[N] root mean square."""
    detectability: float
    """[1] that no refit takes away, over noise and error of the forms, times the root of the samples."""


def best_segment(rivals: Sequence[Rival], law: Coordinates, limits: Limits, noise: float) -> Choice | None:
    """The trial segment that separates the rivals best; None where there are fewer than two.

    Args:
        rivals: the tied sets.
        law: the damper without effects.
        limits: of motion and drive.
        noise: of the force [N].
    """
    best: Choice | None = None
    for segment, stroke in trials(limits) if len(rivals) > 1 else ():
        plain = simulate(Setting(law, y0=limits.centre), stroke).force
        answers = [_Answer.of(r, stroke, limits.centre, plain, noise) for r in rivals]
        pairs = [(a, b) for i, a in enumerate(answers) for b in answers[:i]]
        weights = np.array([a.rival.probability * b.rival.probability + 1e-12 for a, b in pairs])
        score = float(np.average([_told_apart(a, b, noise) for a, b in pairs], weights=weights))
        if np.isfinite(score) and (best is None or score > best.detectability):
            size = float(np.sqrt(np.average([rmse(a.force - b.force) ** 2 for a, b in pairs], weights=weights)))
            best = Choice(segment, [list(r.names) for r in rivals], size, score)
    return best


def information(fit: JointFit) -> Array:
    """(13 + P, 13 + P) what the recording says of coordinates and parameters of the effects [1/SI²].

    With lags, y(0) and what each log has of its own left free.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    mine = np.zeros(len(unknowns), bool)
    mine[:COORDINATE_COUNT] = mine[problem.first_effect : problem.first_own] = True
    H = fit.minimum.evaluation.hessian
    cross = H[np.ix_(mine, ~mine)]
    known = H[np.ix_(mine, mine)] - cross @ np.linalg.pinv(H[np.ix_(~mine, ~mine)]) @ cross.T
    back = np.zeros(known.shape)
    law = slice(0, COORDINATE_COUNT)
    back[law, law] = np.linalg.pinv(problem.space.slopes(unknowns[law]))
    at, scales = problem.first_effect, [np.empty(0)]
    for choice in fit.effects:
        scales.append(choice.slopes(unknowns[at : at + len(choice.quantities)]))
        at += len(choice.quantities)
    own = range(COORDINATE_COUNT, len(known))
    back[own, own] = 1.0 / np.concatenate(scales)
    return np.asarray(back.T @ known @ back)


@dataclass(frozen=True)
class _Answer:
    """What a set makes of a stroke."""

    rival: Rival
    force: Array
    """(N,) [N]"""
    slopes: Array
    """(N, 13 + P + 2) over all that another run may have otherwise.

    Coordinates, parameters of the effects, y(0) and the zero of the load cell.
    """
    blur: float
    """[N] noise and error of the forms."""

    @staticmethod
    def of(rival: Rival, stroke: Stroke, centre: float, plain: Array, noise: float) -> "_Answer":
        """Of a stroke on which the law alone makes a ``plain`` force (N,) [N]."""
        found = simulate(Setting(rival.point, y0=centre, effects=rival.effects), stroke, slopes=True)
        own = range(len(UNKNOWNS), found.slopes.shape[1])
        columns = [*range(COORDINATE_COUNT), *own, UNKNOWNS.index("y0")]
        slopes = np.column_stack([found.slopes[:, columns], np.ones(len(found.force))])
        blur = math.hypot(noise, math.sqrt(rival.left) * rmse(found.force - plain))
        return _Answer(rival, found.force, slopes, blur)


def _told_apart(one: _Answer, other: _Answer, noise: float) -> float:
    """What no refit takes away of the difference of two sets, over what hides it [1]."""
    difference = one.force - other.force
    left = min(_left(difference / noise, answer.slopes / noise, answer.rival) for answer in (one, other))
    return left * noise / max(one.blur, other.blur)


def _left(difference: Array, J: Array, held: Rival) -> float:
    """Norm [1] of what a refit of one set cannot take away of a difference (N,), both over the noise."""
    normal, known = J.T @ J, len(held.information)
    normal[:known, :known] += held.information
    # What moves nothing on this stroke is known from the recording alone: both together set the scale.
    size = np.sqrt(np.diag(normal))
    size[size == 0.0] = 1.0
    right = (J.T @ difference) / size
    taken = float(right @ np.linalg.lstsq(normal / np.outer(size, size), right, rcond=1e-12)[0])
    return math.sqrt(max(float(difference @ difference) - taken, 0.0))


def trials(limits: Limits) -> Iterator[tuple[dict[str, Any], Stroke]]:
    """Segments of a method with the strokes they make."""
    low, high = limits.drives
    levels = sorted({low, 0.5 * (low + high), high})
    drives: list[dict[str, Any]] = [{"kind": "constant", "value": round(level, 4)} for level in levels]
    if high > low:
        up = [round(v, 4) for v in (low, 0.5 * (low + high), high, 0.5 * (low + high), low)]
        drives.append({"kind": "staircase", "levels": up})
    for motion in _motions(limits):
        for drive in drives:
            cycles = _cycles(motion["frequency_hz"], len(drive.get("levels", [0])))
            segment = {
                "name": _name(motion, drive),
                "motion": motion,
                "centre_m": round(limits.centre, 5),
                "fade_s": _FADE,
                "cycles": cycles,
                "drive": drive,
            }
            yield segment, _stroke(motion, drive, limits.centre, cycles)


def _cycles(frequency: float, levels: int) -> int:
    """Cycles that last about six seconds, as many at every level of the drive."""
    return levels * max(1, round(_SECONDS * frequency / levels))


def _motions(limits: Limits) -> Iterator[dict[str, Any]]:
    """Sines from slow and long to swift and short, and a triangle: constant velocity, no acceleration."""
    for share in (1.0, 0.5, 0.2):
        amplitude = share * limits.amplitude
        highest = min(limits.velocity / (2 * np.pi * amplitude), 2.0 * limits.frequency)
        for part in (1.0, 0.4, 0.15):
            yield {
                "kind": "sine",
                "amplitude_m": float(f"{amplitude:.3g}"),
                "frequency_hz": float(f"{max(part * highest, 0.2):.3g}"),
            }
    frequency = float(f"{max(0.3 * limits.velocity / (4 * limits.amplitude), 0.2):.3g}")
    amplitude = float(f"{limits.amplitude:.3g}")
    yield {
        "kind": "triangle",
        "amplitude_m": amplitude,
        "frequency_hz": frequency,
        "corner_acceleration_mps2": float(f"{300 * amplitude * frequency**2:.3g}"),
    }


def _name(motion: dict[str, Any], drive: dict[str, Any]) -> str:
    size = f"{1e3 * motion['amplitude_m']:.3g}mm_{motion['frequency_hz']:.3g}Hz"
    level = f"{drive['value']:.3g}" if drive["kind"] == "constant" else "steps"
    return f"next_{motion['kind']}_{size}_{level}"


def _stroke(motion: dict[str, Any], drive: dict[str, Any], centre: float, cycles: int) -> Stroke:
    """The segment as samples, without its fades."""
    seconds = cycles / motion["frequency_hz"]
    time = np.arange(round(seconds * _RATE)) / _RATE
    amplitude, omega = motion["amplitude_m"], 2 * np.pi * motion["frequency_hz"]
    if motion["kind"] == "sine":
        x, v = amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)
        a = -amplitude * omega**2 * np.sin(omega * time)
    else:
        round_off = 0.98
        shape = np.arcsin(round_off * np.sin(omega * time)) / np.arcsin(round_off)
        x = amplitude * shape
        v = np.gradient(x, time)
        a = np.gradient(v, time)
    levels = drive.get("levels") or [drive["value"]]
    steps = np.asarray(levels)[np.minimum((time / seconds * len(levels)).astype(int), len(levels) - 1)]
    return Stroke(_RATE, centre + x, v, a, steps.astype(float))
