"""Cost of the alternatives to design decisions: the figures of the notes in docs/decisions.

    python -m benchmarks choices

A plain `python -m benchmarks` does not run it, because its figures do not change with the code.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
import numpy.typing as npt
from scipy.interpolate import make_interp_spline

from benchmarks.common import make_sine, measure_cpu_time, print_line
from benchmarks.speed import SHUFFLED_LEVELS, TRAINING_STROKES, make_excitation
from identification.arrays import Array
from identification.damper import Coordinates, Parameters, find_parameter_set, to_coordinates, to_parameters
from identification.fitting import LowPass, Piece, SearchSpace, compute_filter_delay, measure_scales
from identification.logs import ChannelFilter
from identification.simulate import SENSITIVITY_COLUMNS, Excitation, SimulationModel, simulate

FILTER = ChannelFilter("butterworth", 2, 300.0)
NOISE = 2.5
"""Noise of the load cell in the default scenario [N]."""
DENSE_OVERSAMPLING = 64
"""Oversampling [1] of the simulation that is the reference for a filtered or delayed force."""


def run() -> None:
    """Print all comparisons."""
    compare_steps()
    compare_delays()
    compare_filters()
    compare_conditioning()
    compare_differences()


def compare_steps() -> None:
    """Compare steps at reversals (decision 0003) with the same number of steps in each sample."""
    c, moved = (
        to_coordinates(find_parameter_set("spencer_1997").parameters),
        make_sine_excitation(0.015, 2.5, 100.0, 1.5),
    )
    count = len(moved.drive) - 1
    # Reference of this table; the benchmark `simulation` prints its difference from LSODA at 1e-11.
    exact = simulate(SimulationModel(c), moved, np.full(count, 200, np.uint8)).force
    print("steps per sample: spencer_1997 at 1.5 V, 15 mm 2.5 Hz, 100 s at 1 kHz")
    for label, max_travel, each in (
        *((f"{n} in each sample", 0.1, n) for n in (1, 2, 4, 8)),
        *((f"at reversals of the hysteresis, max travel {f}", f, 0) for f in (0.1, 0.005)),
    ):
        plan = np.full(count, each, np.uint8)
        found = simulate(SimulationModel(c), moved, plan.copy(), max_travel=max_travel)
        spent = measure_cpu_time(partial(_simulate_steps, c, moved, plan, max_travel))
        print_line(
            f"{label}: rms error over standard deviation", (found.force - exact).std() / exact.std(), "", ""
        )
        print_line(f"{label}: time", 1e3 * spent, "ms", f"{found.step_counts.mean():.2f} steps per sample")


def _simulate_steps(c: Coordinates, stroke: Excitation, steps: npt.NDArray[np.uint8], max_travel: float) -> None:
    """Simulate with given step counts (N - 1,), which the simulation may change."""
    simulate(SimulationModel(c), stroke, steps.copy(), max_travel=max_travel)


def compare_delays() -> None:
    """Compare a delay of the inputs (decision 0004) with a force that is shifted by interpolation."""
    c, moved = make_laboratory(), make_sine_excitation(0.015, 2.0, 10.0, 0.5)
    late = 0.5 / moved.rate
    dense = simulate(SimulationModel(c), moved.oversample(DENSE_OVERSAMPLING)).force
    # A delayed motion is constant before its first sample, so the start is not compared.
    rows = np.arange(200, len(moved.drive))
    exact = dense[rows * DENSE_OVERSAMPLING - DENSE_OVERSAMPLING // 2]
    plain = simulate(SimulationModel(c), moved).force
    times = np.arange(len(plain)) / moved.rate
    print("half a sample of delay: laboratory damper at 0.5 V, 15 mm 2 Hz")
    for label, found in (
        ("inputs delayed", simulate(SimulationModel(c, force_delay=late), moved).force),
        ("force shifted by a cubic spline", make_interp_spline(times, plain)(times - late)),
        ("force shifted by linear interpolation", np.interp(times - late, times, plain)),
    ):
        print_line(f"{label}: largest error", np.abs(found[rows] - exact).max(), "N", "")


def compare_filters() -> None:
    """Compare the oversampled force filter (decision 0004) with a delay, and with other oversamplings."""
    c, strokes = make_laboratory(), [make_excitation(a, f, SHUFFLED_LEVELS) for a, f in TRAINING_STROKES]
    exact = [simulate_filtered(c, s, DENSE_OVERSAMPLING) for s in strokes]
    late = SimulationModel(c, force_delay=compute_filter_delay(FILTER))
    print(f"filter of the load cell, second order, 300 Hz: four strokes, 56 s at 1 kHz, force noise {NOISE} N")
    methods: list[tuple[str, Callable[[], list[Array]]]] = [
        ("replaced by a delay", lambda: [simulate(late, s).force for s in strokes])
    ]
    methods += [(f"simulated at {n} kHz", partial(_simulate_all_filtered, c, strokes, n)) for n in (1, 4, 16)]
    for label, method in methods:
        errors = [found - e for found, e in zip(method(), exact, strict=True)]
        print_line(f"{label}: largest error", max(np.abs(e[200:]).max() for e in errors), "N", "")
        name, bias = find_largest_bias(c, strokes, errors)
        print_line(f"{label}: largest bias of a coordinate", bias, "sd", name)
        print_line(f"{label}: time", 1e3 * measure_cpu_time(method, 3), "ms", "")


def find_largest_bias(c: Coordinates, strokes: list[Excitation], errors: list[Array]) -> tuple[str, float]:
    """Return the coordinate with the largest bias by force errors [N], and the bias in its deviations."""
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
    """Print the condition number of the fit (decision 0002) in different coordinates of the damper."""
    c = make_laboratory()
    strokes = [make_excitation(a, f, SHUFFLED_LEVELS) for a, f in TRAINING_STROKES]
    over = np.vstack(
        [simulate(SimulationModel(c), s, sensitivities=True).sensitivities[:, : len(c)] for s in strokes]
    )
    parameters = to_parameters(c)
    relative = np.diag([abs(value) for value in parameters])
    forces = [simulate(SimulationModel(c), s).force for s in strokes]
    pieces = [Piece(str(i), s, f, np.ones(len(f))) for i, (s, f) in enumerate(zip(strokes, forces, strict=True))]
    space = SearchSpace(0.0, 0.5, measure_scales(pieces))
    print("condition number of the sensitivities of the force: laboratory damper, the four strokes of `fitting`")
    for label, J in (
        ("the paper's fourteen, relative", over @ differentiate_coordinates(parameters) @ relative),
        ("the same with A fixed", (over @ differentiate_coordinates(parameters) @ relative)[:, FREE_COLUMNS]),
        ("thirteen coordinates, relative", over * np.abs(np.array(c))),
        ("thirteen search coordinates", over @ space.differentiate(space.to_search(c))),
    ):
        print_line(label, np.linalg.cond(J), "", "columns not scaled")
        print_line(label, np.linalg.cond(J / np.linalg.norm(J, axis=0)), "", "columns of unit length")


def compare_differences() -> None:
    """Print the force error from displacement noise if the velocity is a plain difference (decision 0005)."""
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
"""Columns of the fourteen parameters without the gauge."""


def differentiate_coordinates(parameters: Parameters) -> Array:
    """Return the derivatives (13, 14) of the coordinates over the paper's fourteen, by central differences."""
    columns = []
    for i, value in enumerate(parameters):
        move = np.zeros(len(parameters))
        move[i] = 1e-6 * abs(value)
        ends: list[Array] = [
            np.array(tuple(to_coordinates(Parameters(*(np.array(parameters) + sign * move))))) for sign in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * move[i]))
    return np.column_stack(columns)


def make_laboratory() -> Coordinates:
    """Return the default damper."""
    return to_coordinates(find_parameter_set("laboratory").parameters)


def make_sine_excitation(amplitude: float, frequency: float, seconds: float, drive: float) -> Excitation:
    """Return a sine stroke at one drive [V]."""
    t, x, v, a = make_sine(amplitude, frequency, seconds)
    return Excitation(1000.0, x, v, a, np.full(len(t), drive))


def simulate_filtered(c: Coordinates, stroke: Excitation, oversampling: int) -> Array:
    """Simulate the force after the filter [N] at a multiple of the rate."""
    force = simulate(SimulationModel(c), stroke.oversample(oversampling)).force
    return LowPass(FILTER, stroke.rate, oversampling).apply(force)


def _simulate_all_filtered(c: Coordinates, strokes: list[Excitation], oversampling: int) -> list[Array]:
    return [simulate_filtered(c, stroke, oversampling) for stroke in strokes]
