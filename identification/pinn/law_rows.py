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
    F, c0, c1 = (_at_field(p, name) for name in ("F", "c0", "c1"))
    return (c0 + c1) * (p["y_rate"] - law.inner_velocity(p["x"], p["v"], p["y"], p["z"], F, c0, c1, p["k0"]))


def balance_slopes(p: Values) -> dict[str, Number]:
    """Slopes of the violation of eq. 4."""
    u, rate = p["u"], p["y_rate"]
    z, slip, inner = _scaled(p, "F", p["z"]), _scaled(p, "c0", p["v"] - rate), _scaled(p, "c1", rate)
    return {
        "z": -_at_field(p, "F"),
        "y": p["k0"] + 0.0 * z,
        "y_rate": _at_field(p, "c0") + _at_field(p, "c1"),
        "u": p["c1_b"] * inner - p["c0_b"] * slip - p["F_b"] * z,
        "F_a": -z,
        "F_b": -u * z,
        "c0_a": -slip,
        "c0_b": -u * slip,
        "c1_a": inner,
        "c1_b": u * inner,
        "k0": p["y"] - p["x"],
    }


def balance_slopes_over_inputs(p: Values) -> dict[str, Number]:
    """And over what effects may change: the damper's motion, and the factors of F, c0 and c1."""
    F, c0, c1 = (law.at_field(p[f"{name}_a"], p[f"{name}_b"], p["u"]) for name in ("F", "c0", "c1"))
    return {
        "x": 0.0 * p["z"] - p["k0"],
        "v": -_at_field(p, "c0") + 0.0 * p["z"],
        "F_factor": -F * p["z"],
        "c0_factor": -c0 * (p["v"] - p["y_rate"]),
        "c1_factor": c1 * p["y_rate"],
    }


def _at_field(p: Values, name: str) -> Number:
    """F [N], c0 or c1 [N s/m] at the field."""
    return _scaled(p, name, law.at_field(p[f"{name}_a"], p[f"{name}_b"], p["u"]))


def _scaled(p: Values, name: str, value: Number) -> Number:
    """A value times the factor that effects give F, c0 or c1."""
    factor = p.get(f"{name}_factor")
    return value if factor is None else factor * value


def force(p: Values) -> Number:
    """Force [N] of eq. 2, and what acts beside it."""
    found = law.force(p["y_rate"], p["x"], _at_field(p, "c1"), p["k1"], 0.0) - p["f0"]
    return found + p["beside"] if "beside" in p else found


def force_slopes(p: Values) -> dict[str, Number]:
    """Slopes of the force."""
    u, rate, inner = p["u"], p["y_rate"], _scaled(p, "c1", p["y_rate"])
    return {
        "y_rate": _at_field(p, "c1"),
        "x": p["k1"] + 0.0 * rate,
        "u": p["c1_b"] * inner,
        "c1_a": inner,
        "c1_b": u * inner,
        "k1": p["x"],
        "f0": 0.0 * rate - 1.0,
    }


def force_slopes_over_inputs(p: Values) -> dict[str, Number]:
    """And over what effects may change: the factor of c1, and the force beside the law."""
    rate = p["y_rate"]
    return {"c1_factor": law.at_field(p["c1_a"], p["c1_b"], p["u"]) * rate, "beside": 0.0 * rate + 1.0}
