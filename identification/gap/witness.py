"""A second witness of what a diagnosis names: the network, with the named effects as terms of its residual.

It shares neither start nor simulation with the fit that named them: where both find the same size of an effect, no
local minimum and no step of an integrator has made it. It cannot say which effect it is; that is for the odds.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from identification.agreement import AGREE, Agreement
from identification.damper.parameters import Quantity
from identification.gap.documents import EffectValue, Witness
from identification.gap.explain import JointFit
from identification.gap.verdict import interval
from identification.pinn.result import PinnResult
from identification.pinn.settings import read_settings
from identification.pinn.supervision import Supervision
from identification.pinn.train import train, why_not
from identification.problem import Problem
from identification.witness import agreement_with

Progress = Callable[[str, float], None]


def hear(fit: JointFit, problem: Problem, drive_unit: str, seed: int, progress: Progress) -> Witness:
    """What the network says of a set of effects.

    Args:
        fit: of the law and the set.
        problem: what it was fitted to, with the set.
        drive_unit: V or A.
        seed: of the network's weights.
        progress: told of every step.
    """
    settings = read_settings("local").model_copy(update={"seed": seed})
    if why := why_not(problem, settings):
        return _silent(why)
    found = train(problem, settings, Supervision(progress))
    if not found.accepted:
        return _silent(f"it did not arrive: {found.note}", found.seconds)
    parameters = list(_parameters(fit, found))
    sizes = {f"{p.effect}.{p.quantity.symbol}": p.apart for p in parameters if np.isfinite(p.apart)}
    law = agreement_with(found, fit.problem, fit.minimum, fit.covariance)
    together = Agreement(law.deviations | sizes)
    if not together.deviations:
        return _silent("these strokes fix no value that both could know", found.seconds)
    effects: dict[str, dict[str, EffectValue]] = {}
    for p in parameters:
        effects.setdefault(p.effect, {})[p.quantity.symbol] = p.document(drive_unit)
    return Witness(agrees=together.agrees, effects=effects, seconds=found.seconds, said=_said(together))


def _silent(why: str, seconds: float = 0.0) -> Witness:
    return Witness(agrees=None, effects={}, seconds=seconds, said=f"The network was not heard: {why}.")


class _Parameter(NamedTuple):
    """One parameter of an effect, as the network found it."""

    effect: str
    quantity: Quantity
    value: float
    deviation: float
    apart: float
    """[1] from the fit's value, in the larger of both deviations."""

    def document(self, drive_unit: str) -> EffectValue:
        q = self.quantity
        bounds = interval(self.value, self.deviation, q.low, q.high)
        return EffectValue(value=self.value, unit=q.unit_for(drive_unit), ci95=bounds)


def _parameters(fit: JointFit, found: PinnResult) -> Iterator[_Parameter]:
    deviations = iter(found.effect_deviations.tolist())
    for own in found.effects:
        name = own.effect.name
        for q, value in zip(own.form.parameters, own.values, strict=True):
            deviation = next(deviations)
            spread = max(deviation, fit.deviations[name][q.symbol], 1e-300)
            yield _Parameter(name, q, value, deviation, abs(value - fit.values[name][q.symbol]) / spread)


def _said(together: Agreement) -> str:
    apart, worst = together.deviations, together.worst
    who = "A network with the same effects in its residual, which simulates nothing,"
    words = f"most in {worst}, by {apart[worst]:.2g} deviations"
    if together.agrees:
        return f"{who} agrees; they differ {words}."
    beyond = ", ".join(name for name, value in apart.items() if value > AGREE)
    return f"{who} finds other values of {beyond} ({words}): trust neither interval there."
