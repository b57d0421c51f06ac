"""What the roads not taken would have cost: the figures behind the decision notes in docs/decisions.

`python -m benchmarks choices`. Not part of a plain `python -m benchmarks`: it measures choices, not progress.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import make_interp_spline

from benchmarks.common import make_sine, measure_cpu_time, print_line
from benchmarks.speed import SHUFFLED_LEVELS, TRAINING_STROKES, make_excitation
from identification.arrays import Array
from identification.damper import Coordinates, find_parameter_set, to_coordinates, to_parameters
from identification.fitting import LowPass, SearchSpace, compute_filter_delay
from identification.logs import ChannelFilter
from identification.simulate import SENSITIVITY_COLUMNS, Excitation, SimulationModel, simulate

FILTER = ChannelFilter("butterworth", 2, 300.0)
NOISE = 2.5
"""[N] of the load cell of the default scenario."""
DENSE_OVERSAMPLING = 64
"""[1] fineness of the grid that stands for the truth of a filtered or delayed force."""


def run() -> None:
    """Print all comparisons."""
    compare_steps()
    compare_delays()
    compare_filters()
    compare_conditioning()
    compare_differences()


def compare_steps() -> None:
    """Steps at reversals (decision 0003) against the same number in every sample."""
    c, moved = (
        to_coordinates(find_parameter_set("spencer_1997").parameters),
        make_sine_excitation(0.015, 2.5, 100.0, 1.5),
    )
    count = len(moved.drive) - 1
    # The truth of this table; how near it is to LSODA at 1e-11, `simulation` prints.
    exact = simulate(SimulationModel(c), moved, np.full(count, 200, np.uint8)).force
    print("steps in a sample: spencer_1997 at 1.5 V, 15 mm 2.5 Hz, 100 s at 1 kHz")
    for label, fineness, each in (
        *((f"{n} in every sample", 0.1, n) for n in (1, 2, 4, 8)),
        *((f"where the hysteresis turns, fineness {f}", f, 0) for f in (0.1, 0.005)),
    ):
        plan = np.full(count, each, np.uint8)
        found = simulate(SimulationModel(c), moved, plan.copy(), max_travel=fineness)
        spent = measure_cpu_time(
            lambda p=plan, f=fineness: simulate(SimulationModel(c), moved, p.copy(), max_travel=f)
        )
        print_line(f"{label}: rms error, of the deviation", (found.force - exact).std() / exact.std(), "", "")
        print_line(f"{label}: time", 1e3 * spent, "ms", f"{found.step_counts.mean():.2f} steps a sample")


def compare_delays() -> None:
    """A delay applied to the inputs (decision 0004) against the force moved by interpolation."""
    c, moved = make_laboratory(), make_sine_excitation(0.015, 2.0, 10.0, 0.5)
    late = 0.5 / moved.rate
    dense = simulate(SimulationModel(c), moved.oversample(DENSE_OVERSAMPLING)).force
    # A delayed motion stands still before its first sample: the start is no part of the comparison.
    rows = np.arange(200, len(moved.drive))
    exact = dense[rows * DENSE_OVERSAMPLING - DENSE_OVERSAMPLING // 2]
    plain = simulate(SimulationModel(c), moved).force
    times = np.arange(len(plain)) / moved.rate
    print("half a sample of delay: laboratory damper at 0.5 V, 15 mm 2 Hz")
    for label, found in (
        ("inputs delayed", simulate(SimulationModel(c, force_delay=late), moved).force),
        ("force moved by a cubic spline", make_interp_spline(times, plain)(times - late)),
        ("force moved linearly", np.interp(times - late, times, plain)),
    ):
        print_line(f"{label}: largest error", np.abs(found[rows] - exact).max(), "N", "")


def compare_filters() -> None:
    """The force filter on its grid (decision 0004) against a delay, and coarser and finer grids."""
    c, strokes = make_laboratory(), [make_excitation(a, f, SHUFFLED_LEVELS) for a, f in TRAINING_STROKES]
    exact = [simulate_filtered(c, s, DENSE_OVERSAMPLING) for s in strokes]
    late = SimulationModel(c, force_delay=compute_filter_delay(FILTER))
    print(f"the load cell's filter, second order, 300 Hz: four strokes, 56 s at 1 kHz, force noise {NOISE} N")
    taken: list[tuple[str, Callable[[], list[Array]]]] = [
        ("taken for a delay", lambda: [simulate(late, s).force for s in strokes])
    ]
    taken += [
        (f"simulated at {n} kHz", lambda n=n: [simulate_filtered(c, s, n) for s in strokes]) for n in (1, 4, 16)
    ]
    for label, made in taken:
        errors = [found - e for found, e in zip(made(), exact, strict=True)]
        print_line(f"{label}: largest error", max(np.abs(e[200:]).max() for e in errors), "N", "")
        name, bias = find_worst_bias(c, strokes, errors)
        print_line(f"{label}: worst bias of a coordinate", bias, "sd", name)
        print_line(f"{label}: time", 1e3 * measure_cpu_time(made, 3), "ms", "")


def find_worst_bias(c: Coordinates, strokes: list[Excitation], errors: list[Array]) -> tuple[str, float]:
    """Where wrong forces [N] would move the fit most, in deviations of that coordinate, the delay being free."""
    columns = [*range(len(c)), SENSITIVITY_COLUMNS.index("force_delay")]
    J = (
        np.vstack(
            [simulate(SimulationModel(c), s, sensitivities=True).sensitivities[200:, columns] for s in strokes]
        )
        / NOISE
    )
    size = np.linalg.norm(J, axis=0)
    inverse = np.linalg.inv((J / size).T @ (J / size))
    moved = inverse @ ((J / size).T @ np.concatenate([e[200:] for e in errors])) / NOISE
    bias = (np.abs(moved) / np.sqrt(np.diag(inverse)))[: len(c)]
    return c._fields[int(bias.argmax())], float(bias.max())


def compare_conditioning() -> None:
    """How well scaled the fit is (decision 0002), in each way of saying a damper."""
    c = make_laboratory()
    strokes = [make_excitation(a, f, SHUFFLED_LEVELS) for a, f in TRAINING_STROKES]
    over = np.vstack(
        [simulate(SimulationModel(c), s, sensitivities=True).sensitivities[:, : len(c)] for s in strokes]
    )
    parameters = to_parameters(c)
    relative = np.diag([abs(value) for value in parameters])
    space = SearchSpace(0.0, 0.5)
    print("condition number of the slopes of the force: laboratory damper, the four strokes of `fitting`")
    for label, J in (
        ("the paper's fourteen, each relative to itself", over @ differentiate_coordinates(parameters) @ relative),
        ("the same with A held", (over @ differentiate_coordinates(parameters) @ relative)[:, FREE_COLUMNS]),
        ("thirteen coordinates, each relative to itself", over * np.abs(np.array(c))),
        ("thirteen search numbers", over @ space.differentiate(space.to_search(c))),
    ):
        print_line(label, np.linalg.cond(J), "", "columns as they are")
        print_line(label, np.linalg.cond(J / np.linalg.norm(J, axis=0)), "", "columns of length one")


def compare_differences() -> None:
    """What the noise of a displacement costs where its velocity is a plain difference (decision 0005)."""
    c, noise = make_laboratory(), 2e-6
    print(f"motion by central differences of a displacement with {1e6 * noise:g} µm of noise at 1 kHz, 10 mm 1 Hz")
    for drive in (0.0, 0.25, 0.5):
        moved = make_sine_excitation(0.01, 1.0, 10.0, drive)
        x = moved.displacement + noise * np.random.default_rng(0).standard_normal(len(moved.drive))
        v = np.gradient(x) * moved.rate
        rough = Excitation(moved.rate, x, v, np.gradient(v) * moved.rate, moved.drive)
        error = (simulate(SimulationModel(c), rough).force - simulate(SimulationModel(c), moved).force)[200:-5]
        print_line(f"rms error of the simulated force at {drive} V", float(np.sqrt(np.mean(error**2))), "N", "")


FREE_COLUMNS = [i for i, name in enumerate(to_parameters(Coordinates(*range(1, 14)))._fields) if name != "A"]
"""Columns of the fourteen without the gauge."""


def differentiate_coordinates(parameters: tuple[float, ...]) -> Array:
    """(13, 14) derivative of the coordinates over the paper's fourteen, by central differences."""
    kind = type(parameters)
    columns = []
    for i, value in enumerate(parameters):
        move = np.zeros(len(parameters))
        move[i] = 1e-6 * abs(value)
        ends = [np.array(to_coordinates(kind(*(np.array(parameters) + sign * move)))) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * move[i]))
    return np.column_stack(columns)


def make_laboratory() -> Coordinates:
    """The default damper."""
    return to_coordinates(find_parameter_set("laboratory").parameters)


def make_sine_excitation(amplitude: float, frequency: float, seconds: float, drive: float) -> Excitation:
    """A sine at one drive."""
    t, x, v, a = make_sine(amplitude, frequency, seconds)
    return Excitation(1000.0, x, v, a, np.full(len(t), drive))


def simulate_filtered(c: Coordinates, moved: Excitation, finer: int) -> Array:
    """The force behind the filter, simulated at ``finer`` times the rate [N]."""
    return LowPass(FILTER, moved.rate, finer).apply(simulate(SimulationModel(c), moved.oversample(finer)).force)
