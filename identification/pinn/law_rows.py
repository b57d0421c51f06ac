"""Residuals of the law at single points in time, with their slopes over everything that stands in them.

The residuals come from ``identification.damper.law``; the slopes are written out here, because differentiating by
machine costs more than the rest of a training step, and are held to the residuals by tests. Only arithmetic is
used, so numpy arrays and torch tensors both pass; the one function beyond it, the logarithm, is handed in.
"""

from collections.abc import Callable, Mapping

from identification.damper import law
from identification.damper.law import Number

Values = Mapping[str, Number]
"""States and inputs at some points, and coordinates, by name."""


def hysteresis(p: Values) -> Number:
    """Violation [m/s] of eq. 3, times the yield displacement; ``z`` is over its saturation."""
    D_y, rho = p["D_y"], p["rho"]
    rate = law.hysteresis_rate(p["v"] - p["y_rate"], p["z"], 1.0 / D_y, rho / D_y, (1.0 - rho) / D_y, p["n"])
    return D_y * (p["z_rate"] - rate)


def hysteresis_slopes(p: Values, log: Callable[[Number], Number]) -> dict[str, Number]:
    """Slopes of the violation of eq. 3; at the kinks those of the positive side."""
    slip, z, rho = p["v"] - p["y_rate"], p["z"], p["rho"]
    size, speed = abs(z), abs(slip)
    slip_sign, z_sign = 2.0 * (slip >= 0) - 1.0, 2.0 * (z >= 0) - 1.0
    power = (size + law.Z_GUARD) ** (p["n"] - 1.0)
    bend = (1.0 - rho) * speed * z + rho * slip * size
    return {
        "z": p["n"] * power * ((1.0 - rho) * speed + rho * slip * z_sign),
        "z_rate": p["D_y"] + 0.0 * z,
        "y_rate": 1.0 - power * ((1.0 - rho) * slip_sign * z + rho * size),
        "D_y": p["z_rate"],
        "rho": power * (slip * size - speed * z),
        "n": bend * power * log(size + law.Z_GUARD),
    }


def balance(p: Values) -> Number:
    """Violation [N] of eq. 4, times c0 + c1."""
    F, c0, c1 = (law.at_field(p[f"{name}_a"], p[f"{name}_b"], p["u"]) for name in ("F", "c0", "c1"))
    return (c0 + c1) * (p["y_rate"] - law.inner_velocity(p["x"], p["v"], p["y"], p["z"], F, c0, c1, p["k0"]))


def balance_slopes(p: Values) -> dict[str, Number]:
    """Slopes of the violation of eq. 4."""
    z, u, rate, slip = p["z"], p["u"], p["y_rate"], p["v"] - p["y_rate"]
    return {
        "z": -law.at_field(p["F_a"], p["F_b"], u),
        "y": p["k0"] + 0.0 * z,
        "y_rate": law.at_field(p["c0_a"] + p["c1_a"], p["c0_b"] + p["c1_b"], u),
        "u": p["c1_b"] * rate - p["c0_b"] * slip - p["F_b"] * z,
        "F_a": -z,
        "F_b": -u * z,
        "c0_a": -slip,
        "c0_b": -u * slip,
        "c1_a": rate,
        "c1_b": u * rate,
        "k0": p["y"] - p["x"],
    }


def force(p: Values) -> Number:
    """Force [N] of eq. 2."""
    return law.force(p["y_rate"], p["x"], law.at_field(p["c1_a"], p["c1_b"], p["u"]), p["k1"], 0.0) - p["f0"]


def force_slopes(p: Values) -> dict[str, Number]:
    """Slopes of the force."""
    rate, u = p["y_rate"], p["u"]
    return {
        "y_rate": law.at_field(p["c1_a"], p["c1_b"], u),
        "x": p["k1"] + 0.0 * rate,
        "u": p["c1_b"] * rate,
        "c1_a": rate,
        "c1_b": u * rate,
        "k1": p["x"],
        "f0": 0.0 * rate - 1.0,
    }
