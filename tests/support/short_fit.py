"""Six-second recording of the laboratory damper, and its fit."""

from pathlib import Path

import numpy as np

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.documents.fit import Fit
from identification.fitting.budget import Budget
from identification.fitting.output_error import OptimiserSettings
from identification.logs.recording import Recording, Segment
from identification.pipeline import FitRequest, identify
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.strokes import stretch

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
RATE, NOISE, LEVELS, SECONDS = 1000.0, 2.5, (0.0, 0.3, 0.5), 2.0


def recording() -> Recording:
    """Return one sine of the laboratory damper at three voltages."""
    count = round(RATE * SECONDS * len(LEVELS))
    t, w = np.arange(count) / RATE, 2 * np.pi * 1.5
    x = 0.010 * np.sin(w * t)
    drive = np.array(LEVELS)[np.minimum((t / SECONDS).astype(int), len(LEVELS) - 1)]
    stroke = Excitation(RATE, x, 0.010 * w * np.cos(w * t), -w * w * x, drive)
    random = np.random.default_rng(3)
    force = simulate(SimulationModel(LABORATORY), stroke, max_travel=0.005).force + NOISE * random.standard_normal(
        count
    )
    edges = np.linspace(0, count, len(LEVELS) + 1).astype(int)
    segments = tuple(
        Segment(i, f"{level}V", int(edges[i]), int(edges[i + 1]), "sine", 0.010, 1.5, level)
        for i, level in enumerate(LEVELS)
    )
    made = stretch(x, force, drive, segments, rate=RATE)
    metadata = {"run": {"specimen": "made up", "source": "run"}}
    return Recording(Path("made-up.mcap"), "0" * 64, "coil_v", "V", (made,), metadata)


def fitted(*stages: str, budget: str = "", preset: str = "elements") -> Fit:
    settings = OptimiserSettings(budget=Budget.from_text(budget))
    return identify([recording()], FitRequest(settings=settings, stages=stages, preset=preset))
