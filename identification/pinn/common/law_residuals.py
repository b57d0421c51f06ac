"""Residuals of the law at single points in time, with their partials over the quantities in each equation.

The residuals are evaluated by ``identification.damper.law``. The partials are written out here, because automatic
differentiation costs more than the rest of a training step; tests compare them with finite differences. All
functions use arithmetic only, so numpy arrays and torch tensors both work; the logarithm is an argument.
"""

from collections.abc import Callable, Mapping

from identification.damper import Number, law

Values = Mapping[str, Number]
"""States, inputs and coordinates at some points, by name."""


def compute_hysteresis_residual(p: Values) -> Number:
    """Return the residual [m/s] of eq. 3, times the yield displacement; ``z`` is over its saturation."""
    D_y, rho = p["D_y"], p["rho"]
    rate = law.compute_hysteresis_rate(
        p["v"] - p["y_rate"], p["z"], 1.0 / D_y, rho / D_y, (1.0 - rho) / D_y, p["n"]
    )
    return D_y * (p["z_rate"] - rate)


def differentiate_hysteresis(p: Values, log: Callable[[Number], Number]) -> dict[str, Number]:
    """Return the partials of the residual of eq. 3; at its kinks, those of the positive side."""
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


def compute_balance_residual(p: Values) -> Number:
    """Return the residual [N] of eq. 4, times c0 + c1."""
    F, c0, c1 = (_evaluate_at_field(p, name) for name in ("F", "c0", "c1"))
    return (c0 + c1) * (
        p["y_rate"] - law.compute_inner_velocity(p["x"], p["v"], p["y"], p["z"], F, c0, c1, p["k0"])
    )


def differentiate_balance(p: Values) -> dict[str, Number]:
    """Return the partials of the residual of eq. 4 over states, field and coordinates."""
    u, rate = p["u"], p["y_rate"]
    z, slip, inner = _scale(p, "F", p["z"]), _scale(p, "c0", p["v"] - rate), _scale(p, "c1", rate)
    return {
        "z": -_evaluate_at_field(p, "F"),
        "y": p["k0"] + 0.0 * z,
        "y_rate": _evaluate_at_field(p, "c0") + _evaluate_at_field(p, "c1"),
        "u": p["c1_b"] * inner - p["c0_b"] * slip - p["F_b"] * z,
        "F_a": -z,
        "F_b": -u * z,
        "c0_a": -slip,
        "c0_b": -u * slip,
        "c1_a": inner,
        "c1_b": u * inner,
        "k0": p["y"] - p["x"],
    }


def differentiate_balance_inputs(p: Values) -> dict[str, Number]:
    """Return the partials of eq. 4 over inputs that effects change: motion, and factors of F, c0 and c1."""
    F, c0, c1 = (law.evaluate_coefficient(p[f"{name}_a"], p[f"{name}_b"], p["u"]) for name in ("F", "c0", "c1"))
    return {
        "x": 0.0 * p["z"] - p["k0"],
        "v": -_evaluate_at_field(p, "c0") + 0.0 * p["z"],
        "F_factor": -F * p["z"],
        "c0_factor": -c0 * (p["v"] - p["y_rate"]),
        "c1_factor": c1 * p["y_rate"],
    }


def compute_force(p: Values) -> Number:
    """Return the force [N] of eq. 2 with the parallel force of effects."""
    force = law.compute_force(p["y_rate"], p["x"], _evaluate_at_field(p, "c1"), p["k1"], 0.0) - p["f0"]
    return force + p["parallel_force"] if "parallel_force" in p else force


def differentiate_force(p: Values) -> dict[str, Number]:
    """Return the partials of the force over states, field and coordinates."""
    u, rate, inner = p["u"], p["y_rate"], _scale(p, "c1", p["y_rate"])
    return {
        "y_rate": _evaluate_at_field(p, "c1"),
        "x": p["k1"] + 0.0 * rate,
        "u": p["c1_b"] * inner,
        "c1_a": inner,
        "c1_b": u * inner,
        "k1": p["x"],
        "f0": 0.0 * rate - 1.0,
    }


def differentiate_force_inputs(p: Values) -> dict[str, Number]:
    """Return the partials of the force over inputs that effects change: factor of c1, parallel force."""
    rate = p["y_rate"]
    return {
        "c1_factor": law.evaluate_coefficient(p["c1_a"], p["c1_b"], p["u"]) * rate,
        "parallel_force": 0.0 * rate + 1.0,
    }


def _evaluate_at_field(p: Values, name: str) -> Number:
    """Return F [N], c0 or c1 [N s/m] at the field."""
    return _scale(p, name, law.evaluate_coefficient(p[f"{name}_a"], p[f"{name}_b"], p["u"]))


def _scale(p: Values, name: str, value: Number) -> Number:
    """Return a value times the factor that effects give F, c0 or c1."""
    factor = p.get(f"{name}_factor")
    return value if factor is None else factor * value
