"""Strokes of a drawn method: sines that fade in and out, rests, triangles and random motion, at stepped drives."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

METHODS = ("rich", "rich", "rich", "campaign", "poor", "mixed", "random")
"""Kinds of methods, as often as they are drawn; ``sweep`` is drawn only where it is asked for."""
_STEP = 5e-5
"""Longest step of the integration [s]."""
_RANDOM_WAVES = 12
"""Waves of a random motion."""
_SWEEP = (0.25, 4.0)
"""First and last frequency of a sweep, over that of the sines [1]."""
_LONGEST = 140.0
"""Longest duration of the segments, without rounding [s]; a slower damper moves faster instead."""


class Strokes(NamedTuple):
    """Motion and drive every half step of the integration, (2 K + 1,) each."""

    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    acceleration: Array
    """[m/s²]"""
    drive: Array
    """[V or A]"""
    step: float
    """Step of the integration [s]."""
    stride: int
    """Steps in a sample."""
    amplitude: float
    """Largest amplitude of the sines [m]."""
    peak_speed: float
    """[m/s]"""

    @property
    def time(self) -> Array:
        """Time of every half step [s]."""
        return np.asarray(0.5 * self.step * np.arange(len(self.drive)), float)

    def sample(self, values: Array) -> Array:
        """Return the values at the samples."""
        return values[:: 2 * self.stride]


class _Segment(NamedTuple):
    motion: str
    amplitude: float
    frequency: float
    drive: float | None
    """None for steps at random times."""
    duration: float


def draw_strokes(
    random: np.random.Generator, kind: str, amplitude: float, frequency: float, drive: float, rate: float
) -> Strokes:
    """Draw the strokes of a kind of method.

    Args:
        random: source of random numbers.
        kind: one of `METHODS`, or ``sweep``.
        amplitude: largest amplitude of a sine [m].
        frequency: its frequency [Hz].
        drive: highest drive [V or A].
        rate: sampling rate [Hz].
    """
    segments = _draw_segments(random, kind, amplitude, frequency, drive)
    faster = max(sum(s.duration for s in segments) / _LONGEST, 1.0)
    stride = int(np.ceil(1.0 / (rate * _STEP)))
    step = 1.0 / (rate * stride)
    parts = [_play(random, s, 0.5 * step, 2 * stride, rate, faster, drive) for s in segments]
    x, u = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    count = (len(x) - 1) // (2 * stride) * (2 * stride) + 1
    x, u = x[:count], u[:count]
    v = np.asarray(np.gradient(x, 0.5 * step), float)
    a = np.asarray(np.gradient(v, 0.5 * step), float)
    return Strokes(x, v, a, u, step, stride, amplitude, float(np.abs(v).max()))


def _draw_segments(
    random: np.random.Generator, kind: str, amplitude: float, frequency: float, drive: float
) -> list[_Segment]:
    levels = [float(u) for u in drive * np.linspace(0.0, 1.0, int(random.integers(3, 5)))]
    smaller, faster = amplitude * random.uniform(0.35, 0.65), frequency * random.uniform(2.0, 3.2)
    rich = [(a, f, u) for a in (amplitude, smaller) for f in (frequency, faster) for u in levels]
    cycles = int(random.integers(3, 6))
    plans: dict[str, tuple[list[tuple[float, float, float]], int, int]] = {
        "rich": ([rich[i] for i in random.permutation(len(rich))[:12]], cycles, 1),
        "campaign": ([*((amplitude, frequency, u) for u in levels), (smaller, faster, levels[-1])], 12, 0),
        "poor": ([(amplitude, frequency, u) for u in (levels[0], levels[-1], levels[0], levels[-1])], 8, 0),
        "mixed": ([(amplitude, frequency, levels[1])], 4, 3),
        "random": ([], 0, 4),
        "sweep": ([], 0, 0),
    }
    sines, cycles, randoms = plans[kind]
    segments: list[_Segment] = []
    for a, f, u in sines:
        segments.append(_Segment("sine", a, f, u, cycles / f))
        if random.random() < 0.3:
            segments.append(_Segment("rest", 0.0, frequency, u, random.uniform(0.3, 1.2) / frequency))
    segments += [_Segment("random", amplitude, frequency, None, 16.0 / frequency)] * randoms
    if kind == "sweep":
        segments += [_Segment("sweep", amplitude, frequency, u, 16.0 / frequency) for u in levels]
    if kind == "rich" and random.random() < 0.4:
        segments.append(_Segment("triangle", amplitude, 0.7 * frequency, levels[1], 4.0 / frequency))
    return segments


def _play(
    random: np.random.Generator, s: _Segment, step: float, grid: int, rate: float, faster: float, drive: float
) -> tuple[Array, Array]:
    """Return displacement and drive of a segment every half step, a whole number of samples long."""
    frequency, duration = s.frequency * faster, s.duration / faster
    time = np.asarray(step * np.arange(round(duration * rate) * grid), float)
    edge = np.minimum(time, duration - time) / min(0.5 / frequency, 0.25 * duration)
    fade = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
    x = s.amplitude * _SHAPES[s.motion](random, time, frequency) * fade
    if s.drive is not None:
        return x, np.full(len(time), s.drive)
    held = random.uniform(0.8, 2.5) / frequency
    levels = drive * random.choice([0.0, 0.25, 0.5, 0.75, 1.0], int(duration / held) + 2)
    return x, levels[(time / held).astype(int)]


def _make_sine(random: np.random.Generator, time: Array, frequency: float) -> Array:
    return np.asarray(np.sin(2.0 * np.pi * frequency * time))


def _make_rest(random: np.random.Generator, time: Array, frequency: float) -> Array:
    return np.zeros(len(time))


def _make_triangle(random: np.random.Generator, time: Array, frequency: float) -> Array:
    """Return a triangle without its harmonics from the ninth on, so that its corners are round."""
    orders = np.array([1, 3, 5, 7])
    waves = [(-1.0) ** (k // 2) / k**2 * np.sin(2.0 * np.pi * k * frequency * time) for k in orders]
    return np.asarray(np.sum(waves, axis=0) / np.sum(1.0 / orders**2))


def _make_sweep(random: np.random.Generator, time: Array, frequency: float) -> Array:
    """Return a sine of rising frequency, whose amplitude falls so that the speed does not rise."""
    low, high = _SWEEP
    rate = frequency * low * (high / low) ** (time / time[-1])
    phase = 2.0 * np.pi * np.cumsum(rate) * time[1]
    return np.asarray(np.sin(phase) * np.minimum(frequency / rate, 1.0))


def _make_random(random: np.random.Generator, time: Array, frequency: float) -> Array:
    rates = frequency * np.exp(random.uniform(np.log(0.4), np.log(3.0), _RANDOM_WAVES))
    phases = random.uniform(0.0, 2.0 * np.pi, _RANDOM_WAVES)
    waves = [np.sin(2.0 * np.pi * f * time + p) / f for f, p in zip(rates, phases, strict=True)]
    x = np.sum(waves, axis=0)
    return np.asarray(x / np.abs(x).max())


_SHAPES: dict[str, Callable[[np.random.Generator, Array, float], Array]] = {
    "sine": _make_sine,
    "rest": _make_rest,
    "sweep": _make_sweep,
    "triangle": _make_triangle,
    "random": _make_random,
}
"""Motion of amplitude 1 by name."""
