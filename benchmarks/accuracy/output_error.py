"""Output-error fit: errors of a hundred random dampers against the Cramér-Rao bound, and scipy as baseline.

The baseline is the straightforward solution: `scipy.optimize.least_squares` with finite differences, and the law
in Python under `solve_ivp`, method LSODA. It has the same start, search coordinates and data, and is timed until
it reaches the same final cost.

    python -m benchmarks.accuracy.output_error dampers [FIRST LAST FILE]
    python -m benchmarks.accuracy.output_error baseline
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import OptimizeResult, least_squares

from benchmarks.common import cache, measure_cpu_time, measure_reference_time, print_line
from benchmarks.speed import (
    RISING_LEVELS,
    SHUFFLED_LEVELS,
    TRAINING_STROKES,
    VALIDATION_STROKES,
    draw_damper,
    make_excitation,
    record_forces,
)
from identification.damper import Coordinates, find_parameter_set, law, to_coordinates
from identification.experiment_design import compute_coordinate_scales
from identification.fitting import (
    COORDINATE_COUNT,
    Piece,
    Problem,
    SearchSpace,
    compute_rmse,
    fit_output_error,
    make_starting_points,
    measure_scales,
    predict_piece,
)
from identification.uncertainty import compute_coordinate_covariance, estimate_covariance

DAMPERS = 100
EQUAL_COST = 1.001
"""Ratio of two costs up to which they count as equal [1]."""
START_SHARES = (0.3, 0.5, 0.7)
"""Starts of both: fractions [1] of the distance in search coordinates from the minimum to the start by regression.

From the start by regression itself, scipy does not converge within minutes.
"""
BASELINE_LEVELS = (0.0, 0.5, 0.2)
"""Drives of the recording of the baseline [V], two seconds each; it is short because the baseline is slow."""


def make_case_problem(
    c: Coordinates,
    seed: int,
    training: tuple[tuple[float, float], ...] = TRAINING_STROKES,
    levels: tuple[float, ...] = SHUFFLED_LEVELS,
) -> Problem:
    """Make a fit problem from strokes of a damper, with noise of 1 % of the force."""
    strokes = [make_excitation(a, f, levels) for a, f in training]
    forces, noise = record_forces(c, strokes, seed)
    pieces = tuple(
        Piece(str(i), s, f, np.ones(len(f))) for i, (s, f) in enumerate(zip(strokes, forces, strict=True))
    )
    return Problem(pieces, SearchSpace(0.0, 0.5, measure_scales(pieces)), noise, 20e-6)


def fit_seed(c: Coordinates, seed: int) -> dict[str, Any]:
    """Fit one damper; return time [s], validation error ratio, and errors in Cramér-Rao deviations."""
    problem = make_case_problem(c, seed)
    began = time.process_time()
    minimum = fit_output_error(problem)
    spent = time.process_time() - began
    found = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    deviation = np.sqrt(
        np.diag(compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum)))
    )
    strokes = [make_excitation(a, f, RISING_LEVELS) for a, f in VALIDATION_STROKES]
    forces, _ = record_forces(c, strokes, seed + 500)
    pieces = tuple(Piece("validation", s, f, np.ones(len(f))) for s, f in zip(strokes, forces, strict=True))
    errors = [np.concatenate([predict_piece(p, d).force - p.force for p in pieces]) for d in (found, c)]
    return {
        "seed": seed,
        "seconds": spent,
        "unseen": compute_rmse(errors[0]) / compute_rmse(errors[1]),
        "errors": list(
            (np.array(found) - np.array(c)) / np.maximum(deviation, 1e-12 * compute_coordinate_scales(c))
        ),
    }


def fit_dampers(first: int = 0, last: int = DAMPERS, results: Path | None = None) -> None:
    """Fit random dampers; a results file keeps one line for each, and the table shows all of them."""
    done = cache.read_rows(results)
    # The first call compiles and is not measured.
    fit_seed(to_coordinates(find_parameter_set("laboratory").parameters), 0)
    for seed in sorted(set(range(first, last)) - {row["seed"] for row in done}):
        done.append(fit_seed(draw_damper(seed), seed))
        cache.append_row(results, done[-1])
    _print_table(done)


def _print_table(done: list[dict[str, Any]]) -> None:
    validation, seconds = (np.array([row[key] for row in done]) for key in ("unseen", "seconds"))
    errors = np.array([row["errors"] for row in done])
    print(f"output-error fit: {len(done)} random dampers, 56 000 samples each, no initial guess;", end=" ")
    print(f"reference {measure_reference_time():.4f} s")
    print_line(
        "validation force error at most 1.01 of the true damper's", float((validation <= 1.01).sum()), "", "all"
    )
    print_line("largest validation force error over the true damper's", validation.max(), "x", "at most 1.01")
    print_line("median time", float(np.median(seconds)), "s", "at most 0.3 s")
    print_line("longest time", seconds.max(), "s", "")
    pooled = float(np.sqrt(np.mean(errors**2)))
    print_line("errors in Cramér-Rao deviations, root mean square", pooled, "", "0.9 to 1.1")
    for name, column in zip(Coordinates._fields, errors.T, strict=True):
        print_line(f"  {name}", float(np.sqrt(np.mean(column**2))), "", f"mean {column.mean():+.2f}")


def simulate_with_scipy(c: Coordinates, y0: float, piece: Piece, amplitude: float, frequency: float) -> np.ndarray:
    """Simulate the force [N], (N,), by solve_ivp (LSODA) with the law in Python; states y, zeta and the field."""
    w, levels, duration = 2 * np.pi * frequency, BASELINE_LEVELS, 2.0
    shape = (1 / c.D_y, c.rho / c.D_y, (1 - c.rho) / c.D_y, c.n)

    def inner(t: float, y: float, zeta: float, u: float) -> float:
        x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
        alpha, c0, c1 = c.F_a + c.F_b * u, c.c0_a + c.c0_b * u, c.c1_a + c.c1_b * u
        return float(law.compute_inner_velocity(x, v, y, zeta, alpha, c0, c1, c.k0))

    def rates(t: float, state: np.ndarray) -> tuple[float, float, float]:
        y, zeta, u = state
        y_rate = inner(t, y, zeta, u)
        slip = amplitude * w * np.cos(w * t) - y_rate
        drive = levels[min(int((t + 1e-9) / duration), len(levels) - 1)]
        return y_rate, law.compute_hysteresis_rate(slip, zeta, *shape), law.compute_field_rate(u, drive, c.eta)

    t = np.arange(len(piece.force)) / piece.excitation.rate
    v0 = amplitude * w
    start = [y0, v0 / (v0 + 1e-3), levels[0]]
    y, zeta, u = solve_ivp(rates, (0, t[-1]), start, "LSODA", t, rtol=1e-6, atol=1e-8, max_step=1e-2).y
    y_rate = np.array([inner(*values) for values in zip(t, y, zeta, u, strict=True)])
    x = amplitude * np.sin(w * t)
    return np.asarray((c.c1_a + c.c1_b * u) * y_rate + c.k1 * x - c.f0)


def compare_baseline() -> None:
    """Compare the time of scipy with that of this fit, to equal cost, on one stroke of 6 000 samples."""
    print(f"baseline: 6 000 samples, the same start; reference {measure_reference_time():.4f} s")
    for share in START_SHARES:
        _compare_with_scipy(share)


def _compare_with_scipy(share: float) -> None:
    """Run both from one start, at a fraction [1] of the distance to the start by regression."""
    amplitude, frequency = TRAINING_STROKES[1]
    default = to_coordinates(find_parameter_set("laboratory").parameters)
    problem = make_case_problem(default, 0, ((amplitude, frequency),), BASELINE_LEVELS)
    piece, minimum = problem.pieces[0], fit_output_error(problem)
    start = minimum.unknowns + share * (make_starting_points(problem)[0] - minimum.unknowns)
    # scipy does not estimate the delays, which makes its task easier.
    moving = np.flatnonzero(problem.free_mask & ~problem.delay_mask)
    low, high = (bound[moving] for bound in problem.get_bounds())
    start[moving] = np.clip(start[moving], low + 1e-6, high - 1e-6)
    goal = EQUAL_COST * minimum.evaluation.cost

    def residuals(values: np.ndarray) -> np.ndarray:
        unknowns = start.copy()
        unknowns[moving] = values
        setting = problem.make_model(unknowns, 0)
        force = simulate_with_scipy(setting.coordinates, setting.y0, piece, amplitude, frequency)
        # At an unstable point a large residual makes the optimiser step back instead of failing.
        return np.nan_to_num((force - piece.force) / problem.noise, nan=1e3)

    def stop_at_goal(intermediate_result: OptimizeResult) -> None:
        # The cost of least_squares is half the sum of squares.
        if 2.0 * intermediate_result.cost <= goal:
            raise StopIteration

    spent = measure_cpu_time(lambda: fit_output_error(problem, start=start), 5)
    reached = fit_output_error(problem, start=start).evaluation.cost
    began = time.process_time()
    baseline = least_squares(
        residuals,
        start[moving],
        bounds=(low, high),
        diff_step=np.full(len(moving), 1e-4),
        x_scale="jac",
        max_nfev=300,
        callback=stop_at_goal,
    )
    needed = time.process_time() - began
    print_line(
        f"cost of the start over the minimum, at {share} of the distance",
        problem.evaluate(start).cost / minimum.evaluation.cost,
        "x",
        "",
    )
    print_line(
        "this fit, least time of five", spent, "s", f"cost {reached / minimum.evaluation.cost:.6f} of the minimum"
    )
    print_line(
        "scipy: least_squares with solve_ivp LSODA", needed, "s", f"{baseline.nfev} steps, {baseline.message}"
    )
    print_line(
        "final cost of scipy over that of this fit",
        2.0 * baseline.cost / minimum.evaluation.cost,
        "x",
        f"equal up to {EQUAL_COST}",
    )
    print_line("time of scipy over that of this fit", needed / spent, "x", "at least 200")


if __name__ == "__main__":
    if sys.argv[1:2] == ["baseline"]:
        compare_baseline()
    elif len(sys.argv) > 4:
        fit_dampers(int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
    else:
        fit_dampers()
