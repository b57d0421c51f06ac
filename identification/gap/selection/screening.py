"""Screening: linearised estimate of the gain of every effect, without fitting it.

Each form is added to the baseline at several starts. An effect starts at zero size with several lengths, speeds or
times, or at a small size where a zero size has no sensitivity. One Gauss-Newton step moves the law's coordinates
and the effect together, inside their bounds. A gain that the coordinates alone could achieve thus does not count.
The sensitivities over the law are those of the baseline. Those over an effect are differences of two simulations.
Exact sensitivities, and a step with a line search, are used only for the effects with the largest predicted gains.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from identification.arrays import Array
from identification.damper import LIBRARY_SIZE, DamperSize
from identification.damper.effects import COMMON_EFFECTS, EFFECTS, Effect
from identification.fitting import EffectModel, Evaluation, Problem
from identification.gap.fits import JointFit, insert_effect_unknowns, predict_joint_step, take_joint_step
from identification.gap.noise import MAINS_FREQUENCY
from identification.threads import use_one_thread

DECIMATION = 4
"""Usual decimation of a screening."""
MOUNTING_EFFECTS = ("clevis_backlash", "fixture_compliance")
"""Effects whose gain is not linear in their size, so that only a fit can estimate it."""
_STEPPED_FORMS = 10
"""Number of forms for which the step is taken with a line search."""
_MIN_EXPECTED_GAIN = 0.02
"""Smallest expected gain of an effect on a shortlist, relative to the excess."""
_TIED_FORM_SHARE = 0.7
"""Smallest expected gain of a further form on a shortlist, relative to the best form of the same effect."""
_SIZE_STEP = 0.05
"""Step of a difference over a size, in its usual unit."""
_LENGTH_STEP = 0.03
"""Step of a difference over the logarithm of a length, speed or time."""


@dataclass(frozen=True)
class ScreeningResult:
    """Gain of one form of an effect."""

    effect_model: EffectModel
    predicted_gain: float
    """Part of the baseline's excess that the linear step predicts to remove [1]; at most one."""
    achieved_gain: float
    """Part of it that the step removes after a line search [1]; the predicted gain where it was not taken."""
    unknowns: Array
    """(U,) unknowns of the joint problem at the end of the step, from which a fit can start."""


def list_effect_models(
    names: Sequence[str] = COMMON_EFFECTS,
    size: DamperSize = LIBRARY_SIZE,
    library: Mapping[str, Effect] = MappingProxyType(EFFECTS),
) -> tuple[EffectModel, ...]:
    """Return every form of some effects of a library, for a damper of a size."""
    return tuple(EffectModel(library[name], form.name, size) for name in names for form in library[name].forms)


def screen(
    problem: Problem,
    baseline: JointFit,
    models: Sequence[EffectModel] = (),
    decimation: int = DECIMATION,
    mains_frequency: float = MAINS_FREQUENCY,
) -> list[ScreeningResult]:
    """Estimate the gain of effects in addition to a baseline fit, and return the largest first.

    Args:
        problem: pieces, noise and priors.
        baseline: the present fit, with or without effects.
        models: forms to screen; all forms of the common effects if empty.
        decimation: use every n-th sample.
        mains_frequency: frequency of mains interference [Hz].
    """
    quick = problem.replace_effects(baseline.effects).decimate(decimation)
    with use_one_thread():
        # The baseline was fitted on more samples. Its own step on these must not count as gain of an effect.
        start, _, _ = take_joint_step(quick, baseline.minimum.unknowns)
        linearisation = _Linearisation.make(quick, start.unknowns, mains_frequency)
        listed = models or list_effect_models(size=problem.space.scales.damper_size)
        predicted = sorted(
            (linearisation.predict_gains(model) for model in listed), key=lambda starts: -starts[0].predicted_gain
        )
        stepped = [linearisation.take_step(starts) for starts in predicted[:_STEPPED_FORMS]]
        others = [starts[0] for starts in predicted[_STEPPED_FORMS:]]
    return sorted([*stepped, *others], key=lambda g: -compute_expected_gain(g))


def select_shortlist(gains: Sequence[ScreeningResult], count: int) -> list[ScreeningResult]:
    """Return the effects with the largest expected gains, in their best form and in nearly equal ones."""
    forms: dict[str, list[ScreeningResult]] = {}
    for gain in gains:
        forms.setdefault(gain.effect_model.name, []).append(gain)
    largest = {name: compute_expected_gain(results[0]) for name, results in forms.items()}
    ranked = sorted(forms, key=lambda name: -largest[name])
    chosen = [name for name in ranked[:count] if largest[name] > _MIN_EXPECTED_GAIN]
    return [
        gain
        for name in chosen
        for gain in forms[name]
        if gain is forms[name][0] or compute_expected_gain(gain) > _TIED_FORM_SHARE * largest[name]
    ]


def select_best_forms(gains: Sequence[ScreeningResult]) -> list[ScreeningResult]:
    """Return each effect in its best form, in the order of the gains."""
    best: dict[str, ScreeningResult] = {}
    for gain in gains:
        best.setdefault(gain.effect_model.name, gain)
    return list(best.values())


def compute_expected_gain(gain: ScreeningResult) -> float:
    """Return the larger of predicted and achieved gain [1]."""
    return max(gain.predicted_gain, gain.achieved_gain)


@dataclass(frozen=True)
class _Linearisation:
    """Baseline with its sensitivities, to which each effect is added."""

    problem: Problem
    unknowns: Array
    """(U,) unknowns at which the baseline is linearised."""
    evaluation: Evaluation
    residuals: tuple[Array, ...]
    """(N,) for each piece, relative to the noise."""
    sensitivities: tuple[Array, ...]
    """(N, C) for each piece over its columns."""
    mains_frequency: float
    """Frequency of mains interference [Hz]."""

    @staticmethod
    def make(problem: Problem, unknowns: Array, mains_frequency: float) -> "_Linearisation":
        """Linearise a problem at a point."""
        residuals, sensitivities = zip(
            *(problem.compute_residuals(unknowns, i) for i in range(len(problem.pieces))), strict=True
        )
        evaluation = problem.evaluate(unknowns)
        return _Linearisation(problem, unknowns, evaluation, residuals, sensitivities, mains_frequency)

    @property
    def excess(self) -> float:
        """Cost of the baseline beyond the noise [1]."""
        return max(self.evaluation.cost - self.problem.samples, 1.0)

    def predict_gains(self, model: EffectModel) -> list[ScreeningResult]:
        """Return the predicted gain from each start of a form, the largest first."""
        gains = (self._predict_gain(model, values) for values in self._list_starts(model))
        return sorted(gains, key=lambda g: -g.predicted_gain)

    def take_step(self, starts: Sequence[ScreeningResult]) -> ScreeningResult:
        """Take the step from the starts of a form in turn, until one reduces the error; return the best.

        From a start that is far from the recording, the linear step may predict much and reduce nothing.
        """
        results = []
        for start in starts:
            results.append(self._take_step(start))
            if results[-1].achieved_gain > 0.0:
                break
        return max(results, key=compute_expected_gain)

    def _take_step(self, predicted: ScreeningResult) -> ScreeningResult:
        """Take the step from one start, with exact sensitivities and a line search."""
        joint = self.problem.replace_effects((*self.problem.effects, predicted.effect_model))
        point, _, cost = take_joint_step(joint, predicted.unknowns)
        gain = min((self.evaluation.cost - cost) / self.excess, 1.0)
        achieved = (self.evaluation.cost - point.cost) / self.excess
        return ScreeningResult(predicted.effect_model, gain, achieved, point.unknowns)

    def _list_starts(self, model: EffectModel) -> Sequence[tuple[float, ...]]:
        """Return the starts of a form; mains interference starts at one frequency only."""
        if model.name != "mains_hum":
            return model.starts
        # The spectrum of the residual shows the frequency directly.
        return [(*model.starts[0][:-1], self.mains_frequency)]

    def _predict_gain(self, model: EffectModel, values: tuple[float, ...]) -> ScreeningResult:
        """Predict the gain of the linear step from a start."""
        joint = self.problem.replace_effects((*self.problem.effects, model))
        start = insert_effect_unknowns(self.problem, self.unknowns, model.to_search(values))
        cost = predict_joint_step(joint, self._evaluate_joint(joint, start, model, values), start)[1]
        gain = min((self.evaluation.cost - cost) / self.excess, 1.0)
        return ScreeningResult(model, gain, gain, start)

    def _evaluate_joint(
        self, joint: Problem, start: Array, model: EffectModel, values: tuple[float, ...]
    ) -> Evaluation:
        """Compute cost, J'J and J'r of the joint problem at a start, with differences over the effect."""
        first = self.problem.layout.per_log.start
        effect = np.arange(first, first + len(model.quantities))
        others = np.setdiff1d(np.arange(len(start)), effect)
        origin, derivatives = self._differentiate_effect(joint, start, model, values)
        hessian, gradient = np.zeros((len(start), len(start))), np.zeros(len(start))
        hessian[np.ix_(others, others)], gradient[others] = self.evaluation.hessian, self.evaluation.gradient
        cost = self.evaluation.cost
        for i, (r, J) in enumerate(zip(self.residuals, self.sensitivities, strict=True)):
            columns, here, E = others[self.problem.find_columns(i)], origin[i], derivatives[i]
            cross = J.T @ E
            hessian[np.ix_(columns, effect)] += cross
            hessian[np.ix_(effect, columns)] += cross.T
            hessian[np.ix_(effect, effect)] += E.T @ E
            gradient[columns] += J.T @ (here - r)
            gradient[effect] += E.T @ here
            cost += float(here @ here - r @ r)
        return Evaluation(cost if np.isfinite(cost) else np.inf, hessian, gradient)

    def _differentiate_effect(
        self, joint: Problem, start: Array, model: EffectModel, values: tuple[float, ...]
    ) -> tuple[tuple[Array, ...], list[Array]]:
        """Return the residuals (N,) of each piece at a start, and their differences (N, P) over the effect."""
        first = self.problem.layout.per_log.start
        absent = not any(v for v, q in zip(values, model.quantities, strict=True) if q.low <= 0.0)
        origin = self.residuals if absent else self._compute_weighted_residuals(joint, start)
        steps = [_make_difference_step(joint, start, first + k, absent) for k in range(len(model.quantities))]
        moved = [self._compute_weighted_residuals(joint, start + s) if s.any() else origin for s in steps]
        derivatives = [
            np.column_stack([(m[i] - here) / max(s.sum(), 1e-12) for m, s in zip(moved, steps, strict=True)])
            for i, here in enumerate(origin)
        ]
        return origin, derivatives

    def _compute_weighted_residuals(self, joint: Problem, unknowns: Array) -> tuple[Array, ...]:
        """Compute the residuals of each piece relative to the noise, (N,) each."""
        forces = joint.simulate(unknowns)
        return tuple(
            p.train / joint.noise * (force - p.force) for p, force in zip(joint.pieces, forces, strict=True)
        )


def _make_difference_step(joint: Problem, start: Array, column: int, absent: bool) -> Array:
    """Return the step (U,) of a difference over one parameter; zero over a length of an absent effect."""
    step = np.zeros(len(start))
    logarithmic = np.concatenate([e.log_mask for e in joint.effects])[column - joint.layout.effects.start]
    if logarithmic and absent:
        return step
    size = _LENGTH_STEP if logarithmic else _SIZE_STEP
    step[column] = size if start[column] + size <= joint.get_bounds()[1][column] else -size
    return step
