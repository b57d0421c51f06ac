"""The paper's network in DeepXDE beside ours: time of a step of Adam, and what the same time brings.

    python -m benchmarks.pinn.deepxde                 the step, then what the time of `local` and of `paper` brings
    python -m benchmarks.pinn.deepxde step local      some of them

The same layers, samples, losses, start and rate of learning; every sample carries what the residuals ask for, so
that DeepXDE passes each of them through its network once. DeepXDE (its PyTorch backend) is no dependency of this
project: `pip install deepxde`, best into an environment of its own.
"""

import importlib
import os
import sys
import time
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from types import ModuleType
from typing import cast

import numpy as np
import torch
from torch import Tensor

from benchmarks.common import measure_reference_time, print_line, time_call
from benchmarks.pinn.cases import (
    LABORATORY,
    compute_pooled_error,
    compute_validation_ratio,
    make_case_problem,
    train_preset,
)
from identification.damper import Coordinates, Parameters, law, to_coordinates
from identification.pinn.common import PaperSettings, TrainingMonitor, make_validation_masks, read_settings
from identification.pinn.paper import PaperTraining, decode_parameters

STEPS, REPEATS = 100, 10
"""Steps in one timing, and timings; the least counts."""
SEED = 0
_REPORT_INTERVAL = 10**9
"""Steps between two of DeepXDE's own reports."""


def make_training() -> PaperTraining:
    """Ours, as it begins: its samples, scales and start are DeepXDE's too."""
    settings = read_settings("paper")
    assert isinstance(settings, PaperSettings)
    settings = settings.model_copy(
        update={"seed": SEED, "validation_share": 0.0, "adam_steps": STEPS, "lbfgs_steps": 0}
    )
    problem = make_case_problem(LABORATORY, SEED)
    held = make_validation_masks(problem.pieces, settings.validation_share, SEED)
    return PaperTraining(problem, held, settings, TrainingMonitor())


class DeepXdeTraining:
    """The same training, as a user of DeepXDE writes it."""

    def __init__(self, dde: ModuleType, ours: PaperTraining) -> None:
        self.dde, self.ours = dde, ours
        random = np.random.default_rng(SEED)
        at = random.choice(len(ours.data.x), ours.settings.samples, replace=False)
        d = ours.data
        points = d.inputs.T[at].numpy()
        told = torch.column_stack([d.rates.T, d.x, d.v, d.drive, d.force, d.fitted])[at].numpy()
        self.raw = dde.Variable([0.0] * len(Parameters._fields))
        data = dde.data.PDE(
            dde.geometry.PointCloud(points), self._compute_residuals, [], num_domain=0, anchors=points,
            auxiliary_var_function=lambda _: told,
        )  # fmt: skip
        width, layers = ours.settings.width, ours.settings.layers
        network = dde.nn.FNN([4, *[width] * layers, 3], "tanh", "Glorot normal")
        self.model = dde.Model(data, network)
        self.model.compile(
            "adam", lr=ours.settings.learning_rate, external_trainable_variables=self.raw, verbose=0
        )

    def run(self, steps: int) -> None:
        """So many steps of Adam."""
        self.model.train(iterations=steps, display_every=_REPORT_INTERVAL, verbose=0)

    def read_coordinates(self) -> Coordinates:
        """What it has found."""
        return to_coordinates(Parameters(*decode_parameters(self.ours.start_parameters, self.raw).tolist()))

    def _compute_residuals(self, inputs: Tensor, outputs: Tensor, told: Tensor) -> list[Tensor]:
        """Two misfits of the force and three of the law; the derivative is that along the trajectory."""
        s, p = (
            self.ours.scales,
            Parameters(*cast(list[float], decode_parameters(self.ours.start_parameters, self.raw).unbind())),
        )
        x, v, drive, force, fitted = told[:, 4:].T
        u, y, z = outputs.T * torch.tensor([[s.u], [s.y], [s.z]])
        rates = [
            sum(self.dde.grad.jacobian(outputs, inputs, i, j)[:, 0] * told[:, j] for j in range(4))
            for i in range(3)
        ]
        u_rate, y_rate, z_rate = rates[0] * s.u, rates[1] * s.y, rates[2] * s.z
        pairs = ((p.alpha_a, p.alpha_b), (p.c0_a, p.c0_b), (p.c1_a, p.c1_b))
        alpha, c0, c1 = (law.evaluate_coefficient(a, b, u) for a, b in pairs)
        inner = law.compute_inner_velocity(x, v, y, z, alpha, c0, c1, p.k0)
        hysteresis = law.compute_hysteresis_rate(v - y_rate, z, p.A, p.beta, p.gamma, p.n)
        first = alpha * z + c0 * (v - y_rate) + p.k0 * (x - y) + p.k1 * (x - p.x0)
        second = law.compute_force(y_rate, x, c1, p.k1, p.x0)
        return [
            (force - first) / s.force * fitted,
            (force - second) / s.force * fitted,
            (u_rate - law.compute_field_rate(u, drive, p.eta)) / (s.rate * s.u),
            (y_rate - inner) / s.velocity,
            (z_rate - hysteresis) / (self.ours.start_parameters.A * s.velocity),
        ]


def measure_steps(hundreds: Sequence[Callable[[], None]]) -> list[float]:
    """[s] of processor time of one step of each: the least of some repeats of ``STEPS`` steps, by turns, warm."""
    for hundred in hundreds:
        hundred()
    spent = [[time_call(hundred)[1] for hundred in hundreds] for _ in range(REPEATS)]
    return [min(times) / STEPS for times in zip(*spent, strict=True)]


def train_for(theirs: DeepXdeTraining, seconds: float) -> tuple[float, float, int]:
    """Unseen error over the true damper's, pooled error and steps after some processor time [s] from the start."""
    steps, began = 0, time.process_time()
    while time.process_time() - began < seconds:
        theirs.run(STEPS)
        steps += STEPS
    found = theirs.read_coordinates()
    problem = make_case_problem(LABORATORY, SEED)
    return (
        compute_validation_ratio(found, LABORATORY, SEED),
        compute_pooled_error(problem, found, LABORATORY),
        steps,
    )


def compare_step(dde: ModuleType) -> None:
    """Time of a step of Adam."""
    ours, theirs = make_training(), DeepXdeTraining(dde, make_training())
    steps = measure_steps((ours.run, lambda: theirs.run(STEPS)))
    print_line("a step of Adam, 2048 samples: ours", 1e3 * steps[0], "ms", "")
    print_line("the same in DeepXDE", 1e3 * steps[1], "ms", "")
    print_line("ours over DeepXDE's", steps[0] / steps[1], "x", "at most 1/3")


def compare_preset(dde: ModuleType, preset: str) -> None:
    """What DeepXDE finds in the time that a preset takes."""
    score = train_preset(preset, LABORATORY, SEED)
    print(f"in the {score.seconds:.1f} s of preset {preset}, unseen error over the true damper's, and pooled:")
    print_line(f"  {preset}", score.ratio, "x", f"{score.pooled_error:.3g}")
    unseen, pooled, count = train_for(DeepXdeTraining(dde, make_training()), score.seconds)
    print_line(f"  DeepXDE, {count} steps", unseen, "x", f"{pooled:.3g}")


def run(parts: Sequence[str] = ("step", "local", "paper")) -> None:
    """Print the parts asked for: the step, and presets beside DeepXDE."""
    if find_spec("deepxde") is None:
        print("deepxde: left out; it is no dependency of this project, `pip install deepxde` brings it")
        return
    os.environ["DDE_BACKEND"] = "pytorch"
    torch.set_num_threads(1)
    dde = importlib.import_module("deepxde")
    dde.config.set_default_float("float64")
    dde.config.set_random_seed(SEED)
    print(f"deepxde {dde.__version__}, torch {torch.__version__}; reference {measure_reference_time():.4f} s")
    for part in parts:
        if part == "step":
            compare_step(dde)
        else:
            compare_preset(dde, part)


if __name__ == "__main__":
    run(sys.argv[1:] or ("step", "local", "paper"))
