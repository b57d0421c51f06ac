"""Cross-check: independent estimate of the named effects by the network.

The network has the named effects as terms of its residual. It shares neither starts nor simulation with the
fit. If both find the same sizes, neither a local minimum nor the integrator has caused them. Which effect is
active cannot be cross-checked; that is decided by the posterior.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from identification.damper import Quantity
from identification.documents import CrossCheck, EffectValue
from identification.fitting import Problem
from identification.gap.fits import JointFit
from identification.gap.outcome.interval import compute_interval
from identification.pinn import describe_incompatibility, train
from identification.pinn.common import PinnResult, TrainingMonitor, read_settings
from identification.pipeline import compare_with_network
from identification.progress import Progress
from identification.uncertainty import MAX_DEVIATION, Agreement

_PRESET = "elements"


def cross_check_effects(
    fit: JointFit, problem: Problem, drive_unit: str, seed: int, progress: Progress
) -> CrossCheck:
    """Estimate a set of effects with the network and compare it with the fit.

    Args:
        fit: fit of the law and the effects.
        problem: the fitted problem with the effects.
        drive_unit: V or A.
        seed: seed of the network's weights.
        progress: receives every step.
    """
    settings = read_settings(_PRESET).model_copy(update={"seed": seed})
    if reason := describe_incompatibility(problem, settings):
        return _skip_cross_check(reason)
    result = train(problem, settings, TrainingMonitor(progress))
    if not result.accepted:
        return _skip_cross_check(f"its training did not converge: {result.note}", result.seconds)
    parameters = list(_compare_parameters(fit, result))
    sizes = {f"{p.effect}.{p.quantity.symbol}": p.distance for p in parameters if np.isfinite(p.distance)}
    law = compare_with_network(result, fit.problem, fit.minimum, fit.covariance)
    agreement = Agreement(law.deviations | sizes)
    if not agreement.deviations:
        return _skip_cross_check("these strokes determine no value for both methods", result.seconds)
    effects: dict[str, dict[str, EffectValue]] = {}
    for p in parameters:
        effects.setdefault(p.effect, {})[p.quantity.symbol] = p.to_document(drive_unit)
    return CrossCheck(
        consistent=agreement.is_consistent,
        effects=effects,
        seconds=result.seconds,
        message=_describe_agreement(agreement),
    )


def _skip_cross_check(reason: str, seconds: float = 0.0) -> CrossCheck:
    message = f"The cross-check by the network was skipped: {reason}."
    return CrossCheck(consistent=None, effects={}, seconds=seconds, message=message)


class _ParameterComparison(NamedTuple):
    """One parameter of an effect, as estimated by the network."""

    effect: str
    quantity: Quantity
    value: float
    deviation: float
    distance: float
    """Distance from the value of the fit, in the larger of both standard deviations [1]."""

    def to_document(self, drive_unit: str) -> EffectValue:
        """Return the estimate with its interval."""
        q = self.quantity
        interval = compute_interval(self.value, self.deviation, q.low, q.high)
        return EffectValue(value=self.value, unit=q.format_unit(drive_unit), ci95=interval)


def _compare_parameters(fit: JointFit, result: PinnResult) -> Iterator[_ParameterComparison]:
    deviations = iter(result.effect_deviations.tolist())
    for effect, model in zip(result.effects, fit.effects, strict=True):
        name = effect.effect.name
        for q, value in zip(model.quantities, effect.values, strict=True):
            deviation = next(deviations)
            larger = max(deviation, fit.deviations[name][q.symbol], 1e-300)
            distance = abs(value - fit.values[name][q.symbol]) / larger
            yield _ParameterComparison(name, q, value, deviation, distance)


def _describe_agreement(agreement: Agreement) -> str:
    deviations, worst = agreement.deviations, agreement.worst_coordinate
    subject = "The network, which has the same effects in its residual and simulates nothing,"
    largest = f"largest difference in {worst}, {deviations[worst]:.2g} standard deviations"
    if agreement.is_consistent:
        return f"{subject} agrees ({largest})."
    others = ", ".join(name for name, value in deviations.items() if value > MAX_DEVIATION)
    return f"{subject} finds other values of {others} ({largest}); neither interval of these is reliable."
