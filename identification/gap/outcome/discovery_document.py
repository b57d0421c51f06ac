"""Document of a discovered effect: its curve with a band, its formula, and its definition as an effect file."""

from collections.abc import Mapping

import numpy as np

from identification.damper.definitions import Curve, EffectFile
from identification.documents import DiscoveredCurve, Discovery, EffectValue, Formula
from identification.gap.data import Shrinkage
from identification.gap.discovery import DiscoveredEffect, FittedCurve, make_curve_file, update_values
from identification.gap.fits import Candidate
from identification.gap.outcome.interval import compute_interval

_CURVE_POINTS = 81
"""Smallest number of points of a curve in a document."""
_POINTS_PER_COEFFICIENT = 4
"""Number of points for each coefficient of a curve with many, between which it is nearly straight."""
_BAND = 1.96
"""Standard deviations of a 95 % band."""
_END_STEP = 1e-6
"""Relative step of the variable at the end of a curve, beyond which a step response is one."""


def build_discovery(found: DiscoveredEffect, named: Candidate, shrinkage: Shrinkage, drive_unit: str) -> Discovery:
    """Return the document of a discovered effect.

    Args:
        found: the effect.
        named: the named set.
        shrinkage: shrinkage of the gap with the discovered effect.
        drive_unit: unit of the drive.
    """
    described = _describe_curve(found.fitted, drive_unit)
    return Discovery(
        **described.model_dump(exclude={"rmse_n"}),
        rmse_n=found.candidate.held_out_rmse,
        replaces=sorted(named.names - found.candidate.names),
        formula=_describe_formula(found, drive_unit),
        definition=define_discovered_effect(found),
        shrinkage=shrinkage.value,
        shrinkage_ci95=shrinkage.ci95,
        further=[_describe_curve(f, drive_unit) for f in found.further],
    )


def define_discovered_effect(found: DiscoveredEffect) -> EffectFile:
    """Return the discovered effect as an effect file: its formula, or else its curve."""
    if found.formula is not None:
        return update_values(found.formula.file, found.candidate.fit.active_effects[-1].values)
    return make_curve_file(found.fitted, "curve", {}, _make_curve(found.fitted, ""))


def _describe_curve(fitted: FittedCurve, drive_unit: str) -> DiscoveredCurve:
    at = fitted.curve.at
    return DiscoveredCurve(
        stage=fitted.curve.model.effect.stage,
        place=at.place,
        variables=list(at.variables),
        curve=_make_curve(fitted, drive_unit),
        rmse_n=fitted.candidate.held_out_rmse,
        log_odds=fitted.log_odds,
    )


def _make_curve(fitted: FittedCurve, drive_unit: str) -> Curve:
    """Return the curve at some points, with its 95 % band."""
    function, basis = fitted.curve.function, fitted.curve.function.basis
    count = basis.size
    points = max(_CURVE_POINTS, _POINTS_PER_COEFFICIENT * count + 1)
    rows = np.linspace(0, len(basis.positions) - 1, points).round().astype(int)
    table = function.scale * np.array(basis.table)[:, rows]
    values = np.array(fitted.values[:count]) @ table
    covariance = fitted.covariance[:count, :count]
    deviation = np.sqrt(np.maximum(np.einsum("kn,kl,ln->n", table, covariance, table), 0.0))
    unit = fitted.curve.unit
    curve = Curve(
        variable=fitted.curve.at.argument,
        unit=unit.format(drive=drive_unit) if drive_unit else unit,
        x=[basis.positions[i] for i in rows],
        value=values.tolist(),
        lo=(values - _BAND * deviation).tolist(),
        hi=(values + _BAND * deviation).tolist(),
    )
    return _make_step_response(curve) if fitted.curve.at.is_response else curve


def _make_step_response(missing: Curve) -> Curve:
    """Return one less a curve, the part of a change that has not arrived; beyond its end nothing is missing."""
    x = [*missing.x, missing.x[-1] * (1.0 + _END_STEP)]
    value, lo, hi = (
        [*(1.0 - v for v in part), 1.0] for part in (missing.value, missing.hi or [], missing.lo or [])
    )
    return missing.model_copy(update={"x": x, "value": value, "lo": lo, "hi": hi})


def _describe_formula(found: DiscoveredEffect, drive_unit: str) -> Formula | None:
    """Return the formula with the intervals of its symbols; null where a curve was kept."""
    if found.formula is None:
        return None
    effect = found.candidate.fit.active_effects[-1]
    deviations: Mapping[str, float] = found.candidate.fit.deviations[effect.effect.name]
    symbols = {
        q.symbol: EffectValue(
            value=value,
            unit=q.format_unit(drive_unit),
            ci95=compute_interval(value, deviations[q.symbol], q.low, q.high),
        )
        for q, value in zip(effect.form.parameters, effect.values, strict=True)
    }
    return Formula(expression=found.formula.file.expression or "", symbols=symbols)
