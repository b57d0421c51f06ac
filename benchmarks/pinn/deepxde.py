"""Network of the paper compared with DeepXDE: time of an Adam step, and error after equal time.

    python -m benchmarks.pinn.deepxde                 step time, and errors after the time of each preset
    python -m benchmarks.pinn.deepxde step elements   some of them

Layers, samples, losses, start and learning rate are the same. All data of the residuals are passed with each
sample, so that DeepXDE evaluates its network once for each sample. DeepXDE, with its PyTorch backend, is not a
dependency of this project: run `pip install deepxde`, preferably in a separate environment.
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
"""Number of steps in one timing, and number of timings, of which the least is used."""
SEED = 0
_REPORT_INTERVAL = 10**9
"""Number of steps between two reports of DeepXDE; so large that there are none."""
PARTS = ("step", "elements", "paper")


def make_training() -> PaperTraining:
    """Prepare the training of this project; DeepXDE uses its samples, scales and start."""
    settings = read_settings("paper")
    assert isinstance(settings, PaperSettings)
    settings = settings.model_copy(
        update={"seed": SEED, "validation_share": 0.0, "adam_steps": STEPS, "lbfgs_steps": 0}
    )
    problem = make_case_problem(LABORATORY, SEED)
    held = make_validation_masks(problem.pieces, settings.validation_share, SEED)
    return PaperTraining(problem, held, settings, TrainingMonitor())


class DeepXdeTraining:
    """Same training as a DeepXDE model."""

    def __init__(self, dde: ModuleType, reference: PaperTraining) -> None:
        self.dde, self.reference = dde, reference
        random = np.random.default_rng(SEED)
        rows = random.choice(len(reference.data.x), reference.settings.samples, replace=False)
        d = reference.data
        points = d.inputs.T[rows].numpy()
        known = torch.column_stack([d.rates.T, d.x, d.v, d.drive, d.force, d.fitted])[rows].numpy()
        self.raw = dde.Variable([0.0] * len(Parameters._fields))
        data = dde.data.PDE(
            dde.geometry.PointCloud(points), self._compute_residuals, [], num_domain=0, anchors=points,
            auxiliary_var_function=lambda _: known,
        )  # fmt: skip
        width, layers = reference.settings.width, reference.settings.layers
        network = dde.nn.FNN([4, *[width] * layers, 3], "tanh", "Glorot normal")
        self.model = dde.Model(data, network)
        self.model.compile(
            "adam", lr=reference.settings.learning_rate, external_trainable_variables=self.raw, verbose=0
        )

    def run(self, steps: int) -> None:
        """Run a number of Adam steps."""
        self.model.train(iterations=steps, display_every=_REPORT_INTERVAL, verbose=0)

    def read_coordinates(self) -> Coordinates:
        """Return the coordinates that the training has reached."""
        return to_coordinates(Parameters(*decode_parameters(self.reference.start_parameters, self.raw).tolist()))

    def _compute_residuals(self, inputs: Tensor, outputs: Tensor, known: Tensor) -> list[Tensor]:
        """Compute two residuals of the force and three of the law, with derivatives along the trajectory."""
        s, p = (
            self.reference.scales,
            Parameters(*cast(list[float], decode_parameters(self.reference.start_parameters, self.raw).unbind())),
        )
        x, v, drive, force, fitted = known[:, 4:].T
        u, y, z = outputs.T * torch.tensor([[s.u], [s.y], [s.z]])
        rates = [
            sum(self.dde.grad.jacobian(outputs, inputs, i, j)[:, 0] * known[:, j] for j in range(4))
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
            (z_rate - hysteresis) / (self.reference.start_parameters.A * s.velocity),
        ]


def measure_steps(trainings: Sequence[Callable[[], None]]) -> list[float]:
    """Measure the processor time [s] of one step of each training.

    The trainings alternate, each with ``STEPS`` steps in a repeat; the least time of the repeats is returned.
    """
    for run_steps in trainings:
        run_steps()
    spent = [[time_call(run_steps)[1] for run_steps in trainings] for _ in range(REPEATS)]
    return [min(times) / STEPS for times in zip(*spent, strict=True)]


def train_for(training: DeepXdeTraining, seconds: float) -> tuple[float, float, int]:
    """Train for a processor time [s]; return validation error over the true damper's, pooled error and steps."""
    steps, began = 0, time.process_time()
    while time.process_time() - began < seconds:
        training.run(STEPS)
        steps += STEPS
    found = training.read_coordinates()
    problem = make_case_problem(LABORATORY, SEED)
    return (
        compute_validation_ratio(found, LABORATORY, SEED),
        compute_pooled_error(problem, found, LABORATORY),
        steps,
    )


def compare_step(dde: ModuleType) -> None:
    """Print the time of an Adam step of both."""
    reference, training = make_training(), DeepXdeTraining(dde, make_training())
    steps = measure_steps((reference.run, lambda: training.run(STEPS)))
    print_line("Adam step, 2048 samples: this project", 1e3 * steps[0], "ms", "")
    print_line("Adam step, 2048 samples: DeepXDE", 1e3 * steps[1], "ms", "")
    print_line("this project over DeepXDE", steps[0] / steps[1], "x", "at most 1/3")


def compare_preset(dde: ModuleType, preset: str) -> None:
    """Print the errors of DeepXDE after the time that a preset takes."""
    score = train_preset(preset, LABORATORY, SEED)
    print(f"after {score.seconds:.1f} s (preset {preset}): validation error over the true damper's, pooled error")
    print_line(f"  {preset}", score.ratio, "x", f"{score.pooled_error:.3g}")
    ratio, pooled, count = train_for(DeepXdeTraining(dde, make_training()), score.seconds)
    print_line(f"  DeepXDE, {count} steps", ratio, "x", f"{pooled:.3g}")


def run(parts: Sequence[str] = PARTS) -> None:
    """Print the requested parts: ``step``, and presets compared with DeepXDE."""
    if find_spec("deepxde") is None:
        print("deepxde: skipped, the package is not installed; run `pip install deepxde`")
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
    run(sys.argv[1:] or PARTS)
