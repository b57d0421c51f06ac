"""Verdicts on recordings without any effect, with force noise of several spectra.

    python -m benchmarks.accuracy.null_verdicts [--recordings 10] [--seed 1] [--cases 20] [--out PAGE.md]

Each recording is of a random laboratory damper: three strokes at four drives and 1 kHz. Its noise is 1 % of the
force's standard deviation. The force has a resolution of half the noise, the displacement noise of 2 µm and a
resolution of 1 µm. Dampers of other sizes make the same strokes in their own units. Every verdict other than
`no_gap` is wrong.
"""

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.accuracy.noise_floor import SIZES, Size, draw_damper
from benchmarks.common.drawn_noise import RELATIVE_NOISE, SPECTRA, draw_noise, make_stretch, round_to
from benchmarks.common.drawn_table import list_seeds, make_parser, print_table
from benchmarks.speed import draw_damper as draw_laboratory_damper
from identification.arrays import Array
from identification.gap import diagnose
from identification.logs import Recording, Segment
from identification.simulate import Excitation, SimulationModel, simulate

RATE = 1000.0
STROKES = ((0.012, 1.0, 6), (0.005, 2.5, 12), (0.008, 1.7, 9))
"""Amplitude [m], frequency [Hz] and cycles at each drive."""
DRIVES = (0.0, 0.3, 0.15, 0.5)
"""Drives of each stroke [V]."""
DISPLACEMENT_NOISE, DISPLACEMENT_DIGIT = 2e-6, 1e-6
"""Noise and resolution of the displacement [m]."""


COLUMNS = ("noise", "`no_gap`", "other verdicts", "named", "error of the law over the floor")


class Result(NamedTuple):
    """Diagnosis of one recording."""

    verdict: str
    names: tuple[str, ...]
    ratio: float
    """Error of the law on held-out strokes over the stated noise floor [1]."""


class Condition(NamedTuple):
    """Noise and size of a row of recordings."""

    spectrum: str = "white"
    size: Size | None = None
    """Class of random dampers; None for laboratory dampers."""


CONDITIONS = {
    **{name: Condition(name) for name in SPECTRA},
    **{f"white, {size.name}": Condition(size=size) for size in SIZES},
}
"""Rows of the table by name."""


def try_null(job: tuple[str, int]) -> Result:
    """Record and diagnose one damper without any effect."""
    name, seed = job
    condition = CONDITIONS[name]
    row = [sorted(SPECTRA).index(condition.spectrum), *([SIZES.index(condition.size)] if condition.size else [])]
    diagnosis = diagnose([record(condition, seed, np.random.default_rng([seed, *row]))]).diagnosis
    gap = diagnosis.gap
    return Result(diagnosis.verdict, tuple(e.name for e in diagnosis.effects), gap.before_n / gap.noise_floor_n)


def record(condition: Condition, seed: int, random: np.random.Generator) -> Recording:
    """Return a recording of a random damper.

    A larger damper makes the same strokes in its own units of length, time and drive.
    """
    size = condition.size
    length, rate, drive_factor, damper = 1.0, RATE, 1.0, draw_laboratory_damper(seed)
    if size:
        length, drive_factor = size.amplitude / STROKES[0][0], size.highest_drive / max(DRIVES)
        rate = RATE * size.frequencies[1] / STROKES[2][1]
        damper = draw_damper(random, size)
    x, drive, segments = make_strokes(length, rate, drive_factor)
    velocity = np.gradient(x) * rate
    stroke = Excitation(rate, x, velocity, np.gradient(velocity) * rate, drive)
    clean = simulate(SimulationModel(damper), stroke, max_travel=0.005).force
    noise = draw_noise(condition.spectrum, len(x), rate, random)
    deviation = RELATIVE_NOISE * float(np.std(clean))
    force = round_to(clean + deviation * noise, 0.5 * deviation)
    measured = x + length * DISPLACEMENT_NOISE * random.standard_normal(len(x))
    stretch = make_stretch(rate, round_to(measured, length * DISPLACEMENT_DIGIT), force, drive, segments)
    metadata = {"run": {"source": "import", "specimen": f"null {seed}"}}
    return Recording(Path(f"null-{seed}.mcap"), "0" * 64, "coil_v", "V", (stretch,), metadata)


def make_strokes(length: float, rate: float, drive_factor: float) -> tuple[Array, Array, tuple[Segment, ...]]:
    """Return displacement [m], drive [V] and segments: the strokes of `STROKES` in other units."""
    amplitude, frequency, drive, start = [], [], [], 0
    segments: list[Segment] = []
    for half_stroke, repeat, cycles in STROKES:
        for level in DRIVES:
            count = round(cycles * RATE / repeat)
            size, hertz, value = length * half_stroke, repeat * rate / RATE, drive_factor * level
            name = f"{1e3 * size:g}mm_{hertz:g}Hz_{value:g}V"
            segments.append(Segment(len(segments), name, start, start + count, "sine", size, hertz, value))
            amplitude.append(np.full(count, size))
            frequency.append(np.full(count, repeat))
            drive.append(np.full(count, value))
            start += count
    smooth = np.hanning(121) / np.hanning(121).sum()
    sizes, repeats = (
        np.convolve(np.pad(np.concatenate(part), 60, "edge"), smooth, "valid") for part in (amplitude, frequency)
    )
    angle = 2.0 * np.pi * np.cumsum(repeats) / RATE
    return np.asarray(sizes * np.sin(angle)), np.concatenate(drive), tuple(segments)


def format_row(name: str, results: Sequence[Result]) -> str:
    """Return one row of the table."""
    verdicts = Counter(r.verdict for r in results)
    others = ", ".join(f"{n} {v}" for v, n in sorted(verdicts.items()) if v != "no_gap") or "-"
    named = Counter(name for r in results for name in r.names)
    ratios = [r.ratio for r in results]
    return (
        f"| {name} | {verdicts['no_gap']} of {len(results)} | {others} | {', '.join(sorted(named)) or '-'} "
        f"| {min(ratios):.3f}-{max(ratios):.3f} |"
    )


def main() -> None:
    """Print the table; also write it to a page."""
    options = make_parser(__doc__, "recordings", 10).parse_args()
    names = [name for name in CONDITIONS if options.cases in name]
    with ProcessPoolExecutor(options.jobs) as pool:
        jobs = ([(name, seed) for seed in list_seeds(options)] for name in names)
        rows = (format_row(name, list(pool.map(try_null, job))) for name, job in zip(names, jobs, strict=True))
        print_table(COLUMNS, rows, options.out)


if __name__ == "__main__":
    main()
