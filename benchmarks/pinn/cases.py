"""Test cases of the networks: dampers with known truth, and scores of a training against it."""

from collections.abc import Mapping
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
    measure_scales,
    predict_piece,
)
from identification.logs import Recording, Stretch
from identification.pinn import train
from identification.pinn.common import PinnResult, TrainingMonitor, read_settings
from identification.pipeline import make_problem
from identification.simulate import Excitation, SimulationModel, simulate

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
SIX_VOLTAGES = ((0.010, 1.0),)
"""Amplitude [m] and frequency [Hz] of the paper's stroke, 12 s at six voltages."""
UNIDENTIFIABLE = ("c1_b",)
"""Coordinates that strokes at 0 to 0.5 V do not determine; excluded from pooled errors."""
DISPLACEMENT_NOISE = 5e-6
"""Standard deviation of the displacement noise [m]."""
_SETTLING_SAMPLES = 20
"""Number of samples at the start that are not fitted, as in a recording."""


@dataclass(frozen=True)
class Score:
    """Errors of a training result against the truth."""

    ratio: float
    """Validation force error of the identified law over that of the true damper, on the same samples [1]."""
    pooled_error: float
    """Root mean square error of the coordinates in Cramér-Rao deviations [1]."""
    seconds: float
    """Processor time [s]."""
    accepted: bool
    """True if the network accepts its own result."""
    reconstruction: float
    """Error of the network's own force on validation blocks, over the noise [1]."""
    simulation: float
    """Error of the simulated law on validation blocks, over the noise [1]."""


def make_case_problem(c: Coordinates, seed: int, *, pairs: bool = False) -> Problem:
    """Make a fit problem of six voltages or four pairs of amplitude and frequency, with noise of 1 %."""
    strokes = [
        make_excitation(a, f, SHUFFLED_LEVELS if pairs else RISING_LEVELS)
        for a, f in (TRAINING_STROKES if pairs else SIX_VOLTAGES)
    ]
    forces, noise = record_forces(c, strokes, seed)
    fitted = np.ones(len(forces[0]))
    fitted[:_SETTLING_SAMPLES] = 0.0
    pieces = [Piece(str(i), s, f, fitted[: len(f)]) for i, (s, f) in enumerate(zip(strokes, forces, strict=True))]
    # Synthetic channels have no delays, so a narrow prior keeps the delays at zero.
    return Problem(tuple(pieces), SearchSpace(0.0, 0.5, measure_scales(pieces)), noise, 1e-9)


def train_preset(
    preset: str | Path, c: Coordinates, seed: int, *, pairs: bool = False, problem: Problem | None = None,
    changes: Mapping[str, object] | None = None,
) -> Score:  # fmt: skip
    """Train a preset on a damper, or on a given problem of it; score it with the bound of known motion."""
    known = make_case_problem(c, seed, pairs=pairs)
    problem = problem or known
    settings = read_settings(preset).model_copy(update={"seed": seed, **(changes or {})})
    return score_training(train(problem, settings, TrainingMonitor()), c, problem, known, seed)


def score_training(found: PinnResult, c: Coordinates, problem: Problem, known: Problem, seed: int) -> Score:
    """Score a training on a problem by the truth and by the bound of a problem with known motion."""
    return Score(
        compute_validation_ratio(found.coordinates, c, seed),
        compute_pooled_error(known, found.coordinates, c),
        found.seconds,
        found.accepted,
        (found.reconstruction.validation or np.nan) / problem.noise,
        (found.simulation.validation or np.nan) / problem.noise,
    )


def compute_validation_ratio(found: Coordinates, true: Coordinates, seed: int) -> float:
    """Return the force error on two validation strokes over that of the true damper [1]."""
    strokes = [make_excitation(a, f, RISING_LEVELS) for a, f in VALIDATION_STROKES]
    forces, _ = record_forces(true, strokes, seed + 500)
    pieces = [Piece("validation", s, f, np.ones(len(f))) for s, f in zip(strokes, forces, strict=True)]
    errors = [np.concatenate([predict_piece(p, c).force - p.force for p in pieces]) for c in (found, true)]
    return compute_rmse(errors[0]) / compute_rmse(errors[1])


def compute_pooled_error(problem: Problem, found: Coordinates, true: Coordinates) -> float:
    """Compute the root mean square error of the coordinates in Cramér-Rao deviations of a problem [1]."""
    information = problem.evaluate(problem.make_start(true)).hessian
    # There are no delays here; as unknowns they would widen the bound and make the errors seem smaller.
    kept = ~problem.delay_mask
    bound = np.linalg.inv(information[np.ix_(kept, kept)])[:COORDINATE_COUNT, :COORDINATE_COUNT]
    D = problem.space.differentiate(problem.space.to_search(true))
    deviation = np.sqrt(np.diag(D @ bound @ D.T))
    scored = [i for i, name in enumerate(Coordinates._fields) if name not in UNIDENTIFIABLE]
    return float(np.sqrt(np.mean(((np.array(found) - np.array(true)) / deviation)[scored] ** 2)))


def make_random_recording(seed: int, seconds: float = 20.0, highest: float = 4.0) -> Recording:
    """Make a recording of a random displacement of 6 mm rms with 5 µm of noise, and a drive with random steps."""
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
    """Simulate the laboratory damper on a stroke, with 5 µm of noise on the displacement and 1 % on the force."""
    force = simulate(SimulationModel(LABORATORY), stroke, max_travel=0.005).force
    count = len(force)
    made = Stretch(
        name="synthetic", time=np.arange(count) / stroke.rate, rate=stroke.rate,
        displacement=stroke.displacement + DISPLACEMENT_NOISE * random.standard_normal(count),
        force=force + 0.01 * float(force.std()) * random.standard_normal(count), drive=stroke.drive,
        velocity=None, segments=(), force_filter=None, displacement_filter=None, force_delay=0.0,
        displacement_delay=0.0, drive_delay=0.0, measured=np.ones(count, bool),
    )  # fmt: skip
    metadata = {"run": {"specimen": "synthetic", "source": "run"}}
    return replace(Recording(Path("synthetic.mcap"), str(seed) * 64, "coil_v", "V", (made,), metadata))


def make_noisy_problem(seed: int, motion: str) -> Problem:
    """Make a problem of six voltages with noise on displacement and force.

    Args:
        seed: seed of the noise.
        motion: ``estimated`` as in a fit, or ``by differences`` of the recorded samples.
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
    """Return the piece with its recorded displacement, and velocity and acceleration by central differences."""
    x = stretch.displacement
    v = np.gradient(x, 1.0 / stretch.rate)
    made = replace(piece.excitation, displacement=x, velocity=v, acceleration=np.gradient(v, 1.0 / stretch.rate))
    return replace(piece, excitation=made)
