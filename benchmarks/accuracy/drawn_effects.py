"""Diagnoses of dampers of any size with drawn forms of effects, causes outside the library, or none.

    python -m benchmarks.accuracy.drawn_effects [--recordings 60] [--seed 1] [--kinds one,unknown] [--keep FILE]
        [--out PAGE.md]

Each recording has a random damper from 10 N to 400 kN, a noise spectrum, and one of: no effect, one effect, two
effects, or an unknown cause whose place and variable no effect of the library has. Forms are drawn from the class
of functions of their effect (`benchmarks.common.drawn_forms`), so that no list of forms helps. The simulation is
that of the identification: only the forms are independent of it, not the integrator.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.accuracy.noise_floor import SIZES, Size, draw_damper
from benchmarks.accuracy.null_verdicts import DRIVES, RATE, STROKES, make_strokes
from benchmarks.common.drawn_cases import (
    COLUMNS,
    EFFECT_COUNTS,
    Case,
    Outcome,
    continue_trial,
    diagnose_case,
    format_row,
    format_summary,
    read_options,
)
from benchmarks.common.drawn_forms import DRAWN_EFFECTS, DrawnForm, draw_form
from benchmarks.common.drawn_noise import RELATIVE_NOISE, SPECTRA, draw_noise, make_stretch, round_to
from benchmarks.common.drawn_table import run_trial
from identification.arrays import Array
from identification.damper import Coordinates, DamperSize
from identification.damper.effects import EFFECTS, Stage
from identification.logs import Recording
from identification.simulate import ActiveEffect, Excitation, SimulationModel, simulate

SMALLEST_CHANGE, LARGEST_CHANGE = 2.0, 30.0
"""Change of the force by an effect, over the noise [1]; a refit of the law removes a part of it."""
UNKNOWN_CAUSES: dict[str, Stage] = {
    "gain over displacement": "damper",
    "drive over time": "coil",
    "load cell over force": "force_channel",
    "delay over time": "displacement_channel",
}
"""Causes outside the library, with their stages."""
_HEATING_ITERATIONS = 4
"""Iterations between force and heat; each reduces the error by the softening of the force."""
_CALIBRATIONS = 4
"""Steps in which the strength of an effect is set."""


def try_case(job: tuple[int, str]) -> Outcome:
    """Draw, record and diagnose one case of a kind."""
    return diagnose_case(draw_case(*job))


def draw_case(seed: int, kind: str) -> Case:
    """Draw a damper, its noise and its cause, and record it."""
    random = np.random.default_rng([seed, 20])
    size = SIZES[random.integers(0, len(SIZES))]
    spectrum = sorted(SPECTRA)[random.integers(0, len(SPECTRA))]
    damper = draw_damper(random, size)
    length, drive_factor = size.amplitude / STROKES[0][0], size.highest_drive / max(DRIVES)
    rate = RATE * size.frequencies[1] / STROKES[2][1]
    x, drive, segments = make_strokes(length, rate, drive_factor)
    velocity = np.gradient(x) * rate
    stroke = Excitation(rate, x, velocity, np.gradient(velocity) * rate, drive)
    names = draw_names(random, EFFECT_COUNTS.get(kind, 0))
    cause = tuple(UNKNOWN_CAUSES)[random.integers(0, len(UNKNOWN_CAUSES))] if kind == "unknown" else ""
    clean = (
        _add_unknown(damper, stroke, cause, random) if cause else _add_effects(damper, stroke, names, size, random)
    )
    deviation = RELATIVE_NOISE * float(np.std(clean))
    force = round_to(clean + deviation * draw_noise(spectrum, len(x), rate, random), 0.5 * deviation)
    digit = 1e-4 * length * STROKES[0][0]
    measured = round_to(x + 2.0 * digit * random.standard_normal(len(x)), digit)
    stretch = make_stretch(rate, measured, force, drive, segments)
    metadata = {"run": {"source": "import", "specimen": f"drawn {seed}"}}
    recording = Recording(Path(f"drawn-{seed}.mcap"), "0" * 64, "coil_v", "V", (stretch,), metadata)
    label = f"{seed}: {size.name}, {spectrum}, {' and '.join(sorted(names)) or cause or 'none'}"
    stages = {UNKNOWN_CAUSES[cause]} if cause else {EFFECTS[n].stage for n in names}
    return Case(recording, kind, frozenset(names), label, frozenset(stages))


def draw_names(random: np.random.Generator, count: int) -> list[str]:
    """Draw the names of some effects."""
    return [str(n) for n in random.choice(DRAWN_EFFECTS, count, replace=False)]


def _add_effects(
    damper: Coordinates, stroke: Excitation, names: Sequence[str], size: Size, random: np.random.Generator
) -> Array:
    """Simulate the force with drawn forms of some effects, each with a drawn change of the force."""
    plain = _simulate(damper, stroke, ())
    scale = measure_size(plain, stroke)
    duration = len(plain) / stroke.rate
    active: list[ActiveEffect] = []
    for name in names:
        form = draw_form(name, random, scale, duration)
        change = np.exp(random.uniform(np.log(SMALLEST_CHANGE), np.log(LARGEST_CHANGE)))
        active.append(_calibrate(damper, stroke, form, change * RELATIVE_NOISE * float(np.std(plain)), plain))
    return _simulate(damper, stroke, tuple(active))


def measure_size(force: Array, stroke: Excitation) -> DamperSize:
    """Return the size of a damper from its force (N,) [N] and motion."""
    duration = len(force) / stroke.rate
    return DamperSize(
        float(np.std(force)),
        0.5 * float(np.ptp(stroke.displacement)),
        float(np.abs(stroke.velocity).max()),
        float(np.abs(stroke.drive).max()),
        duration,
        duration,
    )


def _calibrate(
    damper: Coordinates, stroke: Excitation, form: DrawnForm, change: float, plain: Array
) -> ActiveEffect:
    """Return the effect with the strength at which it changes the force by about ``change`` [N]."""
    strength = 0.1
    for _ in range(_CALIBRATIONS):
        reached = float(np.std(_simulate(damper, stroke, (form.activate(strength),)) - plain))
        strength = float(np.clip(strength * np.clip(change / max(reached, 1e-300), 0.1, 10.0), 1e-4, 3.0))
    return form.activate(strength)


def _simulate(damper: Coordinates, stroke: Excitation, effects: tuple[ActiveEffect, ...]) -> Array:
    """Simulate the force (N,) [N]; heating follows the power of the damper that it has softened."""
    model = SimulationModel(damper, effects=effects)
    if not any(e.form.action == "softening" for e in effects):
        return simulate(model, stroke, max_travel=0.005).force
    cold = SimulationModel(damper, effects=tuple(e for e in effects if e.form.action != "softening"))
    force = simulate(cold, stroke, max_travel=0.005).force
    for _ in range(_HEATING_ITERATIONS):
        heated = replace(stroke, power=np.abs(force * stroke.velocity))
        force = simulate(model, heated, max_travel=0.005).force
    return force


def _add_unknown(damper: Coordinates, stroke: Excitation, cause: str, random: np.random.Generator) -> Array:
    """Simulate the force with a cause outside the library, of a drawn strength."""
    plain = _simulate(damper, stroke, ())
    strength = float(np.exp(random.uniform(np.log(0.05), np.log(0.3))))
    size = measure_size(plain, stroke)
    shape = _draw_wave(random)
    if cause == "load cell over force":
        relative = plain / np.abs(plain).max()
        return np.asarray(plain + strength * size.force * shape(relative) * np.abs(relative))
    if cause == "drive over time":
        time = np.linspace(-1.0, 1.0, len(plain))
        return _simulate(damper, replace(stroke, drive=stroke.drive * (1.0 + strength * shape(time))), ())
    if cause == "delay over time":
        largest = 0.3 * strength * size.length / size.velocity
        lead = largest * shape(np.linspace(-1.0, 1.0, len(plain)))
        moved = np.interp(stroke.time + lead, stroke.time, stroke.displacement)
        velocity = np.gradient(moved) * stroke.rate
        ahead = replace(
            stroke, displacement=moved, velocity=velocity, acceleration=np.gradient(velocity) * stroke.rate
        )
        return _simulate(damper, ahead, ())
    gain = 1.0 + strength * shape(stroke.displacement / size.length)
    # Neither the accumulator's spring nor the preload passes through the gap with the fluid.
    static = damper.k1 * stroke.displacement - damper.f0
    return np.asarray(static + gain * (plain - static))


def _draw_wave(random: np.random.Generator) -> Callable[[Array], Array]:
    """Return a smooth function on -1 to 1 with values of about one."""
    weights, phases = random.standard_normal(3) / np.sqrt(3.0), random.uniform(0.0, 2.0 * np.pi, 3)

    def wave(r: Array) -> Array:
        return np.asarray(
            sum(w * np.cos(k * 2.0 * r + p) for k, (w, p) in enumerate(zip(weights, phases, strict=True), 1))
        )

    return wave


def main() -> None:
    """Print every case and the summary; also write them to a page."""
    options, jobs = read_options(__doc__, 60)
    with ProcessPoolExecutor(options.jobs) as pool:
        outcomes = continue_trial(jobs, options.keep, partial(pool.map, try_case))
        run_trial(COLUMNS, outcomes, format_row, format_summary, options.out)


if __name__ == "__main__":
    main()
