"""What the networks are tried on: dampers with known truth, and how far from it they end."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.speed import (
    RISING_LEVELS,
    SHUFFLED_LEVELS,
    TRAINING_STROKES,
    VALIDATION_STROKES,
    make_excitation,
    record_forces,
)
from identification.damper import Coordinates, find_parameter_set, to_coordinates
from identification.fitting import (
    COORDINATE_COUNT,
    Piece,
    Problem,
    SearchSpace,
    assemble,
    compute_rmse,
    predict_piece,
)
from identification.logs import Recording, Stretch
from identification.pinn import train
from identification.pinn.common import PinnResult, TrainingMonitor, read_settings
from identification.pipeline import make_problem
from identification.simulate import Excitation, SimulationModel, simulate

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
SIX_VOLTAGES = ((0.010, 1.0),)
"""One sine of 10 mm and 1 Hz through six voltages, 12 s: the paper's."""
UNIDENTIFIABLE = ("c1_b",)
"""Coordinates that 0 to 0.5 V do not fix; left out of pooled errors, as in the reference study."""
DISPLACEMENT_NOISE = 5e-6
"""[m] standard deviation."""
_SETTLING_SAMPLES = 20
"""Samples at the start that are not fitted, as in a recording."""


@dataclass(frozen=True)
class Score:
    """How a training ended."""

    ratio: float
    """[1] unseen force error of the identified law over that of the true damper, on the same samples."""
    pooled_error: float
    """[1] root mean square of the coordinates' errors in Cramér-Rao deviations."""
    seconds: float
    """[s] of processor time."""
    accepted: bool
    reconstruction: float
    """[1] validation error of the network's own force, over the noise."""
    simulation: float
    """[1] validation error of the law simulated, over the noise."""


def make_case_problem(c: Coordinates, seed: int, *, pairs: bool = False) -> Problem:
    """A recording of a damper: six voltages, or four pairs of amplitude and frequency; noise of one per cent."""
    strokes = [
        make_excitation(a, f, SHUFFLED_LEVELS if pairs else RISING_LEVELS)
        for a, f in (TRAINING_STROKES if pairs else SIX_VOLTAGES)
    ]
    forces, noise = record_forces(c, strokes, seed)
    fitted = np.ones(len(forces[0]))
    fitted[:_SETTLING_SAMPLES] = 0.0
    pieces = [Piece(str(i), s, f, fitted[: len(f)]) for i, (s, f) in enumerate(zip(strokes, forces, strict=True))]
    # Made up, so no channel is late: the prior holds the delays at nothing.
    return Problem(tuple(pieces), SearchSpace(0.0, 0.5), noise, 1e-9)


def train_preset(
    preset: str | Path, c: Coordinates, seed: int, *, pairs: bool = False, given: Problem | None = None,
    **changes: object,
) -> Score:  # fmt: skip
    """Train a preset on a damper, or on a given recording of it, and judge it by the bound of known motion."""
    known = make_case_problem(c, seed, pairs=pairs)
    problem = given or known
    settings = read_settings(preset).model_copy(update={"seed": seed, **changes})
    return score_training(train(problem, settings, TrainingMonitor()), c, problem, known, seed)


def score_training(found: PinnResult, c: Coordinates, problem: Problem, known: Problem, seed: int) -> Score:
    """How a training on a problem ended, by the truth and by the bound of a problem whose motion is known."""
    return Score(
        compute_validation_ratio(found.coordinates, c, seed),
        compute_pooled_error(known, found.coordinates, c),
        found.seconds,
        found.accepted,
        (found.reconstruction.validation or np.nan) / problem.noise,
        (found.simulation.validation or np.nan) / problem.noise,
    )


def compute_validation_ratio(found: Coordinates, true: Coordinates, seed: int) -> float:
    """Force error on two unseen strokes over that of the true damper."""
    strokes = [make_excitation(a, f, RISING_LEVELS) for a, f in VALIDATION_STROKES]
    forces, _ = record_forces(true, strokes, seed + 500)
    pieces = [Piece("unseen", s, f, np.ones(len(f))) for s, f in zip(strokes, forces, strict=True)]
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (found, true)]
    return compute_rmse(errors[0]) / compute_rmse(errors[1])


def compute_pooled_error(problem: Problem, found: Coordinates, true: Coordinates) -> float:
    """Root mean square error of the coordinates in Cramér-Rao deviations of this recording."""
    information = problem.evaluate(problem.make_start(true)).hessian
    # Nothing is late here: with delays among the unknowns the bound would be wider and the errors look smaller.
    kept = ~problem.delay_mask
    bound = np.linalg.inv(information[np.ix_(kept, kept)])[:COORDINATE_COUNT, :COORDINATE_COUNT]
    D = problem.space.differentiate(problem.space.to_search(true))
    deviation = np.sqrt(np.diag(D @ bound @ D.T))
    scored = [i for i, name in enumerate(Coordinates._fields) if name not in UNIDENTIFIABLE]
    return float(np.sqrt(np.mean(((np.array(found) - np.array(true)) / deviation)[scored] ** 2)))


def make_random_recording(seed: int, seconds: float = 20.0, highest: float = 4.0) -> Recording:
    """A random displacement of 6 mm rms under a drive that jumps, with 5 µm of noise on the displacement."""
    rate = 1000.0
    count = round(seconds * rate)
    random = np.random.default_rng(seed)
    line = np.fft.rfftfreq(2 * count, 1 / rate)
    spectrum = np.fft.rfft(random.standard_normal(2 * count)) * (line <= highest) / (1 + line)
    parts = [np.fft.irfft(spectrum * (2j * np.pi * line) ** k)[:count] for k in range(3)]
    x, v, a = (part * 6e-3 / parts[0].std() for part in parts)
    drive = np.repeat(random.choice([0.0, 0.1, 0.2, 0.3, 0.4, 0.5], int(seconds / 0.5)), round(0.5 * rate))
    return _make_recording(Excitation(rate, x, v, a, drive), random, seed)


def _make_recording(stroke: Excitation, random: np.random.Generator, seed: int) -> Recording:
    """The laboratory damper on a stroke: 5 µm of noise on the displacement, one per cent on the force."""
    force = simulate(SimulationModel(LABORATORY), stroke, max_travel=0.005).force
    count = len(force)
    made = Stretch(
        name="made up", time=np.arange(count) / stroke.rate, rate=stroke.rate,
        displacement=stroke.displacement + DISPLACEMENT_NOISE * random.standard_normal(count),
        force=force + 0.01 * float(force.std()) * random.standard_normal(count), drive=stroke.drive,
        velocity=None, segments=(), force_filter=None, displacement_filter=None, force_delay=0.0,
        displacement_delay=0.0, drive_delay=0.0, measured=np.ones(count, bool),
    )  # fmt: skip
    metadata = {"run": {"specimen": "made up", "source": "run"}}
    return replace(Recording(Path("made up.mcap"), str(seed) * 64, "coil_v", "V", (made,), metadata))


def make_noisy_problem(seed: int, motion: str) -> Problem:
    """Six voltages with noise on displacement and force.

    Args:
        seed: of the noise.
        motion: ``estimated`` as the product does it, or ``by differences`` of the samples as they are.
    """
    ((amplitude, frequency),) = SIX_VOLTAGES
    assembled = assemble(
        [_make_recording(make_excitation(amplitude, frequency, RISING_LEVELS), np.random.default_rng(seed), seed)]
    )
    problem = make_problem(assembled)
    return (
        problem
        if motion == "estimated"
        else replace(problem, pieces=tuple(map(_use_plain_differences, assembled.pieces, assembled.stretches)))
    )


def _use_plain_differences(piece: Piece, stretch: Stretch) -> Piece:
    """A piece with its displacement as recorded, velocity and acceleration by central differences."""
    x = stretch.displacement
    v = np.gradient(x, 1.0 / stretch.rate)
    made = replace(piece.excitation, displacement=x, velocity=v, acceleration=np.gradient(v, 1.0 / stretch.rate))
    return replace(piece, excitation=made)
