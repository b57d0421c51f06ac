"""Values with intervals and notes, as documents hold them, from a fit and its covariance."""

from collections.abc import Callable

import numpy as np

from identification.arrays import Array
from identification.damper import COORDINATES, GAUGE, PARAMETERS, Coordinates, Parameters, Quantity, to_parameters
from identification.documents import Delay, Estimate
from identification.fitting import DELAY_LIMIT, PerLogParameter
from identification.uncertainty.interval import Z95, Z99, clip_interval, make_interval

_IDENTIFIABLE = 0.5
"""Threshold on the relative standard deviation [1]: below it, a quantity counts as identifiable."""
_DRIVE_DEPENDENT = ("F_b", "c0_b", "c1_b", "eta", "alpha_b")
"""Quantities that only a changing drive makes observable."""
_SOURCE_COORDINATES = {
    "alpha_a": ("F_a",),
    "alpha_b": ("F_b",),
    "beta": ("rho", "n", "D_y"),
    "gamma": ("rho", "n", "D_y"),
    "x0": ("k1",),
}
"""Coordinates that a parameter depends on; all other parameters depend on the coordinate of their name."""
GAUGE_NOTE = (
    "a gauge, fixed: (alpha_a, alpha_b, beta, gamma, A) -> (s alpha_a, s alpha_b, s^(n-1) beta, "
    "s^(n-1) gamma, A/s) leaves every force unchanged, so no recording determines it"
)
"""Direction on which no force depends."""


def make_coordinate_estimates(
    point: Coordinates, covariance: Array, unobservable: set[str], at_bound: set[str], drive_unit: str
) -> dict[str, Estimate]:
    """Return each coordinate with its intervals, from the covariance (13, 13) of the coordinates."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return {
        quantity.symbol: _make_estimate(
            quantity, value, deviation, quantity.symbol in unobservable, quantity.symbol in at_bound, drive_unit
        )
        for quantity, value, deviation in zip(COORDINATES, point, sd, strict=True)
    }


def make_parameter_estimates(
    point: Coordinates, covariance: Array, coordinates: dict[str, Estimate], drive_unit: str
) -> dict[str, Estimate]:
    """Return the paper's fourteen parameters at the gauge A = 301, with intervals derived from the coordinates.

    Args:
        point: the coordinates.
        covariance: (13, 13) of the coordinates.
        coordinates: their estimates.
        drive_unit: V or A.
    """
    parameters = to_parameters(point)
    D = _differentiate_parameters(lambda c: to_parameters(Coordinates(*c)), point)
    sd = np.sqrt(np.maximum(np.diag(D @ covariance @ D.T), 0.0))
    estimates = {}
    for i, quantity in enumerate(PARAMETERS):
        symbol, value = quantity.symbol, parameters[i]
        if symbol == "A":
            estimates[symbol] = _make_gauge_estimate()
            continue
        sources = _SOURCE_COORDINATES.get(symbol, (symbol,))
        unidentifiable = [name for name in sources if not coordinates[name].identifiable]
        unknown = any(coordinates[name].ci95 is None for name in unidentifiable)
        estimate = _make_estimate(quantity, value, float(sd[i]), unknown, False, drive_unit)
        if unidentifiable:
            notes = "; ".join(coordinates[name].note for name in unidentifiable)
            estimate = estimate.model_copy(update={"identifiable": False, "note": notes})
        estimates[symbol] = estimate
    return estimates


def make_delay_estimate(value: float, sd: float, prior: float, *, observable: bool) -> Delay:
    """Return a channel's residual delay [s]; without an interval where only the prior [s] limits it."""
    return Delay(
        value=value,
        ci95=make_interval(value, sd, Z95, positive=False) if observable else None,
        prior_sd=prior,
        outside_prior=abs(value) >= (1.0 - 1e-9) * DELAY_LIMIT * prior,
        note="" if observable else "not observable: no change in these strokes depends on this delay",
    )


def make_per_log_estimate(parameter: PerLogParameter, unknown: float, sd: float) -> Estimate:
    """Return a per-log parameter, from its unknown of the search and the unknown's standard deviation."""
    value, deviation = parameter.value(unknown, sd)
    return Estimate(
        value=value,
        unit=parameter.unit,
        ci95=make_interval(value, deviation, Z95, positive=False),
        ci99=make_interval(value, deviation, Z99, positive=False),
        identifiable=sd < _IDENTIFIABLE,
        note=parameter.meaning,
    )


def _make_gauge_estimate() -> Estimate:
    return Estimate(value=GAUGE, unit="1", ci95=None, identifiable=False, note=GAUGE_NOTE)


def _make_estimate(
    quantity: Quantity, value: float, sd: float, unobservable: bool, at_bound: bool, drive_unit: str
) -> Estimate:
    """Return a quantity with its intervals and a note."""
    unit = quantity.format_unit(drive_unit)
    if reason := _explain_missing_interval(quantity, sd, unobservable, at_bound):
        note = f"{quantity.meaning}: {reason}"
        return Estimate(value=value, unit=unit, ci95=None, identifiable=False, note=note)
    # A value near zero, such as a slope over the drive, is judged by the usual size of its quantity.
    relative = sd / max(abs(value), 0.1 * quantity.scale)
    identifiable = bool(relative < _IDENTIFIABLE)
    note = _describe_precision(quantity, relative)
    positive = quantity.low >= 0 and value > 0
    ci95, ci99 = (
        clip_interval(make_interval(value, sd, z, positive=positive), value, quantity.low, quantity.high)
        for z in (Z95, Z99)
    )
    return Estimate(value=value, unit=unit, ci95=ci95, ci99=ci99, identifiable=identifiable, note=note)


def _describe_precision(quantity: Quantity, relative: float) -> str:
    if relative < _IDENTIFIABLE:
        return f"known to {100 * relative:.2g} %"
    return f"{quantity.meaning}: these strokes determine it to {100 * relative:.0f} % at best"


def _explain_missing_interval(quantity: Quantity, sd: float, unobservable: bool, at_bound: bool) -> str:
    """Return the reason why a quantity has no interval; empty if it has one."""
    if unobservable and quantity.symbol in _DRIVE_DEPENDENT:
        return "not observable, because the drive never changes in these strokes"
    if unobservable:
        return "not observable, because nothing in these strokes depends on it"
    if not np.isfinite(sd):
        return "standard deviation unknown, because the fit has no covariance for it"
    if at_bound:
        return "at a bound of its range, so the law cannot follow these strokes there"
    return ""


def _differentiate_parameters(function: Callable[[Array], Parameters], point: Coordinates) -> Array:
    """Return the derivatives (14, 13) by central differences; the functions are smooth and exact to rounding."""
    centre = np.array(point)
    columns = []
    for i, quantity in enumerate(COORDINATES):
        move = np.zeros(len(centre))
        move[i] = 1e-6 * max(abs(centre[i]), 1e-3 * quantity.scale)
        after, before = np.array(function(centre + move)), np.array(function(centre - move))
        columns.append((after - before) / (2 * move[i]))
    return np.column_stack(columns)
