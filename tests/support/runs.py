"""Short recordings of the laboratory damper, with an effect in a form outside the library."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.random import default_rng

from identification.arrays import Array
from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import PARAMETER_SETS
from identification.logs.recording import Recording, Segment
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.strokes import stretch

RATE = 500.0
NOISE = 2.5
STROKES = ((0.012, 1.0, 2.0), (0.006, 3.0, 1.0), (0.01, 2.0, 1.0))
"""Amplitude [m], frequency [Hz] and duration [s] at each drive."""
DRIVES = (0.0, 0.2, 0.4, 0.5, 0.3, 0.1)


def stiffening(x: Array, v: Array) -> Array:
    """Return the force [N] of isothermal gas that is compressed at negative displacement."""
    return -60.0 * (1.0 / (1.0 + x / 0.03) - 1.0)


def run(
    extra_force: Callable[[Array, Array], Array] | None = None, specimen: str = "LAB-001", seed: int = 0
) -> Recording:
    """Return a recording; ``extra_force`` computes a force [N] from displacement [m] and velocity [m/s]."""
    amplitude, frequency, drive, segments = _plan()
    angle = 2 * np.pi * np.cumsum(frequency) / RATE
    x = amplitude * np.sin(angle)
    v = np.gradient(x) * RATE
    stroke = Excitation(RATE, x, v, np.gradient(v) * RATE, drive)
    point = to_coordinates(PARAMETER_SETS["laboratory"].parameters)
    force = simulate(SimulationModel(point), stroke).force + (0.0 if extra_force is None else extra_force(x, v))
    random = default_rng(seed)
    recorded = x + 2e-6 * random.standard_normal(len(x))
    made = stretch(recorded, force + NOISE * random.standard_normal(len(x)), drive, segments, rate=RATE)
    metadata = {"run": {"source": "import", "specimen": specimen}}
    return Recording(Path("made_up.mcap"), "0" * 64, "coil_v", "V", (made,), metadata)


def _plan() -> tuple[Array, Array, Array, tuple[Segment, ...]]:
    """Return amplitude [m], frequency [Hz] and drive [V] of every sample, and the segments."""
    amplitude, frequency, drive, segments, start = [], [], [], [], 0
    for size, rate, seconds in STROKES:
        for level in DRIVES:
            count = round(seconds * RATE)
            name = f"{1e3 * size:g}mm_{rate:g}Hz_{level:g}V"
            segments.append(Segment(len(segments), name, start, start + count, "sine", size, rate, level))
            start += count
            amplitude.append(np.full(count, size))
            frequency.append(np.full(count, rate))
            drive.append(np.full(count, level))
    smooth = np.hanning(61) / np.hanning(61).sum()

    def blended(parts: list[Array]) -> Array:
        return np.convolve(np.pad(np.concatenate(parts), 30, "edge"), smooth, "valid")

    return blended(amplitude), blended(frequency), np.concatenate(drive), tuple(segments)
