"""Convergence of the fit for dampers of any size, against the damper's own error on unseen strokes.

    python -m benchmarks.accuracy.scale_free_fit [--dampers 100] [--seed 1] [--out PAGE.md]

Force, stroke, velocity, sampling rate and drive range are drawn over several decades. Each recording has four
sines at seven drives and 1 % noise; two further sines are unseen. A fit has converged if its error on them is at
most 1.01 times that of the true damper.
"""

import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.common.drawn_noise import RELATIVE_NOISE, make_stretch
from benchmarks.common.drawn_table import list_seeds, make_parser, print_table
from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import (
    Minimum,
    OptimiserSettings,
    Problem,
    assemble,
    compute_rmse,
    fit_output_error,
    predict_piece,
)
from identification.logs import Recording, Segment
from identification.pipeline import make_problem
from identification.simulate import Excitation, SimulationModel, simulate

DRIVE_RANGES = ((0.0, 1.0), (0.0, 2.25), (0.0, 10.0), (0.2, 2.0), (0.004, 0.020))
"""Lowest and highest drive [V or A]."""
STROKES = ((0.5, 0.35), (1.0, 0.6), (0.7, 1.0), (0.3, 0.9))
"""Amplitude over the largest and peak velocity over the largest, of the fitted sines."""
UNSEEN_STROKES = ((0.85, 0.8), (0.4, 0.5))
"""The same of the unseen sines."""
DRIVE_LEVELS, CYCLES_PER_LEVEL = 7, 2
SAMPLES_PER_CYCLE = (40.0, 400.0)
"""Fewest and most samples in a cycle of the fastest sine."""
MAX_TRAVEL = 0.005
"""Change of the hysteretic variable in a step of the recorded damper [1]: a twentieth of that of the fit."""
CONVERGED = 1.01
"""Error on unseen strokes over that of the true damper up to which a fit has converged [1]."""
COLUMNS = ("damper", "converged", "worst", "steps, median / 95 %", "seconds, median / 95 %")
CLASSES = ((10.0, 300.0), (300.0, 1e4), (1e4, 4e5))
"""Ranges of the largest force [N], one row each."""


class Case(NamedTuple):
    """Drawn damper with the conditions of its recording."""

    damper: Coordinates
    force: float
    """Largest force [N]."""
    amplitude: float
    """Largest amplitude [m]."""
    velocity: float
    """Largest velocity [m/s]."""
    rate: float
    """Sampling rate [Hz]."""
    drives: tuple[float, float]
    """Lowest and highest drive [V or A]."""


class Result(NamedTuple):
    """Fit of one damper."""

    force: float
    """Largest force [N]."""
    ratio: float
    """Error on unseen strokes over that of the true damper [1]."""
    steps: int
    """Steps of all minimisations."""
    seconds: float
    """Processor time of the fit [s]."""


def draw_case(random: np.random.Generator) -> Case:
    """Draw a damper of any size and the conditions of its recording."""

    def draw(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    force, drives = draw(10.0, 4e5), DRIVE_RANGES[random.integers(len(DRIVE_RANGES))]
    while True:
        amplitude, velocity = draw(1e-3, 0.5), draw(0.03, 1.0)
        fastest = max(v * velocity / (a * amplitude) for a, v in (*STROKES, *UNSEEN_STROKES)) / (2.0 * np.pi)
        slowest_rate, fastest_rate = (max(100.0, count * fastest) for count in SAMPLES_PER_CYCLE)
        if slowest_rate < 5000.0 and fastest_rate > 100.0:
            break
    rate, time_rate = draw(slowest_rate, min(5000.0, fastest_rate)), velocity / amplitude
    highest = random.uniform(0.35, 0.95) * force
    viscous, stiffness = (force - highest) / velocity, force / amplitude
    roll_off, lowest = viscous * draw(3.0, 40.0), highest / draw(1.3, 20.0)
    least, least_roll_off = viscous * random.uniform(0.3, 1.5), roll_off * random.uniform(0.3, 1.5)
    F, c0, c1 = (
        fit_line(drives, pair) for pair in ((lowest, highest), (least, viscous), (least_roll_off, roll_off))
    )
    damper = Coordinates(
        F_a=F[0], F_b=F[1], D_y=amplitude * draw(1e-3, 0.08), rho=random.uniform(0.15, 0.9), n=draw(1.1, 3.0),
        eta=draw(4.0 * time_rate, max(0.3 * rate, 4.1 * time_rate)),
        c0_a=c0[0], c0_b=c0[1], c1_a=c1[0], c1_b=c1[1], k0=stiffness * random.uniform(0.0, 0.3),
        k1=stiffness * random.uniform(0.0, 0.2), f0=force * random.uniform(-0.5, 0.5),
    )  # fmt: skip
    return Case(damper, force, amplitude, velocity, rate, drives)


def fit_line(drives: tuple[float, float], values: tuple[float, float]) -> tuple[float, float]:
    """Return value at zero drive and slope of a line through two points."""
    slope = (values[1] - values[0]) / (drives[1] - drives[0])
    return values[0] - slope * drives[0], slope


def try_damper(seed: int) -> Result:
    """Fit one drawn damper."""
    random = np.random.default_rng([seed, 2026])
    case = draw_case(random)
    levels = random.permutation(np.linspace(*case.drives, DRIVE_LEVELS))
    strokes = [make_stroke(case, *stroke, levels) for stroke in STROKES]
    forces = [simulate(SimulationModel(case.damper), s, max_travel=MAX_TRAVEL).force for s in strokes]
    noise = RELATIVE_NOISE * float(np.std(np.concatenate(forces)))
    recordings = [
        record(case, stroke, force + noise * random.standard_normal(len(force)), k)
        for k, (stroke, force) in enumerate(zip(strokes, forces, strict=True))
    ]
    problem = make_problem(assemble(recordings))
    steps = 0

    def count(*_: object) -> None:
        nonlocal steps
        steps += 1

    start = time.process_time()
    minimum = fit_output_error(problem, OptimiserSettings(), progress=count)
    seconds = time.process_time() - start
    return Result(case.force, compute_ratio(case, problem, minimum, noise, random), steps, seconds)


def compute_ratio(
    case: Case, problem: Problem, minimum: Minimum, noise: float, random: np.random.Generator
) -> float:
    """Return the error on unseen strokes over that of the true damper [1]."""
    found: list[float] = []
    true: list[float] = []
    coordinates = problem.space.to_coordinates(minimum.unknowns[problem.layout.coordinates])
    for stroke in UNSEEN_STROKES:
        excitation = make_stroke(case, *stroke, np.linspace(*case.drives, DRIVE_LEVELS))
        clean = simulate(SimulationModel(case.damper), excitation, max_travel=MAX_TRAVEL).force
        force = clean + noise * random.standard_normal(len(clean))
        piece = assemble([record(case, excitation, force, 0)]).pieces[0]
        for errors, damper in ((found, coordinates), (true, case.damper)):
            errors.append(compute_rmse(predict_piece(piece, damper).force - force))
    return float(np.linalg.norm(found) / np.linalg.norm(true))


def make_stroke(case: Case, amplitude: float, velocity: float, levels: Array) -> Excitation:
    """Return a sine with some cycles at each drive."""
    size, speed = amplitude * case.amplitude, velocity * case.velocity
    samples = round(2.0 * np.pi * size / speed * case.rate * CYCLES_PER_LEVEL)
    phase = speed / size * np.arange(samples * len(levels)) / case.rate
    return Excitation(
        case.rate, size * np.sin(phase), speed * np.cos(phase), -(speed**2) / size * np.sin(phase),
        np.repeat(levels, samples),
    )  # fmt: skip


def record(case: Case, stroke: Excitation, force: Array, index: int) -> Recording:
    """Return a recording of one stroke with exact motion."""
    count = len(force)
    frequency = float(np.abs(stroke.velocity).max() / np.abs(stroke.displacement).max() / (2.0 * np.pi))
    segment = Segment(0, "sine", 0, count, "sine", case.amplitude, frequency, None)
    stretch = make_stretch(case.rate, stroke.displacement, force, stroke.drive, (segment,))
    metadata = {"run": {"source": "import", "specimen": "drawn"}}
    return Recording(Path(f"drawn-{index}.mcap"), f"{index:064d}", "coil_v", "V", (stretch,), metadata)


def format_row(name: str, results: Sequence[Result]) -> str:
    """Return one row of the table."""
    ratios, counts, times = (np.array([r[k] for r in results]) for k in (1, 2, 3))
    return (
        f"| {name} | {np.count_nonzero(ratios <= CONVERGED)} of {len(results)} | {ratios.max():.4f} "
        f"| {np.median(counts):.0f} / {np.quantile(counts, 0.95):.0f} "
        f"| {np.median(times):.1f} / {np.quantile(times, 0.95):.1f} |"
    )


def main() -> None:
    """Print the table; also write it to a page."""
    options = make_parser(__doc__, "dampers", 100).parse_args()
    seeds = list_seeds(options)
    with ProcessPoolExecutor(options.jobs) as pool:
        results = list(pool.map(try_damper, seeds))
    groups = {f"{low:g} N to {high:g} N": [r for r in results if low <= r.force < high] for low, high in CLASSES}
    groups["all"] = results
    rows = [format_row(name, group) for name, group in groups.items() if group and options.cases in name]
    print_table(COLUMNS, rows, options.out)
    for seed, result in zip(seeds, results, strict=True):
        if result.ratio > CONVERGED:
            print(f"damper {seed}: {result.force:.3g} N, {result.ratio:.4f}")


if __name__ == "__main__":
    main()
