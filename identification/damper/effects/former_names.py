"""Former names of forms and parameters, which older fits, twins, scenarios and effect files still hold.

Documents are written with the present names and read with both.
"""

from collections.abc import Mapping

FORMER_FORMS: dict[str, dict[str, str]] = {
    "clevis_backlash": {"play": "backlash"},
    "coil_lag": {
        "late_and_slow": "dead_time_and_lag",
        "partly_slow": "partial_lag",
        "deeply_slow": "two_layer_lag",
    },
    "direction_asymmetry": {"shares": "proportional", "one_way": "one_sided"},
    "displacement_nonlinearity": {"bow_and_curve": "saturating", "powers": "polynomial", "wave": "periodic"},
    "fixture_compliance": {"closing": "closing_joint"},
    "force_drift": {"swinging": "sinusoidal", "wandering": "harmonic"},
    "gas_spring": {
        "polytropic_turned": "polytropic_reversed",
        "heat_to_wall": "heat_exchange",
        "heat_to_wall_turned": "heat_exchange_reversed",
    },
    "magnetic_remanence": {"play": "play_operator"},
    "mains_hum": {"line": "fundamental", "with_third": "third_harmonic"},
    "seal_friction": {"stribeck_gentle": "stribeck_exponential", "bending_lip": "presliding"},
    "shear_thinning": {"shares": "proportional"},
    "viscous_heating": {"viscosity": "viscosity_only", "whole": "uniform", "partly": "partial"},
}
"""Present name of a form by effect and former name."""

FORMER_PARAMETERS: dict[str, dict[str, str]] = {
    "clevis_backlash": {"softness": "contact_compliance", "film": "film_damping"},
    "coil_lag": {"part": "slow_fraction"},
    "displacement_nonlinearity": {"bow": "even", "curve": "odd"},
    "field_saturation": {"missing": "initial_loss", "rise": "initial_drive"},
    "gas_spring": {"exchange": "exchange_time"},
    "seal_friction": {"bend": "presliding_distance"},
    "viscous_heating": {"recovery": "recovery_time", "part": "yield_exponent"},
}
"""Present name of a parameter by effect and former name."""

ADDED_PARAMETERS: dict[str, dict[str, tuple[frozenset[str], float]]] = {
    "force_drift": {"end": (frozenset({"period"}), 1e5)},
    "magnetic_remanence": {"initial_rise": (frozenset({"residue", "share"}), 1.0)},
}
"""Parameters that older documents lack, by effect: one parameter of each of their forms, and the assumed value."""


def rename_form(effect: str, name: str) -> str:
    """Return the present name of a form; a name that is not a former one is returned as it is."""
    return FORMER_FORMS.get(effect, {}).get(name, name)


def rename_parameters(effect: str, values: Mapping[str, float]) -> dict[str, float]:
    """Return parameter values under their present names, with those that older documents lack.

    Raises:
        ValueError: a parameter is given under its former and its present name.
    """
    former = FORMER_PARAMETERS.get(effect, {})
    renamed = {former.get(name, name): value for name, value in values.items()}
    if len(renamed) < len(values):
        twice = ", ".join(f"{old} and {new}" for old, new in former.items() if old in values and new in values)
        raise ValueError(f"{effect} has a parameter under its former and its present name: {twice}; keep one")
    added = ADDED_PARAMETERS.get(effect, {}).items()
    return {**{name: value for name, (beside, value) in added if beside & renamed.keys()}, **renamed}
