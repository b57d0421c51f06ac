"""Synthetic recordings with known motion and noise."""

from collections.abc import Sequence

import numpy as np
from numpy.random import default_rng

from identification.arrays import Array
from identification.logs.recording import Segment, Stretch

RATE = 1000.0


def stretch(
    displacement: Array,
    force: Array | None = None,
    drive: Array | None = None,
    segments: Sequence[Segment] = (),
    velocity: Array | None = None,
    rate: float = RATE,
) -> Stretch:
    count = len(displacement)
    return Stretch(
        name="synthetic",
        time=np.arange(count) / rate,
        rate=rate,
        displacement=displacement,
        force=np.zeros(count) if force is None else force,
        drive=np.zeros(count) if drive is None else drive,
        velocity=velocity,
        segments=tuple(segments),
        force_filter=None,
        displacement_filter=None,
        force_delay=0.0,
        displacement_delay=0.0,
        drive_delay=0.0,
        measured=np.ones(count, bool),
    )


def sine_segment(start: int, stop: int, amplitude: float, frequency: float) -> Segment:
    return Segment(0, "sine", start, stop, "sine", amplitude, frequency, None)


def sine(amplitude: float, frequency: float, seconds: float = 8.0, rate: float = RATE) -> tuple[Array, Array]:
    """Return displacement [m] and velocity [m/s]."""
    angle = 2.0 * np.pi * frequency * np.arange(round(seconds * rate)) / rate
    return amplitude * np.sin(angle), amplitude * 2.0 * np.pi * frequency * np.cos(angle)


def recorded(displacement: Array, noise: float, digit: float = 1e-6, seed: int = 0) -> Array:
    """Return a displacement as recorded by a sensor with white noise and resolution [m]."""
    noisy = displacement + noise * default_rng(seed).standard_normal(len(displacement))
    return np.round(noisy / digit) * digit


def hysteresis(velocity: Array, level: Array | float = 1.0) -> Array:
    """Return a force [N] with the steep flanks of a yielding damper."""
    return 300.0 * level * np.tanh(velocity / 0.01) + 800.0 * velocity


def random_motion(seconds: float = 8.0, highest: float = 5.0, seed: int = 1) -> tuple[Array, Array]:
    """Return a displacement [m] of 5 mm rms below a frequency [Hz], and its velocity [m/s]."""
    count = 2 * round(seconds * RATE)
    frequency = np.fft.rfftfreq(count, 1.0 / RATE)
    lines = np.fft.rfft(default_rng(seed).standard_normal(count)) * (frequency <= highest)
    displacement = np.fft.irfft(lines)[: count // 2]
    velocity = np.fft.irfft(2j * np.pi * frequency * lines)[: count // 2]
    scale = 5e-3 / float(np.std(displacement))
    return scale * displacement, scale * velocity
