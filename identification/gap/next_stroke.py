"""The stroke that would best separate what the data leave open.

Trial segments inside the limits of the recording are simulated with each of the tied sets. What counts is the
difference of their forces that no refit could take away: linearised in the damper's parameters, each held as well
as the recording already fixes it, over the noise (the T-optimal design of Atkinson and Fedorov 1975).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.simulate import UNKNOWNS, ActiveEffect, Setting, Stroke, simulate

_RATE = 1000.0
_SECONDS = 6.0
"""[s] about as long as a segment is to be."""
_FADE = 0.5
_COLUMNS = [*range(13), UNKNOWNS.index("y0")]


@dataclass(frozen=True)
class Rival:
    """One set of effects with its best parameters."""

    names: tuple[str, ...]
    point: Coordinates
    effects: tuple[ActiveEffect, ...]
    probability: float
    """[1] weight among the rivals."""
    information: Array
    """(13, 13) what the recording says of the coordinates."""


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
    """[1] that no refit takes away, over the noise, times the root of the samples."""


def best_segment(rivals: Sequence[Rival], limits: Limits, noise: float) -> Choice | None:
    """The trial segment that separates the rivals best; None where there are fewer than two.

    Args:
        rivals: the tied sets.
        limits: of motion and drive.
        noise: of the force [N].
    """
    pairs = [(a, b) for i, a in enumerate(rivals) for b in rivals[:i]]
    best: Choice | None = None
    for segment, stroke in trials(limits) if pairs else ():
        forces = {r.names: _answer(r, stroke, limits.centre) for r in rivals}
        scores = [_separation(forces[a.names], forces[b.names], a, noise) for a, b in pairs]
        weights = np.array([a.probability * b.probability for a, b in pairs])
        score = float(np.sum(weights * np.array([s for s, _ in scores])) / max(float(weights.sum()), 1e-12))
        if np.isfinite(score) and (best is None or score > best.detectability):
            size = float(np.sqrt(np.average([d**2 for _, d in scores], weights=weights + 1e-12)))
            best = Choice(segment, [list(r.names) for r in rivals], size, score)
    return best


def _answer(rival: Rival, stroke: Stroke, centre: float) -> tuple[Array, Array]:
    """Force (N,) of a set on a stroke and its slopes (N, 14) over coordinates and y(0)."""
    found = simulate(Setting(rival.point, y0=centre, effects=rival.effects), stroke, slopes=True)
    return found.force, found.slopes[:, _COLUMNS]


def _separation(
    one: tuple[Array, Array], other: tuple[Array, Array], held: Rival, noise: float
) -> tuple[float, float]:
    """What no refit takes away of the difference, over the noise [1]; and the plain difference [N]."""
    difference = (one[0] - other[0]) / noise
    J = one[1] / noise
    size = np.maximum(np.sqrt(np.sum(J * J, axis=0)), 1e-12)
    known = np.zeros((len(size), len(size)))
    known[:13, :13] = held.information
    normal = (J.T @ J + known) / np.outer(size, size)
    right = (J.T @ difference) / size
    taken = float(right @ np.linalg.lstsq(normal, right, rcond=1e-12)[0])
    left = max(float(difference @ difference) - taken, 0.0)
    return float(np.sqrt(left)), noise * float(np.sqrt(np.mean(difference**2)))


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
