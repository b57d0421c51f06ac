"""What the roads not taken would have cost: the figures behind the decision notes in docs/decisions.

`python -m benchmarks choices`. Not part of a plain `python -m benchmarks`: it measures choices, not progress.
"""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import make_interp_spline

from benchmarks.fitting import SHUFFLED, TRAINING, stroke
from benchmarks.timing import cpu_seconds, line, sine
from identification.arrays import Array
from identification.damper.coordinates import Coordinates, to_coordinates, to_parameters
from identification.damper.parameter_sets import parameter_set
from identification.force_channel import LowPass, filter_lag
from identification.recordings import ChannelFilter
from identification.search_space import SearchSpace
from identification.simulate import UNKNOWNS, Setting, Stroke, simulate

FILTER = ChannelFilter("butterworth", 2, 300.0)
NOISE = 2.5
"""[N] of the load cell of the default scenario."""
DENSE = 64
"""[1] fineness of the grid that stands for the truth of a filtered or delayed force."""


def run() -> None:
    """Print all comparisons."""
    steps()
    delays()
    filters()
    conditions()
    differences()


def steps() -> None:
    """Steps at reversals (decision 0003) against the same number in every sample."""
    c, moved = to_coordinates(parameter_set("spencer_1997").parameters), constant(0.015, 2.5, 100.0, 1.5)
    count = len(moved.drive) - 1
    # The truth of this table; how near it is to LSODA at 1e-11, `simulation` prints.
    exact = simulate(Setting(c), moved, np.full(count, 200, np.uint8)).force
    print("steps in a sample: spencer_1997 at 1.5 V, 15 mm 2.5 Hz, 100 s at 1 kHz")
    for label, fineness, each in (
        *((f"{n} in every sample", 0.1, n) for n in (1, 2, 4, 8)),
        *((f"where the hysteresis turns, fineness {f}", f, 0) for f in (0.1, 0.005)),
    ):
        plan = np.full(count, each, np.uint8)
        found = simulate(Setting(c), moved, plan.copy(), fineness=fineness)
        spent = cpu_seconds(lambda p=plan, f=fineness: simulate(Setting(c), moved, p.copy(), fineness=f))
        line(f"{label}: rms error, of the deviation", (found.force - exact).std() / exact.std(), "", "")
        line(f"{label}: time", 1e3 * spent, "ms", f"{found.plan.mean():.2f} steps a sample")


def delays() -> None:
    """A delay applied to the inputs (decision 0004) against the force moved by interpolation."""
    c, moved = laboratory(), constant(0.015, 2.0, 10.0, 0.5)
    late = 0.5 / moved.rate
    dense = simulate(Setting(c), moved.finer(DENSE)).force
    # A delayed motion stands still before its first sample: the start is no part of the comparison.
    rows = np.arange(200, len(moved.drive))
    exact = dense[rows * DENSE - DENSE // 2]
    plain = simulate(Setting(c), moved).force
    times = np.arange(len(plain)) / moved.rate
    print("half a sample of delay: laboratory damper at 0.5 V, 15 mm 2 Hz")
    for label, found in (
        ("inputs delayed", simulate(Setting(c, force_delay=late), moved).force),
        ("force moved by a cubic spline", make_interp_spline(times, plain)(times - late)),
        ("force moved linearly", np.interp(times - late, times, plain)),
    ):
        line(f"{label}: largest error", np.abs(found[rows] - exact).max(), "N", "")


def filters() -> None:
    """The force filter on its grid (decision 0004) against a delay, and coarser and finer grids."""
    c, strokes = laboratory(), [stroke(a, f, SHUFFLED) for a, f in TRAINING]
    exact = [recorded(c, s, DENSE) for s in strokes]
    late = Setting(c, force_delay=filter_lag(FILTER))
    print(f"the load cell's filter, second order, 300 Hz: four strokes, 56 s at 1 kHz, force noise {NOISE} N")
    taken: list[tuple[str, Callable[[], list[Array]]]] = [
        ("taken for a delay", lambda: [simulate(late, s).force for s in strokes])
    ]
    taken += [(f"simulated at {n} kHz", lambda n=n: [recorded(c, s, n) for s in strokes]) for n in (1, 4, 16)]
    for label, made in taken:
        errors = [found - e for found, e in zip(made(), exact, strict=True)]
        line(f"{label}: largest error", max(np.abs(e[200:]).max() for e in errors), "N", "")
        name, bias = worst_bias(c, strokes, errors)
        line(f"{label}: worst bias of a coordinate", bias, "sd", name)
        line(f"{label}: time", 1e3 * cpu_seconds(made, 3), "ms", "")


def worst_bias(c: Coordinates, strokes: list[Stroke], errors: list[Array]) -> tuple[str, float]:
    """Where wrong forces [N] would move the fit most, in deviations of that coordinate, the delay being free."""
    columns = [*range(len(c)), UNKNOWNS.index("force_delay")]
    J = np.vstack([simulate(Setting(c), s, slopes=True).slopes[200:, columns] for s in strokes]) / NOISE
    size = np.linalg.norm(J, axis=0)
    inverse = np.linalg.inv((J / size).T @ (J / size))
    moved = inverse @ ((J / size).T @ np.concatenate([e[200:] for e in errors])) / NOISE
    bias = (np.abs(moved) / np.sqrt(np.diag(inverse)))[: len(c)]
    return c._fields[int(bias.argmax())], float(bias.max())


def conditions() -> None:
    """How well scaled the fit is (decision 0002), in each way of saying a damper."""
    c = laboratory()
    strokes = [stroke(a, f, SHUFFLED) for a, f in TRAINING]
    over = np.vstack([simulate(Setting(c), s, slopes=True).slopes[:, : len(c)] for s in strokes])
    parameters = to_parameters(c)
    relative = np.diag([abs(value) for value in parameters])
    space = SearchSpace(0.0, 0.5)
    print("condition number of the slopes of the force: laboratory damper, the four strokes of `fitting`")
    for label, J in (
        ("the paper's fourteen, each relative to itself", over @ parameter_slopes(parameters) @ relative),
        ("the same with A held", (over @ parameter_slopes(parameters) @ relative)[:, HELD]),
        ("thirteen coordinates, each relative to itself", over * np.abs(np.array(c))),
        ("thirteen search numbers", over @ space.slopes(space.to_search(c))),
    ):
        line(label, np.linalg.cond(J), "", "columns as they are")
        line(label, np.linalg.cond(J / np.linalg.norm(J, axis=0)), "", "columns of length one")


def differences() -> None:
    """What the noise of a displacement costs where its velocity is a plain difference (decision 0005)."""
    c, noise = laboratory(), 2e-6
    print(f"motion by central differences of a displacement with {1e6 * noise:g} µm of noise at 1 kHz, 10 mm 1 Hz")
    for drive in (0.0, 0.25, 0.5):
        moved = constant(0.01, 1.0, 10.0, drive)
        x = moved.displacement + noise * np.random.default_rng(0).standard_normal(len(moved.drive))
        v = np.gradient(x) * moved.rate
        rough = Stroke(moved.rate, x, v, np.gradient(v) * moved.rate, moved.drive)
        error = (simulate(Setting(c), rough).force - simulate(Setting(c), moved).force)[200:-5]
        line(f"rms error of the simulated force at {drive} V", float(np.sqrt(np.mean(error**2))), "N", "")


HELD = [i for i, name in enumerate(to_parameters(Coordinates(*range(1, 14)))._fields) if name != "A"]
"""Columns of the fourteen without the gauge."""


def parameter_slopes(parameters: tuple[float, ...]) -> Array:
    """(13, 14) derivative of the coordinates over the paper's fourteen, by central differences."""
    kind = type(parameters)
    columns = []
    for i, value in enumerate(parameters):
        move = np.zeros(len(parameters))
        move[i] = 1e-6 * abs(value)
        ends = [np.array(to_coordinates(kind(*(np.array(parameters) + sign * move)))) for sign in (1, -1)]
        columns.append((ends[0] - ends[1]) / (2 * move[i]))
    return np.column_stack(columns)


def laboratory() -> Coordinates:
    """The default damper."""
    return to_coordinates(parameter_set("laboratory").parameters)


def constant(amplitude: float, frequency: float, seconds: float, drive: float) -> Stroke:
    """A sine at one drive."""
    t, x, v, a = sine(amplitude, frequency, seconds)
    return Stroke(1000.0, x, v, a, np.full(len(t), drive))


def recorded(c: Coordinates, moved: Stroke, finer: int) -> Array:
    """The force behind the filter, simulated at ``finer`` times the rate [N]."""
    return LowPass(FILTER, moved.rate, finer).apply(simulate(Setting(c), moved.finer(finer)).force)
