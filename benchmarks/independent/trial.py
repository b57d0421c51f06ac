"""Diagnoses of recordings from an independent simulator: its own integration, effects and methods.

    python -m benchmarks.independent.trial [--recordings 30] [--seed 1] [--kinds one,none]
        [--methods sweep] [--out PAGE.md]

Each recording has a random damper of 4 N to 90 kN, a random method (rich, poor, of a campaign, random strokes;
sweeps only where they are asked for) and noise of a random spectrum. It has no effect, one to three, or a
cause outside the library. It is written as CSV, imported by `mrbench import`, and diagnosed from the log alone. An
effect that a refit of the law absorbs cannot be named; it counts as wrong all the same.
"""

import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from benchmarks.common import run_mrbench
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
from benchmarks.common.drawn_noise import SPECTRA, draw_noise, round_to
from benchmarks.common.drawn_table import run_trial
from benchmarks.independent.causes import KNOWN, UNKNOWN, Cause, Scales
from benchmarks.independent.plant import Array, Plant
from benchmarks.independent.rig import Rig
from benchmarks.independent.strokes import METHODS, Strokes, draw_strokes
from identification.damper.effects import EFFECTS
from identification.logs import load

_FORCES = (4.0, 9e4)
"""Range of the force of the dampers [N]."""
_CHANGES = (2.5, 25.0)
"""Range of the change of the force by an effect, over the noise [1]."""
_CALIBRATIONS = 5
"""Steps in which the strength of an effect is set."""
_STRENGTHS = (2e-4, 0.9)
"""Range of the strengths [1]."""


class _Noise(NamedTuple):
    """Noise of both channels."""

    spectrum: str
    force: float
    """Standard deviation [N]."""
    displacement: float
    """Standard deviation [m]."""


class _Drawn(NamedTuple):
    """Draws of one recording."""

    rig: Rig
    scales: Scales
    rate: float
    """Sampling rate [Hz]."""
    method: str


def try_case(job: tuple[int, str], folder: Path, methods: Sequence[str]) -> Outcome:
    """Draw, record, import and diagnose one case of a kind."""
    return diagnose_case(record_case(*job, folder, methods))


def record_case(seed: int, kind: str, folder: Path, methods: Sequence[str] = METHODS) -> Case:
    """Draw a damper and its cause, record it, and import the recording by a folder."""
    random = np.random.default_rng([seed, 41])
    drawn, causes = draw_damper(random, methods), _draw_causes(random, kind)
    noise = _draw_noise(random, drawn)
    strengths = [_calibrate(drawn, cause, k, seed, noise.force, random) for k, cause in enumerate(causes.values())]
    log = folder / f"{seed}.mcap"
    _write_log(log, drawn, _add_causes(drawn, list(causes.values()), strengths, seed), noise, random)
    recording = load(log)
    log.unlink()
    stages = frozenset(UNKNOWN[n][1] if n in UNKNOWN else EFFECTS[n].stage for n in causes)
    named = " and ".join(sorted(causes)) or "none"
    label = f"{seed}: {drawn.scales.force:.0f} N, {drawn.method}, {noise.spectrum}, {named}"
    return Case(recording, kind, frozenset(causes) & frozenset(KNOWN), label, stages)


def _draw_noise(random: np.random.Generator, drawn: _Drawn) -> _Noise:
    deviation = float(np.std(drawn.rig.record(drawn.scales.strokes)[1]))
    spectrum = sorted(SPECTRA)[random.integers(len(SPECTRA))]
    displacement = drawn.scales.length * _draw_log(random, 5e-5, 4e-4)
    return _Noise(spectrum, deviation * _draw_log(random, 0.004, 0.013), displacement)


def _draw_log(random: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(random.uniform(math.log(low), math.log(high))))


def draw_damper(random: np.random.Generator, methods: Sequence[str] = METHODS) -> _Drawn:
    """Draw a damper of any size, with strokes of one of some methods that fit it."""
    force = _draw_log(random, *_FORCES)
    amplitude = 0.003 * (force / 50.0) ** 0.27 * float(np.exp(0.4 * random.standard_normal()))
    amplitude = min(max(amplitude, 0.0012), 0.12)
    speed = _draw_log(random, 0.03, 0.5) * (amplitude / 0.01) ** 0.4
    frequency = float(np.clip(speed / (2.0 * np.pi * amplitude * 2.5), 0.1, 8.0))
    rate = max(float(random.choice([500.0, 1000.0, 1000.0, 2000.0])), 1000.0 if frequency > 4.0 else 0.0)
    drive, method = float(random.choice([0.5, 1.0, 2.0, 5.0])), methods[int(random.integers(len(methods)))]
    strokes = draw_strokes(random, method, amplitude, frequency, drive, rate)
    rise = _draw_log(random, 25.0, 200.0)
    rig = Rig(_draw_plant(random, force, drive, strokes), rise, rise)
    return _Drawn(rig, Scales(force, drive, strokes), rate, method)


def _draw_plant(random: np.random.Generator, force: float, drive: float, strokes: Strokes) -> Plant:
    """Draw the parameters of a damper with a force [N] at the highest drive and the peak speed."""
    highest = random.uniform(0.45, 0.85) * force
    lowest = highest / _draw_log(random, 1.5, 15.0)
    c0 = (force - highest) / strokes.peak_speed
    c1 = c0 * _draw_log(random, 4.0, 40.0)
    c0_base, c1_base = c0 * random.uniform(0.4, 1.0), c1 * random.uniform(0.3, 1.0)
    stiffness = force / strokes.amplitude
    return Plant(
        yield_base=lowest, yield_slope=(highest - lowest) / drive,
        yield_displacement=strokes.amplitude * _draw_log(random, 0.003, 0.05),
        shape=random.uniform(0.2, 0.85), exponent=_draw_log(random, 1.15, 2.6),
        c0_base=c0_base, c0_slope=(c0 - c0_base) / drive, c1_base=c1_base, c1_slope=(c1 - c1_base) / drive,
        k0=stiffness * random.uniform(0.0, 0.15), k1=stiffness * random.uniform(0.0, 0.1),
        preload=force * random.uniform(-0.3, 0.3), peak_speed=strokes.peak_speed,
    )  # fmt: skip


def _draw_causes(random: np.random.Generator, kind: str) -> dict[str, Cause]:
    if kind == "unknown":
        name = str(random.choice(list(UNKNOWN)))
        return {name: UNKNOWN[name][0]}
    names = set(random.choice(list(KNOWN), EFFECT_COUNTS.get(kind, 0), replace=False))
    return {name: cause for name, cause in KNOWN.items() if name in names}


def _add_causes(drawn: _Drawn, causes: Sequence[Cause], strengths: Sequence[float], seed: int) -> Rig:
    """Return the rig with causes; the form of each depends on seed and place only, not on its strength."""
    rig = drawn.rig
    for k, (cause, strength) in enumerate(zip(causes, strengths, strict=True)):
        rig = cause(rig, strength, np.random.default_rng([seed, k]), drawn.scales)
    return rig


def _calibrate(
    drawn: _Drawn, cause: Cause, place: int, seed: int, noise: float, random: np.random.Generator
) -> float:
    """Return the strength with which a cause alone changes the force by some times the noise [N]."""
    strokes = drawn.scales.strokes
    plain_x, plain = drawn.rig.record(strokes)
    stiffness = drawn.scales.force / strokes.amplitude
    target, strength = _draw_log(random, *_CHANGES) * noise, 0.05
    for _ in range(_CALIBRATIONS):
        x, force = cause(drawn.rig, strength, np.random.default_rng([seed, place]), drawn.scales).record(strokes)
        # An error of the recorded displacement changes no force; a spring of the damper's size compares the two.
        change = max(float(np.std(force - plain)), 1.5 * stiffness * float(np.std(x - plain_x)))
        strength = float(np.clip(strength * np.clip(target / max(change, 1e-300), 0.1, 10.0), *_STRENGTHS))
    return strength


def _write_log(log: Path, drawn: _Drawn, rig: Rig, noise: _Noise, random: np.random.Generator) -> None:
    """Write the recording as CSV and import it."""
    strokes = drawn.scales.strokes
    x, force = rig.record(strokes)
    count = len(force)
    recorded = round_to(
        force + noise.force * draw_noise(noise.spectrum, count, drawn.rate, random),
        noise.force * random.uniform(0.1, 0.8),
    )
    measured = round_to(x + noise.displacement * random.standard_normal(count), noise.displacement)
    time = np.arange(count) / drawn.rate
    table: Array = np.column_stack([time, measured, strokes.sample(strokes.drive), recorded])
    source, header = log.with_suffix(".csv"), "time_s,displacement_m,voltage_v,force_n"
    np.savetxt(source, table, "%.10g", ",", header=header, comments="", encoding="utf-8")
    run_mrbench("import", source, "--out", log)
    source.unlink()


def main() -> None:
    """Print every case and the summary; also write them to a page."""
    options, jobs = read_options(__doc__, 30, METHODS)
    with TemporaryDirectory() as folder, ProcessPoolExecutor(options.jobs) as pool:
        run_one = partial(try_case, folder=Path(folder), methods=options.methods.split(","))
        outcomes = continue_trial(jobs, options.keep, partial(pool.map, run_one))
        run_trial(COLUMNS, outcomes, format_row, format_summary, options.out)


if __name__ == "__main__":
    main()
