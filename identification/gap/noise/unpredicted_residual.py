"""Noise floor where few or no cycles repeat: the residual that no function of stroke, drive and time predicts.

Without repeated cycles, only the noise at high frequencies is known, which slow noise exceeds. Few cycles leave a
wide interval. The error of a fitted model is an upper bound. A residual is noise if a flexible regression predicts
nothing of it on strokes that it has not seen, and if its size changes from block to block as much as that of noise
of its spectrum does. The regression cannot learn an error that follows a rare event, such as a step of the drive.
Such an error is strong in few blocks.
"""

import math
from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.gap.data import EvaluationData, Residual, compute_block_squares
from identification.gap.fits import EXPLAINED_RATIO, NO_GAP_RATIO, Candidate, JointFit
from identification.gap.noise.explainable_share import ResidualRegression
from identification.gap.noise.noise_model import NoiseModel
from identification.gap.noise.simulated_noise import simulate_noise
from identification.noise import NoiseFloorEstimate

CHANCE_DEVIATIONS = 4.0
"""Standard deviations by which the logarithm of the scatter of blocks hardly differs from that of noise."""
_HELD_OUT_DEVIATIONS = 2.0
"""Standard deviations of the mean square of held-out samples that count as chance."""
_NOISE_DRAWS = 16
"""Number of draws of noise of the residual's spectrum."""


def take_floor_from_residual(
    noise_model: NoiseModel,
    candidates: Collection[Candidate],
    regression: ResidualRegression,
    block_length: float,
    evaluate: Callable[[JointFit], Candidate],
    refit: Callable[[Candidate], Candidate],
    propagate: Callable[[Candidate], Array],
) -> bool:
    """Take the floor from the smallest set of effects whose residual is noise; return False if there is none.

    White noise needs no such estimate: a set that reaches the noise at high frequencies shows it.

    Args:
        noise_model: its floor is replaced.
        candidates: the fitted sets, the law included.
        regression: regression on their residuals on held-out strokes.
        block_length: length of a block [s], part of a stroke.
        evaluate: computes the residual of a fit; a drift that slow noise explains is then a part of it.
        refit: fits a candidate again to all samples, the held-out ones included.
        propagate: computes the squared change of a candidate's force by the noise of its inputs, (runs, N) [N²].
    """
    lowest = regression.find_explainable_rmse(_select_best(candidates), noise_model.floor, certain=True)
    if lowest < EXPLAINED_RATIO * noise_model.floor:
        return False
    fitted = min(c.train_rmse for c in candidates)
    held_out = max(int(np.count_nonzero(regression.evaluation.held_out_samples)), 1)
    adequate = [
        c for c in candidates if _is_adequate(c, fitted, lowest, noise_model.describe_residual(c), held_out)
    ]
    for candidate in sorted(adequate, key=lambda c: (len(c.names), c.held_out_rmse)):
        if not noise_model.may_be_noise(candidate, regression.evaluation):
            continue
        # The form error of an effect may grow with the drive, too, so cycles that show the noise suffice.
        drive = regression.evaluation.drive if noise_model.has_unsteady_cycles else None

        def is_noise(one: Candidate, drive: Array | None = drive) -> bool:
            found = _measure_deviations(noise_model, one, drive, propagate(one), block_length)
            return bool(found) and max(found.values()) < CHANCE_DEVIATIONS

        # A held-out stroke can need coordinates that the fitted ones leave open. That is not an error of the law.
        if is_noise(candidate) or is_noise(refit(candidate)):
            noise_model.estimate = noise_model.describe_residual(candidate)
            noise_model.estimate = noise_model.describe_residual(evaluate(candidate.fit))
            return True
    return False


def _is_adequate(
    candidate: Candidate, fitted: float, lowest: float, noise: NoiseFloorEstimate, held_out: int
) -> bool:
    """Return True if the errors of a candidate are nearly the smallest ones, within chance if they are noise.

    Args:
        candidate: a set of effects.
        fitted: smallest RMSE on fitted samples [N].
        lowest: smallest explainable RMSE on held-out samples [N].
        noise: the noise, if the residual of the candidate is noise.
        held_out: number of held-out samples.
    """
    chance = _HELD_OUT_DEVIATIONS * noise.compute_chance(held_out) * noise.noise**2
    is_near = candidate.held_out_rmse**2 - chance < (EXPLAINED_RATIO * lowest) ** 2
    return is_near and candidate.train_rmse < EXPLAINED_RATIO * fitted


def discard_unsteady_cycles(
    noise_model: NoiseModel,
    law: Candidate,
    evaluation: EvaluationData,
    propagate: Callable[[Candidate], Array],
    block_length: float,
) -> bool:
    """Discard the noise floor of repeated cycles if the residual of the law is not noise; return True if so.

    Cycles count all that does not repeat with them as noise. A cause that follows time, or a path that is no
    multiple of the stroke, is a part of it. Its blocks scatter otherwise than those of noise, or follow the drive.

    Args:
        noise_model: its floor is replaced by the noise at high frequencies.
        law: the law without effects, within the limits of that floor.
        evaluation: the recordings, cut into cycles.
        propagate: computes the squared change of a candidate's force by the noise of its inputs, (runs, N) [N²].
        block_length: length of a block [s], part of a stroke.
    """
    estimate = noise_model.estimate
    white = NO_GAP_RATIO * math.hypot(estimate.high_frequency, noise_model.input_noise or 0.0)
    if not estimate.is_known or max(law.train_rmse, law.held_out_rmse) < white:
        return False
    found = _measure_deviations(noise_model, law, evaluation.drive, propagate(law), block_length)
    reason = max(found, key=lambda name: found[name], default="")
    if found.get(reason, 0.0) < CHANCE_DEVIATIONS:
        return False
    noise_model.has_unsteady_cycles = True
    noise_model.estimate = estimate.discard_cycles(
        f"what does not repeat with the cycles is not noise, because it {reason}"
    )
    return True


def _measure_deviations(
    noise_model: NoiseModel, candidate: Candidate, drive: Array | None, input_squares: Array, block_length: float
) -> dict[str, float]:
    """Return by how many standard deviations a residual differs from noise, by the difference in words.

    It is empty where blocks cannot be compared.
    """
    residual, square = candidate.residual, noise_model.describe_residual(candidate).noise ** 2
    found = {
        "changes in size otherwise than noise": compare_scatter(residual, square, input_squares, block_length)
    }
    if drive is not None:
        by_drive = compare_with_drive(residual, drive, square, input_squares, block_length)
        found["grows or falls with the drive"] = by_drive
    return {name: value for name, value in found.items() if value is not None}


def compare_scatter(residual: Residual, square: float, input_squares: Array, block_length: float) -> float | None:
    """Return by how much the mean square of blocks scatters otherwise than that of noise of the same spectrum.

    The unit is the standard deviation of that scatter. The result is None where blocks cannot be compared.
    An error of a model is strong in some blocks and weak in others. A spectral line has the same size in all. The
    noise of the displacement (runs, N) [N²] is strong where the force is steep, in short bursts whose size differs
    from run to run. Its estimate may be too large, so blocks may also scatter as noise of the force alone.

    Args:
        residual: residual of a model.
        square: mean square of the noise of the force, if the residual is noise [N²].
        input_squares: squared change of the force by the noise of the inputs, (runs, N) [N²].
        block_length: length of a block [s].
    """
    squares = compute_block_squares(residual, block_length)
    if len(squares) < 2 or len({rate for _, rate in residual.rates}) != 1:
        return None
    runs = _collect_block_squares(residual, np.sqrt(input_squares), block_length)
    chance, deviation = simulate_scatter(residual, block_length)
    scaled = squares / (square + runs.mean(axis=0))
    pairs = (compute_scatter(squares), chance), (compute_scatter(scaled), _expect_scatter(square, runs, chance))
    return min(abs(math.log(found / expected)) for found, expected in pairs) / deviation


def compare_with_drive(
    residual: Residual, drive: Array, square: float, input_squares: Array, block_length: float
) -> float | None:
    """Return by how much the mean square of blocks follows the drive, more than that of noise does.

    The unit is the standard deviation of that in noise of the same spectrum. The noise of the displacement follows
    the drive, because it makes the force steep, so blocks may also follow it less than expected of that noise. The
    result is None where blocks or drives cannot be compared.

    Args:
        residual: residual of a model.
        drive: drive of each sample (N,) [V or A].
        square: mean square of the noise of the force, if the residual is noise [N²].
        input_squares: squared change of the force by the noise of the inputs, (runs, N) [N²].
        block_length: length of a block [s].
    """
    squares = compute_block_squares(residual, block_length)
    levels = np.sqrt(compute_block_squares(replace(residual, values=drive), block_length))
    if len(squares) < 2 or len({rate for _, rate in residual.rates}) != 1 or not np.ptp(levels) > 0.0:
        return None
    centred = levels - levels.mean()
    noise = _collect_block_squares(residual, simulate_noise(residual, _NOISE_DRAWS).T, block_length)
    by_chance = noise @ centred / noise.mean(axis=1)
    expected = square + _collect_block_squares(residual, np.sqrt(input_squares), block_length).mean(axis=0)
    found = [float(values @ centred / values.mean()) for values in (squares, squares / expected)]
    return min(map(abs, found)) / math.sqrt(float(np.mean(by_chance**2)))


def simulate_scatter(residual: Residual, block_length: float) -> tuple[float, float]:
    """Return the scatter [1] of blocks of noise with the spectrum of a residual, and its standard deviation.

    The deviation is that of the logarithm, at least that of independent blocks of white noise. In slow noise it is
    larger, because a block has few independent samples, and neighbours are alike.
    """
    noise = _collect_block_squares(residual, simulate_noise(residual, _NOISE_DRAWS).T, block_length)
    logarithms = np.log([compute_scatter(row) for row in noise])
    least = math.sqrt(2.0 / (noise.shape[1] - 1))
    return math.exp(float(logarithms.mean())), max(float(logarithms.std(ddof=1)), least)


def _collect_block_squares(residual: Residual, values: Array, block_length: float) -> Array:
    """Return the mean squares (K, blocks) [N²] of other values (K, N) [N] in the blocks of a residual."""
    return np.stack([compute_block_squares(replace(residual, values=row), block_length) for row in values])


def _expect_scatter(square: float, runs: Array, chance: float) -> float:
    """Return the scatter [1] of blocks of both noises over their expected mean square.

    Args:
        square: mean square of the noise of the force [N²].
        runs: mean square [N²] of the propagated input noise in each block, (runs, blocks).
        chance: variance of the mean square of a block of noise of the force, over its squared mean [1].
    """
    mean = runs.mean(axis=0)
    # The mean of the runs differs from the truth, too, by its own part of the variance.
    between = (1.0 + 1.0 / len(runs)) * runs.var(axis=0, ddof=1)
    variance = chance * square * (square + 2.0 * mean) + between
    return float(np.mean(variance / (square + mean) ** 2))


def compute_scatter(values: Array) -> float:
    """Return the variance of some values over their squared mean [1]."""
    return float(np.var(values, ddof=1) / np.mean(values) ** 2)


def _select_best(candidates: Collection[Candidate]) -> list[Candidate]:
    """Return the law and the set with the smallest error."""
    law = [c for c in candidates if not c.names]
    return [*law, min(candidates, key=lambda c: c.held_out_rmse)]
