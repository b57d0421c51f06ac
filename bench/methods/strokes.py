"""From a motion of a document to exact displacement, velocity and acceleration.

Each function takes times [s] of shape (samples,), uniform, zero where the counted part begins; the oscillating
motions go on before and after it, so that they can be faded in and out.
"""

import math
from typing import assert_never

import numpy as np

from bench.methods.kinematics import Array, Kinematics, at_rest
from bench.methods.motion import (
    Hold,
    Motion,
    MotionTable,
    Multisine,
    Ramp,
    Random,
    Sine,
    Sweep,
    Triangle,
)


def stroke(motion: Motion, time: Array, duration: float) -> Kinematics:
    """The motion about its centre.

    Args:
        motion: what the document says.
        time: [s] of shape (samples,), uniform, zero where the counted part begins.
        duration: length of the counted part [s].
    """
    match motion:
        case Hold():
            return at_rest(time)
        case Ramp():
            return _ramp(motion, time, duration)
        case Sine():
            return _sine(motion.amplitude_m, motion.frequency_hz, 0.0, time)
        case Triangle():
            return _triangle(motion, time)
        case Sweep():
            return _sweep(motion, time, duration)
        case Multisine():
            return _multisine(motion, time)
        case Random():
            return _random(motion, time)
        case MotionTable():
            return _table(motion, time)
        case _:
            assert_never(motion)


def _sine(amplitude: float, frequency: float, phase: float, time: Array) -> Kinematics:
    turning = 2 * math.pi * frequency
    angle = turning * time + phase
    displacement = amplitude * np.sin(angle)
    return Kinematics(displacement, amplitude * turning * np.cos(angle), -(turning**2) * displacement)


def _ramp(motion: Ramp, time: Array, duration: float) -> Kinematics:
    """Trapezoid of velocity: way = V (T - V/a), of which V is the smaller root."""
    way = abs(motion.end_m - motion.start_m)
    corner = motion.corner_acceleration_mps2
    # Where the two corners just meet, rounding may leave the root a little less than nothing.
    velocity = corner / 2 * (duration - math.sqrt(max(duration**2 - 4 * way / corner, 0.0)))
    rounding = velocity / corner
    t = np.clip(time, 0.0, duration)
    left = np.minimum(t, duration - t)
    in_corner = left < rounding
    from_end = np.where(in_corner, corner / 2 * left**2, velocity * (left - rounding / 2))
    first_half = t < duration / 2
    sense = math.copysign(1.0, motion.end_m - motion.start_m)
    return Kinematics(
        motion.start_m + sense * np.where(first_half, from_end, way - from_end),
        sense * np.where(in_corner, corner * left, velocity),
        sense * np.where(in_corner & (left > 0), np.where(first_half, corner, -corner), 0.0),
    )


def _triangle(motion: Triangle, time: Array) -> Kinematics:
    """Folded onto the quarter cycle; amplitude = V T/4 - V²/(2a), of which V is the smaller root."""
    quarter = 1 / (4 * motion.frequency_hz)
    corner = motion.corner_acceleration_mps2
    velocity = corner * (quarter - math.sqrt(max(quarter**2 - 2 * motion.amplitude_m / corner, 0.0)))
    phase = np.mod(time + quarter, 4 * quarter) - quarter
    returning = phase > quarter
    u = np.where(returning, 2 * quarter - phase, phase)
    side = np.where(u < 0, -1.0, 1.0)
    to_corner = quarter - np.abs(u)
    in_corner = to_corner < velocity / corner
    return Kinematics(
        np.where(in_corner, side * (motion.amplitude_m - corner / 2 * to_corner**2), velocity * u),
        np.where(returning, -1.0, 1.0) * np.where(in_corner, corner * to_corner, velocity),
        np.where(in_corner, -side * corner, 0.0),
    )


def _sweep(motion: Sweep, time: Array, duration: float) -> Kinematics:
    """Frequency held at its first and last value outside the counted part."""
    start, end = motion.start_hz, motion.end_hz
    t = np.clip(time, 0.0, duration)
    if motion.law == "linear" or math.isclose(start, end):
        slope = (end - start) / duration
        frequency = start + slope * t
        rate = np.full_like(t, slope)
        cycles = (start + slope * t / 2) * t
    else:
        growth = math.log(end / start) / duration
        frequency = start * np.exp(growth * t)
        rate = growth * frequency
        cycles = (frequency - start) / growth
    turning = 2 * math.pi * frequency
    turning_rate = 2 * math.pi * np.where(t == time, rate, 0.0)
    angle = 2 * math.pi * (cycles + frequency * (time - t))
    sine, cosine = motion.amplitude_m * np.sin(angle), motion.amplitude_m * np.cos(angle)
    return Kinematics(sine, turning * cosine, turning_rate * cosine - turning**2 * sine)


def _multisine(motion: Multisine, time: Array) -> Kinematics:
    phases = np.random.default_rng(motion.seed).uniform(0.0, 2 * math.pi, len(motion.lines))
    lines = [
        _sine(line.amplitude_m, line.frequency_hz, phase, time)
        for line, phase in zip(motion.lines, phases, strict=True)
    ]
    return Kinematics(*(np.sum(parts, axis=0) for parts in zip(*lines, strict=True)))


def _random(motion: Random, time: Array) -> Kinematics:
    """Equal sines with random phases on every line of the band, summed by one inverse transform each."""
    count = len(time)
    # The noise repeats after as many samples as there are, one step beyond the last.
    spacing = float(time[-1] - time[0]) * count / (count - 1)
    frequency = np.fft.rfftfreq(count, spacing / count)
    band = (frequency >= motion.spectrum.low_hz) & (frequency <= motion.spectrum.high_hz)
    lines = int(band.sum())
    phases = np.random.default_rng(motion.seed).uniform(0.0, 2 * math.pi, lines)
    # The inverse transform gives a line of size s the amplitude 2 s / count; n sines of amplitude a have an rms of
    # a sqrt(n / 2), whatever their phases.
    size = motion.spectrum.rms_m * math.sqrt(2 / max(lines, 1)) * count / 2
    spectrum = np.zeros(len(frequency), dtype=np.complex128)
    spectrum[band] = size * np.exp(1j * phases)
    turning = 2j * math.pi * frequency
    return Kinematics(*(np.fft.irfft(spectrum * turning**order, count) for order in range(3)))


def _table(motion: MotionTable, time: Array) -> Kinematics:
    """The spline, over again for every further cycle."""
    from scipy.interpolate import CubicSpline

    length = motion.time_s[-1]
    spline = CubicSpline(motion.time_s, motion.displacement_m, bc_type="clamped")
    # The end of a cycle still belongs to it: the last sample must not jump back to the first point.
    cycle = np.maximum(np.ceil(time / length) - 1, 0.0)
    t = np.clip(time - cycle * length, 0.0, length)
    return Kinematics(*(np.asarray(spline(t, order), dtype=np.float64) for order in range(3)))
