"""Noise floor: estimate over true noise, for five sizes of damper and noise of several spectra.

    python -m benchmarks.accuracy.noise_floor [--recordings 4] [--seed 1] [--out PAGE.md]

Each recording has three frequencies at two drives, 4 to 12 cycles each, and noise of 1 % of the force's standard
deviation. The displacement is recorded with noise of 0.01 % of its amplitude. The motion is estimated from it, as
in every fit.
"""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from benchmarks.common.drawn_noise import RELATIVE_NOISE, SPECTRA, draw_noise, make_stretch, round_to
from benchmarks.common.drawn_table import list_seeds, make_parser, print_table
from identification.arrays import Array
from identification.damper import Coordinates
from identification.logs import Segment, Stretch
from identification.noise import NoiseFloorEstimate, estimate_floor
from identification.signals import estimate_motion
from identification.simulate import Excitation, SimulationModel, simulate

DISPLACEMENT_NOISE = 1e-4
"""Noise of the displacement over its amplitude [1]."""
MAINS_FREQUENCY = 50.02
"""Frequency of the mains line [Hz]."""


COLUMNS = (
    "noise", "fourth differences", "known", "floor", "least and largest", "inside the 95 % interval", "half width"
)  # fmt: skip


class Size(NamedTuple):
    """Class of dampers."""

    name: str
    force: float
    """Largest force [N]."""
    amplitude: float
    """Largest amplitude [m]."""
    frequencies: tuple[float, ...]
    """Frequencies of the strokes [Hz]."""
    rate: float
    """Sampling rate [Hz]."""
    highest_drive: float
    """Highest drive; the lowest is 0 [V or A]."""


SIZES = (
    Size("10 N", 10.0, 0.002, (5.3, 11.7, 19.1), 5000.0, 2.0),
    Size("500 N", 500.0, 0.010, (0.7, 1.3, 2.9), 1000.0, 2.25),
    Size("1.5 kN", 1500.0, 0.005, (1.1, 2.3, 4.1), 200.0, 1.0),
    Size("20 kN", 2e4, 0.05, (0.31, 0.53, 0.97), 500.0, 3.0),
    Size("400 kN", 4e5, 0.25, (0.11, 0.17, 0.29), 200.0, 10.0),
)


class Result(NamedTuple):
    """Estimates of one recording, over its true noise [1]."""

    ratio: float
    high_frequency: float
    is_known: bool
    """True if the floor is more than a lower bound."""
    is_inside: bool
    """True if the true noise lies in the 95 % interval."""
    width: float
    """Half the width of the interval."""


def draw_damper(random: np.random.Generator, size: Size) -> Coordinates:
    """Draw a damper of a size: yield force, damping, stiffness and shape within wide ranges."""
    speed = 2.0 * np.pi * size.frequencies[1] * size.amplitude
    highest = random.uniform(0.35, 0.95) * size.force
    lowest = highest / np.exp(random.uniform(np.log(1.3), np.log(20.0)))
    viscous = (size.force - highest) / speed
    roll_off = viscous * np.exp(random.uniform(np.log(3.0), np.log(40.0)))
    least, least_roll_off = viscous * random.uniform(0.3, 1.5), roll_off * random.uniform(0.3, 1.5)
    stiffness = size.force / size.amplitude
    return Coordinates(
        F_a=lowest, F_b=(highest - lowest) / size.highest_drive,
        D_y=size.amplitude * np.exp(random.uniform(np.log(1e-3), np.log(0.08))),
        rho=random.uniform(0.15, 0.9), n=np.exp(random.uniform(np.log(1.1), np.log(3.0))),
        eta=20.0 * speed / size.amplitude,
        c0_a=least, c0_b=(viscous - least) / size.highest_drive,
        c1_a=least_roll_off, c1_b=(roll_off - least_roll_off) / size.highest_drive,
        k0=stiffness * random.uniform(0.0, 0.3), k1=stiffness * random.uniform(0.0, 0.2),
        f0=size.force * random.uniform(-0.5, 0.5),
    )  # fmt: skip


class Disturbance(NamedTuple):
    """Further properties of a recording."""

    fade: float = 0.0
    """Fade of the force within each segment [1]."""
    digit: float = 0.0
    """Resolution of the force [standard deviations of the noise]."""
    jitter: float = 0.0
    """Change of the motion from cycle to cycle over its amplitude [1]."""
    mains: float = 0.0
    """Variance of a mains line over that of the noise; it is not part of the floor [1]."""
    cycles: tuple[int, int] = (4, 12)
    """Fewest and most cycles of a segment."""


CASES: dict[str, tuple[str, Disturbance]] = {
    **{name: (name, Disturbance()) for name in SPECTRA},
    "white, force quantised at 2 deviations": ("white", Disturbance(digit=2.0)),
    "white, force fades by 6 %": ("white", Disturbance(fade=0.06)),
    "half slow, force fades by 6 %": ("half slow (20 ms)", Disturbance(fade=0.06)),
    "white, motion jitters by 0.2 %": ("white", Disturbance(jitter=2e-3)),
    "white, mains line of equal power": ("white", Disturbance(mains=1.0)),
    "half slow, mains line of equal power": ("half slow (20 ms)", Disturbance(mains=1.0)),
    "white, 3 cycles": ("white", Disturbance(cycles=(3, 3))),
    "nine tenths slow, 3 cycles": ("nine tenths slow", Disturbance(cycles=(3, 3))),
    "half slow, 15 to 20 cycles": ("half slow (20 ms)", Disturbance(cycles=(15, 20))),
}
"""Spectrum and disturbance of each row."""


def try_case(job: tuple[Size, str, int]) -> Result:
    """Estimate the floor of one drawn recording."""
    size, name, seed = job
    spectrum, disturbance = CASES[name]
    random = np.random.default_rng([seed, SIZES.index(size), sorted(CASES).index(name)])
    clean, stretch = record(size, disturbance, random)
    deviation = RELATIVE_NOISE * float(np.std(clean))
    noise = deviation * draw_noise(spectrum, len(clean), size.rate, random)
    mains = np.sqrt(2.0 * disturbance.mains) * np.sin(2.0 * np.pi * MAINS_FREQUENCY * stretch.time + 1.0)
    force = clean + noise + deviation * mains
    if disturbance.digit:
        force = round_to(force, disturbance.digit * deviation)
        noise = force - clean
    return compare(estimate_floor_of(stretch, force), float(np.std(noise)))


def estimate_floor_of(stretch: Stretch, force: Array) -> NoiseFloorEstimate:
    """Estimate the floor of a stretch with another force (N,) [N]."""
    noisy = replace(stretch, force=force)
    return estimate_floor([noisy], [estimate_motion(noisy)])


def compare(floor: NoiseFloorEstimate, truth: float) -> Result:
    """Compare an estimate with the true noise [N]."""
    low, high = floor.get_interval(floor.noise)
    return Result(
        floor.noise / truth,
        floor.high_frequency / truth,
        floor.is_known,
        low <= truth <= high,
        (high - low) / 2.0 / truth,
    )


def record(size: Size, disturbance: Disturbance, random: np.random.Generator) -> tuple[Array, Stretch]:
    """Simulate one recording; return its force without noise [N], and the stretch without force noise."""
    damper, edges = draw_damper(random, size), [0]
    displacements, drives, fades = [], [], []
    for frequency in size.frequencies:
        for drive in (0.0, size.highest_drive):
            amplitude = size.amplitude * (size.frequencies[0] / frequency) ** 0.5 * random.uniform(0.6, 1.0)
            cycles = int(random.integers(disturbance.cycles[0], disturbance.cycles[1] + 1))
            count = round(cycles * size.rate / frequency)
            phase = 2.0 * np.pi * np.arange(count) / count * cycles
            change = 1.0 + disturbance.jitter * np.interp(
                phase, 2.0 * np.pi * np.arange(cycles + 1), random.standard_normal(cycles + 1)
            )
            displacements.append(amplitude * change * np.sin(phase))
            drives.append(np.full(count, drive))
            fades.append(1.0 - disturbance.fade * np.arange(count) / count)
            edges.append(edges[-1] + count)
    x = np.concatenate(displacements)
    velocity = np.gradient(x) * size.rate
    excitation = Excitation(size.rate, x, velocity, np.gradient(velocity) * size.rate, np.concatenate(drives))
    clean = np.concatenate(fades) * simulate(SimulationModel(damper), excitation).force
    frequencies = [f for f in size.frequencies for _ in range(2)]
    segments = tuple(
        Segment(k, f"segment {k}", edges[k], edges[k + 1], "sine", size.amplitude, f, None)
        for k, f in enumerate(frequencies)
    )
    measured = x + DISPLACEMENT_NOISE * size.amplitude * random.standard_normal(len(x))
    return clean, make_stretch(size.rate, measured, np.zeros(len(x)), excitation.drive, segments)


def format_row(name: str, results: list[Result]) -> str:
    """Return one row of the table; a floor that is not known counts in the second and third column only."""
    high, known = np.mean([r.high_frequency for r in results]), [r for r in results if r.is_known]
    start = f"| {name} | {high:.2f} | {len(known)} of {len(results)} |"
    if not known:
        return f"{start} - | - | - | - |"
    ratios = np.array([r.ratio for r in known])
    inside, width = sum(r.is_inside for r in known), np.mean([r.width for r in known])
    return (
        f"{start} {ratios.mean():.3f} ± {ratios.std():.3f} "
        f"| {ratios.min():.3f}-{ratios.max():.3f} | {inside} of {len(known)} | {100 * width:.1f} % |"
    )


def main() -> None:
    """Print the table; also write it to a page."""
    options = make_parser(__doc__, "recordings", 4).parse_args()
    names = [name for name in CASES if options.cases in name]
    with ProcessPoolExecutor(options.jobs) as pool:
        jobs = ([(size, name, seed) for size in SIZES for seed in list_seeds(options)] for name in names)
        rows = (format_row(name, list(pool.map(try_case, job))) for name, job in zip(names, jobs, strict=True))
        print_table(COLUMNS, rows, options.out)


if __name__ == "__main__":
    main()
