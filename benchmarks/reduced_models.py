"""Models with less in them than the damper: how well their curve fits, and what their numbers are worth.

    python -m benchmarks.reduced_models

The laboratory damper on one stroke (10 mm at 1 Hz, six voltages), 2.5 N of noise; each model is fitted to it and
then simulated on other strokes. Deviations are the model's own claims.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.fitting import RISING, stroke
from identification.arrays import Array, BoolArray
from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.parameter_sets import parameter_set
from identification.piece import Piece
from identification.prediction import predict_piece, rmse
from identification.problem import COORDINATE_COUNT, Problem
from identification.refine import Settings, refine
from identification.search_space import SearchSpace
from identification.simulate import Setting, simulate
from identification.start import starting_points
from identification.uncertainty import coordinate_covariance, covariance

TRUE = to_coordinates(parameter_set("laboratory").parameters)
NOISE = 2.5
UNSEEN = {"15 mm, 2 Hz": (0.015, 2.0), "5 mm, 2.5 Hz": (0.005, 2.5), "12 mm, 0.4 Hz": (0.012, 0.4)}
MODELS: dict[str, dict[str, float]] = {
    "the whole law": {},
    "without k0": {"k0": 0.0},
    "n = 1 and rho = 1/2 (the textbook loop)": {"n": 1.0, "rho": 0.5},
}
SHOWN = ("F_a", "D_y", "n", "c0_a", "c1_a", "k1")


@dataclass(frozen=True)
class Reduced(Problem):
    """A problem in which some coordinates keep the value of the start."""

    held: tuple[str, ...] = ()

    @property
    def free(self) -> BoolArray:
        """(U,) True where an unknown is free."""
        free = super().free.copy()
        free[[Coordinates._fields.index(name) for name in self.held]] = False
        return free


def recorded(amplitude: float, frequency: float, seed: int) -> Piece:
    """A stroke of the damper with white noise."""
    moved = stroke(amplitude, frequency, RISING)
    # Finer steps than the fit takes, so that it does not meet its own.
    force = simulate(Setting(TRUE), moved, fineness=0.005).force
    force = force + NOISE * np.random.default_rng(seed).standard_normal(len(force))
    return Piece("stroke", moved, force, np.ones(len(force)))


def fitted(piece: Piece, fixed: dict[str, float]) -> tuple[Coordinates, Array]:
    """The model's damper, and the deviations (13,) that it claims."""
    problem = Reduced((piece,), SearchSpace(0.0, 0.5), NOISE, 20e-6, held=tuple(fixed))
    first = problem.space.to_coordinates(starting_points(problem)[0][:COORDINATE_COUNT])
    minimum = refine(problem, Settings(restarts=0, iterations=100), start=problem.start(first._replace(**fixed)))
    found = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    spread = coordinate_covariance(problem, minimum, covariance(problem, minimum))
    return found, np.sqrt(np.maximum(np.diag(spread), 0.0))


def run() -> None:
    """Print the table of the page."""
    train = recorded(0.010, 1.0, 1)
    unseen = {name: recorded(*how, 2 + k) for k, (name, how) in enumerate(UNSEEN.items())}
    spread = float(train.force.std())
    print(
        f"| model | R² | error over noise, fitted | {' | '.join(unseen)} |\n| --- | ---: | ---: |{' ---: |' * 3}"
    )
    rows = {name: fitted(train, fixed) for name, fixed in MODELS.items()}
    for name, (found, _) in rows.items():
        own = rmse(predict_piece(train, found).force - train.force)
        ratios = [f"{rmse(predict_piece(p, found).force - p.force) / NOISE:.2f}" for p in unseen.values()]
        print(f"| {name} | {1 - (own / spread) ** 2:.5f} | {own / NOISE:.3f} | {' | '.join(ratios)} |")
    print(f"\n| model | {' | '.join(f'`{c}`' for c in SHOWN)} |\n| --- |{' ---: |' * len(SHOWN)}")
    for name, (found, deviation) in rows.items():
        print(f"| {name} | {' | '.join(_off(c, found, deviation) for c in SHOWN)} |")


def _off(name: str, found: Coordinates, deviation: Array) -> str:
    """How far a coordinate is off, and how many of its claimed deviations that is."""
    i = Coordinates._fields.index(name)
    off = found[i] - TRUE[i]
    own = f" ({abs(off) / deviation[i]:.0f} dev.)" if deviation[i] > 0 else " (held)"
    return f"{100 * off / TRUE[i]:+.1f} %{own}"


if __name__ == "__main__":
    run()
