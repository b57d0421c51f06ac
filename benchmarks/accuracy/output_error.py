"""Output-error refinement: a hundred random dampers, errors against the Cramér-Rao bound, and scipy as baseline.

The baseline is what a careful person would write first: `scipy.optimize.least_squares` with differences for
slopes, the law in Python under `solve_ivp`, method LSODA. It gets the same start, the same search numbers and the
same data, and is timed to the same final cost.

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
    predict_piece,
)
from identification.uncertainty import compute_coordinate_covariance, estimate_covariance

DAMPERS = 100
EQUAL_COST = 1.001
"""[1] ratio of two costs that count as equal."""
START_SHARES = (0.3, 0.5, 0.7)
"""[1] of the way from the minimum to the regression's start, in search numbers, where both begin: from that start
scipy's own way does not arrive within minutes."""
BASELINE_LEVELS = (0.0, 0.5, 0.2)
"""[V] drives of the baseline's recording, two seconds each: its slowness asks for a short one."""


def make_case_problem(
    c: Coordinates,
    seed: int,
    training: tuple[tuple[float, float], ...] = TRAINING_STROKES,
    levels: tuple[float, ...] = SHUFFLED_LEVELS,
) -> Problem:
    """Strokes of a damper with noise of one per cent of the force."""
    strokes = [make_excitation(a, f, levels) for a, f in training]
    forces, noise = record_forces(c, strokes, seed)
    pieces = tuple(
        Piece(str(i), s, f, np.ones(len(f))) for i, (s, f) in enumerate(zip(strokes, forces, strict=True))
    )
    return Problem(pieces, SearchSpace(0.0, 0.5), noise, 20e-6)


def fit_seed(c: Coordinates, seed: int) -> dict[str, Any]:
    """Time [s], unseen error over the true damper's, and errors in Cramér-Rao deviations of one fit."""
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
    pieces = tuple(Piece("unseen", s, f, np.ones(len(f))) for s, f in zip(strokes, forces, strict=True))
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
    """Fit random dampers; with a file, results are kept a line each and the table is of all in it."""
    done = cache.read_rows(results)
    # Once unmeasured: the first call compiles.
    fit_seed(to_coordinates(find_parameter_set("laboratory").parameters), 0)
    for seed in sorted(set(range(first, last)) - {row["seed"] for row in done}):
        done.append(fit_seed(draw_damper(seed), seed))
        cache.append_row(results, done[-1])
    _print_table(done)


def _print_table(done: list[dict[str, Any]]) -> None:
    unseen, seconds = (np.array([row[key] for row in done]) for key in ("unseen", "seconds"))
    errors = np.array([row["errors"] for row in done])
    print(
        f"refine: {len(done)} random dampers, 56 000 samples each, no guess; reference {measure_reference_time():.4f} s"
    )
    print_line("unseen force error at most 1.01 of the true damper's", float((unseen <= 1.01).sum()), "", "all")
    print_line("the worst of them", unseen.max(), "x", "at most 1.01")
    print_line("median time", float(np.median(seconds)), "s", "at most 0.3 s")
    print_line("longest time", seconds.max(), "s", "")
    pooled = float(np.sqrt(np.mean(errors**2)))
    print_line("errors in Cramér-Rao deviations, root mean square", pooled, "", "0.9 to 1.1")
    for name, column in zip(Coordinates._fields, errors.T, strict=True):
        print_line(f"  {name}", float(np.sqrt(np.mean(column**2))), "", f"mean {column.mean():+.2f}")


def simulate_with_scipy(c: Coordinates, y0: float, piece: Piece, amplitude: float, frequency: float) -> np.ndarray:
    """Force [N] (N,) by solve_ivp, LSODA, the law in Python; states y, zeta and the field."""
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
    """Time scipy's own way to the cost that ours ends at, on one stroke of 6 000 samples, from the same starts."""
    print(f"baseline: 6 000 samples, the same start; reference {measure_reference_time():.4f} s")
    for share in START_SHARES:
        _compare_with_scipy(share)


def _compare_with_scipy(share: float) -> None:
    """Both from one start, a share [1] of the way off."""
    amplitude, frequency = TRAINING_STROKES[1]
    default = to_coordinates(find_parameter_set("laboratory").parameters)
    problem = make_case_problem(default, 0, ((amplitude, frequency),), BASELINE_LEVELS)
    piece, ours = problem.pieces[0], fit_output_error(problem)
    start = ours.unknowns + share * (make_starting_points(problem)[0] - ours.unknowns)
    # scipy's way has no delays to find: the easier search.
    moving = np.flatnonzero(problem.free_mask & ~problem.delay_mask)
    low, high = (bound[moving] for bound in problem.get_bounds())
    start[moving] = np.clip(start[moving], low + 1e-6, high - 1e-6)
    goal = EQUAL_COST * ours.evaluation.cost

    def residuals(values: np.ndarray) -> np.ndarray:
        unknowns = start.copy()
        unknowns[moving] = values
        setting = problem.make_model(unknowns, 0)
        force = simulate_with_scipy(setting.coordinates, setting.y0, piece, amplitude, frequency)
        # At an unstable point a large misfit turns the search round instead of ending it.
        return np.nan_to_num((force - piece.force) / problem.noise, nan=1e3)

    def arrived(intermediate_result: OptimizeResult) -> None:
        # least_squares counts half the squares.
        if 2.0 * intermediate_result.cost <= goal:
            raise StopIteration

    spent = measure_cpu_time(lambda: fit_output_error(problem, start=start), 5)
    reached = fit_output_error(problem, start=start).evaluation.cost
    began = time.process_time()
    theirs = least_squares(
        residuals, start[moving], bounds=(low, high), diff_step=1e-4, x_scale="jac", max_nfev=300, callback=arrived
    )
    needed = time.process_time() - began
    print_line(
        f"cost of the start over the least, {share} of the way off",
        problem.evaluate(start).cost / ours.evaluation.cost,
        "x",
        "",
    )
    print_line("ours, least of five", spent, "s", f"cost {reached / ours.evaluation.cost:.6f} of the least")
    print_line("scipy: least_squares with solve_ivp LSODA", needed, "s", f"{theirs.nfev} steps, {theirs.message}")
    print_line(
        "its final cost over ours", 2.0 * theirs.cost / ours.evaluation.cost, "x", f"equal up to {EQUAL_COST}"
    )
    print_line("time over ours", needed / spent, "x", "at least 200")


if __name__ == "__main__":
    if sys.argv[1:2] == ["baseline"]:
        compare_baseline()
    elif len(sys.argv) > 4:
        fit_dampers(int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
    else:
        fit_dampers()
