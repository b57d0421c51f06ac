"""Accuracy of reduced models: fit of their force, and errors of their parameters.

    python -m benchmarks.accuracy.reduced_models

The recording is one stroke of the laboratory damper (10 mm at 1 Hz, six voltages) with 2.5 N of noise. Each model
is fitted to it and then simulated on other strokes. Deviations are those that the model itself estimates.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.speed import RISING_LEVELS, make_excitation
from identification.arrays import Array, BoolArray
from identification.damper import Coordinates, find_parameter_set, to_coordinates
from identification.fitting import (
    COORDINATE_COUNT,
    OptimiserSettings,
    Piece,
    Problem,
    SearchSpace,
    compute_rmse,
    fit_output_error,
    make_starting_points,
    measure_scales,
    predict_piece,
)
from identification.simulate import SimulationModel, simulate
from identification.uncertainty import compute_coordinate_covariance, estimate_covariance

TRUE = to_coordinates(find_parameter_set("laboratory").parameters)
NOISE = 2.5
VALIDATION_STROKES = {"15 mm, 2 Hz": (0.015, 2.0), "5 mm, 2.5 Hz": (0.005, 2.5), "12 mm, 0.4 Hz": (0.012, 0.4)}
MODELS: dict[str, dict[str, float]] = {
    "full law": {},
    "without k0": {"k0": 0.0},
    "n = 1 and rho = 1/2 (the textbook loop)": {"n": 1.0, "rho": 0.5},
}
TABLE_COORDINATES = ("F_a", "D_y", "n", "c0_a", "c1_a", "k1")


@dataclass(frozen=True)
class ReducedProblem(Problem):
    """Fit problem in which some coordinates keep their value at the start."""

    fixed: tuple[str, ...] = ()

    @property
    def free_mask(self) -> BoolArray:
        """Mask of the free unknowns, (U,)."""
        free = super().free_mask.copy()
        free[[Coordinates._fields.index(name) for name in self.fixed]] = False
        return free


def record_stroke(amplitude: float, frequency: float, seed: int) -> Piece:
    """Simulate a stroke of the damper with white noise."""
    moved = make_excitation(amplitude, frequency, RISING_LEVELS)
    # The steps are finer than those of the fit, so that the fit does not meet its own integration error.
    force = simulate(SimulationModel(TRUE), moved, max_travel=0.005).force
    force = force + NOISE * np.random.default_rng(seed).standard_normal(len(force))
    return Piece("stroke", moved, force, np.ones(len(force)))


def fit_model(piece: Piece, fixed: dict[str, float]) -> tuple[Coordinates, Array]:
    """Fit a model; return its coordinates and the deviations (13,) that it estimates."""
    problem = ReducedProblem(
        (piece,), SearchSpace(0.0, 0.5, measure_scales([piece])), NOISE, 20e-6, fixed=tuple(fixed)
    )
    first = problem.space.to_coordinates(make_starting_points(problem)[0][:COORDINATE_COUNT])
    minimum = fit_output_error(
        problem, OptimiserSettings(restarts=0, iterations=100), start=problem.make_start(first._replace(**fixed))
    )
    found = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    spread = compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum))
    return found, np.sqrt(np.maximum(np.diag(spread), 0.0))


def run() -> None:
    """Print the tables of errors by model."""
    train = record_stroke(0.010, 1.0, 1)
    validation = {name: record_stroke(*how, 2 + k) for k, (name, how) in enumerate(VALIDATION_STROKES.items())}
    spread = float(train.force.std())
    print(f"| model | R² | fitted error over noise | {' | '.join(validation)} |")
    print(f"| --- | ---: | ---: |{' ---: |' * len(validation)}")
    rows = {name: fit_model(train, fixed) for name, fixed in MODELS.items()}
    for name, (found, _) in rows.items():
        own = compute_rmse(predict_piece(train, found).force - train.force)
        ratios = [
            f"{compute_rmse(predict_piece(p, found).force - p.force) / NOISE:.2f}" for p in validation.values()
        ]
        print(f"| {name} | {1 - (own / spread) ** 2:.5f} | {own / NOISE:.3f} | {' | '.join(ratios)} |")
    heads = " | ".join(f"`{c}`" for c in TABLE_COORDINATES)
    print(f"\n| model | {heads} |\n| --- |{' ---: |' * len(TABLE_COORDINATES)}")
    for name, (found, deviation) in rows.items():
        print(f"| {name} | {' | '.join(_describe_error(c, found, deviation) for c in TABLE_COORDINATES)} |")


def _describe_error(name: str, found: Coordinates, deviation: Array) -> str:
    """Return the relative error of a coordinate, and the error in estimated deviations, as text."""
    i = Coordinates._fields.index(name)
    error = found[i] - TRUE[i]
    own = f" ({abs(error) / deviation[i]:.0f} dev.)" if deviation[i] > 0 else " (fixed)"
    return f"{100 * error / TRUE[i]:+.1f} %{own}"


if __name__ == "__main__":
    run()
