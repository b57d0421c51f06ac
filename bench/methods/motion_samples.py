"""Exact displacement, velocity and acceleration of the motions of a method.

Times [s] have shape (samples,), are uniform, and are zero at the start of the counted part. Oscillating motions
continue before and after it, so that they can be faded in and out.
"""

import math
from typing import assert_never

import numpy as np

from bench.methods.kinematics import Array, Kinematics, make_rest
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


def sample_motion(motion: Motion, time: Array, duration: float) -> Kinematics:
    """Compute the samples of a motion relative to its centre.

    Args:
        motion: motion of a method.
        time: [s] of shape (samples,), uniform, zero at the start of the counted part.
        duration: duration of the counted part [s].
    """
    match motion:
        case Hold():
            return make_rest(time)
        case Ramp():
            return _sample_ramp(motion, time, duration)
        case Sine():
            return _sample_sine(motion.amplitude_m, motion.frequency_hz, 0.0, time)
        case Triangle():
            return _sample_triangle(motion, time)
        case Sweep():
            return _sample_sweep(motion, time, duration)
        case Multisine():
            return _sample_multisine(motion, time)
        case Random():
            return _sample_random(motion, time)
        case MotionTable():
            return _sample_table(motion, time)
        case _:
            assert_never(motion)


def _sample_sine(amplitude: float, frequency: float, phase: float, time: Array) -> Kinematics:
    turning = 2 * math.pi * frequency
    angle = turning * time + phase
    displacement = amplitude * np.sin(angle)
    return Kinematics(displacement, amplitude * turning * np.cos(angle), -(turning**2) * displacement)


def _sample_ramp(motion: Ramp, time: Array, duration: float) -> Kinematics:
    """Compute a trapezoid of velocity; V is the smaller root of distance = V (T - V/a)."""
    distance = abs(motion.end_m - motion.start_m)
    corner = motion.corner_acceleration_mps2
    # If the two corners just meet, rounding can make the radicand slightly negative.
    velocity = corner / 2 * (duration - math.sqrt(max(duration**2 - 4 * distance / corner, 0.0)))
    corner_time = velocity / corner
    t = np.clip(time, 0.0, duration)
    to_end = np.minimum(t, duration - t)
    in_corner = to_end < corner_time
    from_end = np.where(in_corner, corner / 2 * to_end**2, velocity * (to_end - corner_time / 2))
    first_half = t < duration / 2
    sign = math.copysign(1.0, motion.end_m - motion.start_m)
    return Kinematics(
        motion.start_m + sign * np.where(first_half, from_end, distance - from_end),
        sign * np.where(in_corner, corner * to_end, velocity),
        sign * np.where(in_corner & (to_end > 0), np.where(first_half, corner, -corner), 0.0),
    )


def _sample_triangle(motion: Triangle, time: Array) -> Kinematics:
    """Compute the triangle on a quarter cycle; V is the smaller root of amplitude = V T/4 - V²/(2a)."""
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


def _sample_sweep(motion: Sweep, time: Array, duration: float) -> Kinematics:
    """Compute the sweep; outside the counted part the first and last frequency are held."""
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


def _sample_multisine(motion: Multisine, time: Array) -> Kinematics:
    phases = np.random.default_rng(motion.seed).uniform(0.0, 2 * math.pi, len(motion.lines))
    lines = [
        _sample_sine(line.amplitude_m, line.frequency_hz, phase, time)
        for line, phase in zip(motion.lines, phases, strict=True)
    ]
    return Kinematics(*(np.sum(parts, axis=0) for parts in zip(*lines, strict=True)))


def _sample_random(motion: Random, time: Array) -> Kinematics:
    """Compute equal sines with random phases on all lines of the band, by inverse Fourier transforms."""
    count = len(time)
    # The period is the number of samples, one time step longer than from the first to the last.
    spacing = float(time[-1] - time[0]) * count / (count - 1)
    frequency = np.fft.rfftfreq(count, spacing / count)
    band = (frequency >= motion.spectrum.low_hz) & (frequency <= motion.spectrum.high_hz)
    lines = int(band.sum())
    phases = np.random.default_rng(motion.seed).uniform(0.0, 2 * math.pi, lines)
    # The inverse transform of a line of size s has the amplitude 2 s / count. The rms of n sines of amplitude a is
    # a sqrt(n / 2) for any phases.
    size = motion.spectrum.rms_m * math.sqrt(2 / max(lines, 1)) * count / 2
    spectrum = np.zeros(len(frequency), dtype=np.complex128)
    spectrum[band] = size * np.exp(1j * phases)
    turning = 2j * math.pi * frequency
    return Kinematics(*(np.fft.irfft(spectrum * turning**order, count) for order in range(3)))


def _sample_table(motion: MotionTable, time: Array) -> Kinematics:
    """Compute the spline, repeated for every cycle."""
    from scipy.interpolate import CubicSpline

    length = motion.time_s[-1]
    spline = CubicSpline(motion.time_s, motion.displacement_m, bc_type="clamped")
    # The end of a cycle belongs to it, so that the last sample does not jump back to the first point.
    cycle = np.maximum(np.ceil(time / length) - 1, 0.0)
    t = np.clip(time - cycle * length, 0.0, length)
    return Kinematics(*(np.asarray(spline(t, order), dtype=np.float64) for order in range(3)))
