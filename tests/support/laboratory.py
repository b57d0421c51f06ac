"""Recordings of the laboratory damper, simulated with known noise."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.logs.recording import Recording, Segment, Stretch
from identification.simulate import Excitation, SimulationModel, simulate

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
RATE, NOISE, MOTION_NOISE = 1000.0, 2.5, 2e-6
LEVELS = (0.0, 0.3, 0.1, 0.5)


def stretch(name, amplitude, frequency, seed, seconds=8.0, levels=LEVELS, **changes) -> Stretch:
    """Return one sine stroke of the laboratory damper as a bench would record it, two seconds at each level."""
    t = np.arange(round(seconds * RATE)) / RATE
    w = 2 * np.pi * frequency
    x = amplitude * np.sin(w * t)
    drive = np.array(levels)[np.minimum((t * len(levels) / seconds).astype(int), len(levels) - 1)]
    stroke = Excitation(RATE, x, amplitude * w * np.cos(w * t), -w * w * x, drive)
    force = simulate(SimulationModel(LABORATORY), stroke, max_travel=0.005).force
    random = np.random.default_rng(seed)
    edges = np.linspace(0, len(t), len(levels) + 1).astype(int)
    segments = [
        Segment(i, f"{name}_{level}V", start, stop, "sine", amplitude, frequency, level)
        for i, (level, start, stop) in enumerate(zip(levels, edges[:-1], edges[1:], strict=True))
    ]
    made = Stretch(
        name=name, time=t, rate=RATE, displacement=x + MOTION_NOISE * random.standard_normal(len(t)),
        force=force + NOISE * random.standard_normal(len(t)), drive=drive, velocity=None, segments=tuple(segments),
        force_filter=None, displacement_filter=None, force_delay=0.0, displacement_delay=0.0, drive_delay=0.0,
        measured=np.ones(len(t), bool),
    )  # fmt: skip
    return replace(made, **changes)


def recording(*stretches, drive_kind="coil_v", source="run", sha256="0" * 64) -> Recording:
    metadata = {"run": {"specimen": "made up", "source": source}}
    return Recording(Path("made-up.mcap"), sha256, drive_kind, "V", tuple(stretches), metadata)


SLOW, FAST = stretch("slow", 0.010, 1.0, 1), stretch("fast", 0.005, 2.5, 2)
