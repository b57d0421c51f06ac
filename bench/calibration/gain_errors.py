"""Intervals of a fit with the calibration of its channels: errors of gains, which no fit can see.

The law is homogeneous in its units. A recording with gains g of force, displacement and drive is therefore exactly
the law with every parameter multiplied by the gains of the units that it has::

    parameter [N^a m^b drive^c]  ->  g_force^a  g_displacement^b  g_drive^c  parameter

    alpha_a, c0_a, c1_a, k0, k1:  force / displacement        x0, D_y:      displacement
    alpha_b, c0_b, c1_b:          the same / drive            beta, gamma:  displacement^-n
    F_a, f0: force     F_b: force / drive                     A, n, eta, rho:  none

To first order, independent gains with relative standard uncertainties u give the relative standard uncertainty
sqrt((a u_force)^2 + (b u_displacement)^2 + (c u_drive)^2) (JCGM 100:2008, 5.1.6). It is combined in quadrature
with that of the fit (5.1.2). A known error of a gain is not corrected here, and offsets are not gains.
"""

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

from bench.calibration.log_record import read_entry

GAIN_CHANNELS = {"force": "force", "displacement": "displacement", "drive": "coil_drive"}
"""Recorded channel of each gain."""
_GAINS = {"N": "force", "m": "displacement", "V": "drive", "A": "drive"}
_OTHERS = ("s", "1")
"""Units without a gain: time is measured by a clock."""
GAIN_FORMULA = (
    "The standard uncertainties of fit and calibration are combined in quadrature (JCGM 100:2008, 5.1.2). "
    "That of the calibration is the value times √((a·u_force)² + (b·u_displacement)² + (c·u_drive)²). "
    "a, b and c are the powers of N, m and the drive's unit in the unit of the parameter. "
    "u is the relative standard uncertainty of a gain."
)
"""Combination of both uncertainties, for a person."""
COVERAGE = 1.96
"""Half-width of a 95 % interval over the standard uncertainty, for a normal distribution."""
_TOKEN = re.compile(r"([A-Za-z]+|1)(?:\^(n|\d+))?")


class CombinedInterval(NamedTuple):
    """Interval of one parameter with the calibration."""

    ci95: tuple[float, float] | None
    """None if the fit has no interval, or a channel has no certificate."""
    calibration: float | None
    """Relative standard uncertainty from the gains [1]; None if a channel has no certificate."""
    missing: tuple[str, ...]
    """Gains that matter and have no certificate."""


def find_exponents(unit: str, n: float) -> dict[str, float] | None:
    """Return the exponent of each gain in a quantity; None for a unit that is not known.

    Args:
        unit: unit as a fit writes it, such as `N s/(m V)` or `1/m^n`.
        n: sharpness of the yield, the exponent in `1/m^n`.
    """
    exponents: dict[str, float] = {}
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1.0), (below, -1.0)):
        for token in part.strip("() ").split():
            match = _TOKEN.fullmatch(token)
            if match is None or match[1] not in (*_GAINS, *_OTHERS):
                return None
            if match[1] in _GAINS:
                gain, power = _GAINS[match[1]], n if match[2] == "n" else float(match[2] or 1)
                exponents[gain] = exponents.get(gain, 0.0) + sign * power
    return exponents


def read_gain_uncertainties(record: Mapping[str, str]) -> dict[str, float]:
    """Return the relative standard uncertainty [1] of each gain with a certificate.

    Args:
        record: metadata record `calibration` of a log.
    """
    entries = {gain: read_entry(record.get(channel, "")) for gain, channel in GAIN_CHANNELS.items()}
    name = "gain_standard_uncertainty"
    return {
        gain: float(entry[name]) for gain, entry in entries.items() if isinstance(entry.get(name), float | int)
    }


def combine_interval(
    value: float,
    ci95: tuple[float, float] | None,
    exponents: Mapping[str, float],
    uncertainties: Mapping[str, float],
) -> CombinedInterval:
    """Combine the interval of a fit with the uncertainties of the gains, each side by itself.

    Args:
        value: estimate.
        ci95: 95 % interval of the fit; None without one.
        exponents: exponent of each gain in the quantity.
        uncertainties: relative standard uncertainty [1] by gain; gains without a certificate are left out.
    """
    missing = tuple(gain for gain, power in exponents.items() if power and gain not in uncertainties)
    if missing:
        return CombinedInterval(None, None, missing)
    relative = math.hypot(*(power * uncertainties[gain] for gain, power in exponents.items() if power))
    if ci95 is None:
        return CombinedInterval(None, relative, ())
    added = COVERAGE * abs(value) * relative
    low, high = (math.hypot(value - bound, added) for bound in ci95)
    return CombinedInterval((value - low, value + high), relative, ())


def combine_estimates(
    estimates: Mapping[str, Mapping[str, Any]], n: float, record: Mapping[str, str]
) -> dict[str, CombinedInterval]:
    """Return the interval with the calibration for each estimate whose unit is known.

    Args:
        estimates: parameters or coordinates of a fit document, by name.
        n: sharpness of the yield in that fit.
        record: metadata record `calibration` of the only log of the fit.
    """
    uncertainties, combined = read_gain_uncertainties(record), {}
    for name, estimate in estimates.items():
        exponents = find_exponents(estimate["unit"], n)
        if exponents is not None:
            combined[name] = combine_interval(estimate["value"], estimate["ci95"], exponents, uncertainties)
    return combined
