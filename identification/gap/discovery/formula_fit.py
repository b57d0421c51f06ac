"""Fit of formulas in the place of a curve, together with the law and the named effects."""

import math
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper.definitions import STAGE_OF, Curve, EffectFile, EffectParameter, make_effect
from identification.damper.effects import Variable
from identification.fitting import EffectModel, minimise
from identification.gap.discovery.curve_effects import CurveEffect, CurvePlace, collect_variables
from identification.gap.discovery.curve_fit import FittedCurve, choose_problem, compute_full_correlation_length
from identification.gap.discovery.formulas import FormulaStart, rank_formulas
from identification.gap.fits import Candidate, JointFit, insert_effect_unknowns
from identification.gap.selection import CandidatePool
from identification.progress import ignore_progress
from identification.threads import use_one_thread

DISCOVERED = "discovered_effect"
"""Name of a discovered effect that the user has not named."""
_FITTED_FORMULAS = 6
"""Number of formulas nearest to the curve that are fitted."""
_ITERATIONS = 25
"""Largest number of iterations of a fit."""
_SUFFICIENT_GAIN = 0.8
"""Part of the curve's gain on fitted and on held-out strokes that a formula has to keep [1]."""
_MAX_POINTS = 4000
"""Samples at which a formula is compared with a curve."""
_RANGE = 100.0
"""Largest amplitude, relative to the start or to one of the size of the curve."""
VARIABLE_UNITS: dict[Variable, str] = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "travel_since_reversal": "m",
    "travel_since_rest": "m",
    "force": "N",
    "drive": "{drive}",
    "drive_history": "{drive}",
    "temperature": "K",
    "time": "s",
    "dissipated_energy": "J",
}
"""SI units of the variables."""


@dataclass(frozen=True)
class FittedFormula:
    """A formula fitted with the law and other effects."""

    file: EffectFile
    """Its definition, with the fitted values."""
    candidate: Candidate
    criterion: float
    """Bayesian information criterion, for independent samples."""


def find_formula(pool: CandidatePool, fitted: FittedCurve) -> FittedFormula | None:
    """Return the formula with the lowest information criterion that keeps most of the curve's gain.

    None if no formula does.
    """
    variable = _collect_arguments(pool, fitted)
    count = fitted.curve.function.basis.size
    starts = rank_formulas(fitted.curve, np.array(fitted.values[:count]), variable)
    samples = len(fitted.candidate.residual.values) / compute_full_correlation_length(pool, fitted.candidate)
    formulas = [_fit_formula(pool, fitted, start, variable, samples) for start in starts[:_FITTED_FORMULAS]]
    # A curve that repeats is one of its formulas; over one period, it would describe that period only.
    kept = [f for f in formulas if fitted.curve.at.period or _keeps_gain(fitted, f.candidate)]
    return min(kept, key=lambda f: f.criterion, default=None)


def _collect_arguments(pool: CandidatePool, fitted: FittedCurve) -> Array:
    """Return values (N,) of the variable of a curve, at which a formula is compared with it."""
    if fitted.curve.at.is_response:
        return np.array(fitted.curve.function.basis.positions)
    problem = pool.problems.screening.replace_effects(fitted.parent.fit.effects)
    simulated = problem.simulate(fitted.parent.fit.minimum.unknowns)
    variable = collect_variables(problem.pieces, simulated)[fitted.curve.at.argument]
    return variable[:: max(1, len(variable) // _MAX_POINTS)]


def _keeps_gain(fitted: FittedCurve, candidate: Candidate) -> bool:
    """Return True if a formula keeps most of the gain of its curve, on fitted and on held-out strokes."""
    before, curve, formula = (
        np.array([c.train_rmse, c.held_out_rmse]) ** 2 for c in (fitted.parent, fitted.candidate, candidate)
    )
    return bool(np.all(before - formula > _SUFFICIENT_GAIN * (before - curve)))


def _fit_formula(
    pool: CandidatePool, fitted: FittedCurve, start: FormulaStart, variable: Array, samples: float
) -> FittedFormula:
    """Fit a formula from its start; ``samples`` is the number of independent samples."""
    file = _make_file(fitted, start, variable)
    model = EffectModel(make_effect(file), "defined")
    parent = fitted.candidate.fit
    others = parent.effects[:-1]
    law_alone = choose_problem(pool, fitted.curve.at)
    problem = law_alone.replace_effects((*others, model))
    columns = parent.problem.layout.effect_slices[-1]
    law = np.delete(parent.minimum.unknowns, columns)
    unknowns = insert_effect_unknowns(law_alone.replace_effects(others), law, model.to_search(model.starts[0]))
    with use_one_thread():
        fit = JointFit(problem, minimise(problem, unknowns, _ITERATIONS, ignore_progress))
    criterion = samples * math.log(fit.rmse**2) + len(file.parameters) * math.log(max(samples, 2.0))
    return FittedFormula(update_values(file, fit.active_effects[-1].values), pool.evaluate(fit), criterion)


def update_values(file: EffectFile, values: tuple[float, ...]) -> EffectFile:
    """Return an effect file with other values of its parameters."""
    pairs = zip(file.parameters.items(), values, strict=True)
    return file.model_copy(
        update={"parameters": {name: p.model_copy(update={"value": v}) for (name, p), v in pairs}}
    )


def _make_file(fitted: FittedCurve, start: FormulaStart, variable: Array) -> EffectFile:
    """Return the definition of a formula at its start."""
    curve, at = fitted.curve, fitted.curve.at
    parameters = {
        name: _make_parameter(curve, start, name, value, variable) for name, value in sorted(start.values.items())
    }
    expression = start.formula.write(at.argument)
    # The curve is one less the step response.
    expression = f"1-({expression})" if at.is_response else expression
    return make_curve_file(fitted, expression, parameters)


def make_curve_file(
    fitted: FittedCurve, expression: str, parameters: dict[str, EffectParameter], curve: Curve | None = None
) -> EffectFile:
    """Return the definition of an expression of the curve's variable, with the factors of its place."""
    at = fitted.curve.at
    growth: dict[str, EffectParameter] = {}
    if at.grows_with_drive:
        quantity = fitted.curve.model.quantities[-1]
        value = float(np.clip(fitted.values[-1], quantity.low, quantity.high))
        growth = {"growth": EffectParameter(value=value, unit="1/{drive}", lo=quantity.low, hi=quantity.high)}
    return EffectFile(
        name=DISCOVERED,
        stage=STAGE_OF[at.place],
        place=at.place,
        kind=at.kind,
        variables=list(at.variables),
        expression=_write_factors(at, expression),
        parameters=parameters | growth,
        curve=curve,
        source="found by a diagnosis",
    )


def _write_factors(at: CurvePlace, expression: str) -> str:
    """Return an expression times the factors of its place: direction, drive and growth with the drive."""
    match at.direction:
        case "sign":
            expression = f"sign(velocity)*({expression})"
        case "velocity":
            expression = f"velocity*({expression})"
    if at.has_drive_factor:
        expression = f"drive*({expression})"
    return f"(1+growth*drive)*({expression})" if at.grows_with_drive else expression


def _make_parameter(
    curve: CurveEffect, start: FormulaStart, name: str, value: float, variable: Array
) -> EffectParameter:
    """Return a parameter with its unit and the range of its search."""
    unit, size = VARIABLE_UNITS[curve.at.argument], max(float(np.abs(variable).max()), 1e-300)
    match start.formula.others.get(name):
        case "scale" | "wave":
            return EffectParameter(value=value, unit=unit, lo=min(1e-4 * size, 0.5 * value), hi=1e2 * size)
        case "size":
            return EffectParameter(value=value, unit=unit, lo=value, hi=value)
        case "power":
            return EffectParameter(value=value, unit="1", lo=0.1, hi=6.0)
        case "position":
            return EffectParameter(value=value, unit=unit, lo=float(variable.min()), hi=float(variable.max()))
    power = start.formula.amplitudes[name]
    largest = _RANGE * max(abs(value), curve.function.scale / size**power)
    unit = _divide_unit(curve.unit, unit, power)
    return EffectParameter(value=value, unit=unit, lo=-largest, hi=largest)


def _divide_unit(unit: str, divisor: str, power: int) -> str:
    """Return a unit divided by a power of another."""
    if not power:
        return unit
    if divisor == unit:
        unit, power = "1", power - 1
    if not power:
        return unit
    divisor = f"({divisor})" if "/" in divisor else divisor
    return f"{unit}/{divisor}" + (f"^{power}" if power > 1 else "")
