"""Fit problems of the laboratory damper with known noise of the force and exact motion."""

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.recording_scales import RecordingScales
from identification.fitting.search_space import SearchSpace
from identification.simulate import Excitation, SimulationModel, simulate

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
RATE, NOISE = 1000.0, 2.5
SCALES = RecordingScales(force=200.0, length=0.01, velocity=0.1, drive=0.5, sampling_rate=RATE, duration=6.0)
LEVELS = (0.0, 0.3, 0.1, 0.5, 0.2, 0.4)


def sine(amplitude, frequency, seconds=6.0, levels=LEVELS):
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    drive = np.array(levels)[np.minimum((t * len(levels) / seconds).astype(int), len(levels) - 1)]
    x = amplitude * np.sin(w * t)
    return Excitation(RATE, x, amplitude * w * np.cos(w * t), -w * w * x, drive)


def recorded(c, stroke, seed, noise=NOISE):
    force = simulate(SimulationModel(c, y0=2e-4), stroke, max_travel=0.005).force
    return force + noise * np.random.default_rng(seed).standard_normal(len(force))


def problem_of(c, strokes, seed=0, drives=(0.0, 0.5), prior=20e-6):
    pieces = [Piece(f"s{i}", s, recorded(c, s, seed + i), np.ones(len(s.drive))) for i, s in enumerate(strokes)]
    return Problem(tuple(pieces), SearchSpace(*drives, SCALES), NOISE, prior)


STROKES = [sine(0.005, 2.5), sine(0.010, 1.0), sine(0.015, 2.0)]


def piece_of(stroke, force=None, **more):
    """Return a piece of which every sample is used; without a force, the force is zero."""
    count = len(stroke.displacement)
    return Piece("p", stroke, np.zeros(count) if force is None else force, np.ones(count), **more)


def linear_force(stroke, scale=1.0):
    """Return the force [N] of friction, damping and a spring without dynamics."""
    v, u = stroke.velocity, stroke.sampled_drive
    return scale * (
        (50.0 + 400.0 * u) * np.sign(v) + (600.0 + 1500.0 * u) * v + 3000.0 * stroke.displacement - 20.0
    )


SLIDING_STROKES = [sine(0.01, 2.0), sine(0.005, 1.0)]
SLIDING = [piece_of(s, linear_force(s)) for s in SLIDING_STROKES]
"""Strokes of a damper that always slides."""
SHORT = sine(0.01, 2.0, seconds=1.0)
