"""Each form of each effect against numbers computed by hand, and the bounds of its parameters."""

import re
from pathlib import Path

import numpy as np
import pytest

from identification.damper import COORDINATES, PARAMETERS, law
from identification.damper.effects import EFFECTS, connection
from identification.damper.parameter_sets import check_drive_range, find_parameter_set

E1, E2 = 0.36787944117, 0.13533528324
"""exp(-1) and exp(-2)."""
ROOT2 = 1.41421356237
COS30, COS15, SIN15, COS45 = 0.86602540378, 0.96592582629, 0.25881904510, 0.70710678119
CASES = [
    ("coil_crosstalk", "proportional", (3.0, 0.5, 20.0), 10.0),
    ("clevis_backlash", "free_pin", (2e-4, 0.5), (1e-4, 2e-4, 0.0, 0.0, 0.0)),
    ("clevis_backlash", "greased_pin", (2e-4, 0.5, 5e3), (1e-4, 2e-4, 0.0, 5e3, 0.0)),
    ("clevis_backlash", "backlash", (0.0, 3e-4, 2e-4), 2e-4),
    ("clevis_backlash", "backlash", (0.0, -3e-4, 2e-4), -2e-4),
    ("clevis_backlash", "backlash", (0.0, 5e-5, 2e-4), 0.0),
    ("coil_lag", "second_lag", (0.01,), (0.0, 0.01, 1.0, 1)),
    ("coil_lag", "dead_time", (0.02,), (0.02, 0.0, 1.0, 1)),
    ("coil_lag", "dead_time_and_lag", (0.02, 0.01), (0.02, 0.01, 1.0, 1)),
    ("coil_lag", "partial_lag", (0.03, 0.4), (0.0, 0.03, 0.4, 1)),
    ("coil_lag", "two_layer_lag", (0.03, 0.4), (0.0, 0.03, 0.4, 2)),
    # A velocity of 3 over a width of 4 makes a direction of 3 / 5.
    ("direction_asymmetry", "proportional", (0.0, 0.03, 0.1, 0.5, 0.04), (1.06, 1.3, 1.3)),
    ("direction_asymmetry", "proportional", (0.0, -0.03, 0.1, 0.5, 0.04), (0.94, 0.7, 0.7)),
    ("direction_asymmetry", "one_sided", (0.0, 0.03, 100.0, 10.0, 0.04), 1.0 + 3.6),
    ("displacement_nonlinearity", "saturating", (0.0075, 1e-4, 2e-4, 0.01), 3.6e-5 + 4.32e-5),
    ("displacement_nonlinearity", "saturating", (-0.0075, 1e-4, 2e-4, 0.01), 3.6e-5 - 4.32e-5),
    ("displacement_nonlinearity", "polynomial", (0.02, 3e-5, 5e-5), 1.2e-4 + 4e-4),
    ("displacement_nonlinearity", "periodic", (0.005, 4e-5, -6e-5, 0.02), 4e-5 - 6e-5),
    ("displacement_nonlinearity", "periodic", (0.01, 4e-5, -6e-5, 0.02), 8e-5),
    ("end_stop", "both_ends", (0.013, 0.0, 2e4, 0.01, 1e-3), 45.0),
    ("end_stop", "both_ends", (-0.013, 0.0, 2e4, 0.01, 1e-3), -45.0),
    ("end_stop", "extended_end", (0.013, 0.0, 2e4, 0.01, 1e-3), 45.0),
    ("end_stop", "extended_end", (0.01, 0.0, 2e4, 0.01, 1e-3), 0.0),
    ("end_stop", "compressed_end", (-0.013, 0.0, 2e4, 0.01, 1e-3), -45.0),
    ("end_stop", "compressed_end", (-0.01, 0.0, 2e4, 0.01, 1e-3), 0.0),
    ("field_saturation", "tanh", (0.5, 2.0), 0.38079707798),
    ("field_saturation", "tanh", (0.5, 0.0), 0.5),
    ("field_saturation", "knee", (0.5, 2.0, 2.0), 0.5 / ROOT2),
    ("field_saturation", "knee", (0.5, 0.0, 2.0), 0.5),
    ("field_saturation", "magnetisation", (0.2, 0.0, 0.5, 0.2), 0.2 * (1.0 - 0.5 * E1)),
    ("field_saturation", "magnetisation", (0.5, 2.0, 0.0, 0.2), 0.5 / ROOT2),
    ("fixture_compliance", "linear", (1e-6,), (1e-6, 0.0, 0.0, 0.0, 0.0)),
    ("fixture_compliance", "stiffening", (1e-6, 1e7), (1e-6, 0.0, 1e7, 0.0, 0.0)),
    ("fixture_compliance", "closing_joint", (1e-6, 100.0, 2.0), (5e-7, 2e-4, 0.0, 0.0, 0.5)),
    ("force_drift", "settling", (20.0, 0.3, 5.0, 10.0), 5.0 * (1.0 - E2)),
    ("force_drift", "sinusoidal", (5.0, 0.3, 8.0, -4.0, 60.0, 5.0), 8.0 * COS30 - 2.0),
    ("force_drift", "sinusoidal", (7.0, 0.3, 8.0, -4.0, 60.0, 5.0), 8.0 * COS30 - 2.0),
    # A twelfth of the period: the angles are multiples of 30 degrees.
    ("force_drift", "harmonic", (10.0, 0.3, *range(1, 13), 120.0, 10.0), 4.0 * COS30 - 1.0),
    ("force_drift", "harmonic", (11.0, 0.3, *range(1, 13), 120.0, 10.0), 4.0 * COS30 - 1.0),
    ("gas_spring", "polytropic", (-0.025, 0.0, 90.0, 0.05), -131.605994),
    ("gas_spring", "polytropic", (-0.05, 0.0, 90.0, 0.05), -90.0 * (161.6817516 - 1.0)),
    ("gas_spring", "polytropic_reversed", (0.025, 0.0, 90.0, 0.05), 131.605994),
    ("gas_spring", "polytropic_reversed", (0.05, 0.0, 90.0, 0.05), 90.0 * (161.6817516 - 1.0)),
    ("gas_spring", "heat_exchange", (-0.01, 0.0, -0.01, 90.0, 0.05, 0.3), -22.5),
    ("gas_spring", "heat_exchange_reversed", (0.01, 0.0, 0.01, 90.0, 0.05, 0.3), 22.5),
    ("magnetic_remanence", "exponential", (0.4, 0.5, 0.02, 0.1, 1.0), 0.41),
    ("magnetic_remanence", "closing", (0.4, 0.5, 0.02, 0.1, 0.4, 1.0), 0.405),
    ("magnetic_remanence", "closing", (0.2, 0.5, 0.02, 0.1, 0.4, 1.0), 0.208),
    ("magnetic_remanence", "play_operator", (0.4, 0.01, 0.02, 1.0), 0.41),
    ("magnetic_remanence", "prandtl_ishlinskii", (0.4, 0.01, 0.3, 0.1, 1.0, 1.0), 0.403),
    ("mains_hum", "fundamental", (1.0 / 600.0, 0.3, 4.0, 3.0, 50.0), 4.0 * COS30 + 1.5),
    (
        "mains_hum",
        "third_harmonic",
        (1.0 / 1200.0, 0.3, 4.0, 3.0, 5.0, -2.0, 50.0),
        4.0 * COS15 + 3.0 * SIN15 + 3.0 * COS45,
    ),
    ("moving_mass", "rigid", (2.5, 4.0), 10.0),
    ("orifice_turbulence", "quadratic", (0.0, -0.2, 1500.0), -60.0),
    ("orifice_turbulence", "power", (0.0, -0.2, 15.0, 3.0), -120.0),
    ("seal_friction", "stribeck", (0.0, 5e-4, 20.0, 10.0, 5e-4), (20.0 + 10.0 * E1) / ROOT2),
    ("seal_friction", "stribeck", (0.0, -0.1, 20.0, 10.0, 5e-4), -19.99975),
    ("seal_friction", "stribeck_exponential", (0.0, 5e-4, 20.0, 10.0, 2.5e-4), (20.0 + 10.0 * E2) / ROOT2),
    ("seal_friction", "presliding", (0.0, 0.015, 0.5, 20.0, 10.0, 0.015, 6e-5), 10.0 + 5.0 * E1),
    ("seal_friction", "bristle", (0.0, 0.015, 0.5, 20.0, 0.5, 0.015, 6e-5), 10.0),
    ("shear_thinning", "proportional", (0.0, -0.08, 0.3, 0.08), (1.0, 0.85, 1.0)),
    ("side_load_friction", "linear", (0.011, 1e-3, 2000.0, 0.001), 20.0 / ROOT2),
    ("side_load_friction", "linear", (-0.009, -1e-3, 2000.0, 0.001), -20.0 / ROOT2),
    ("side_load_friction", "bristle", (-0.009, 0.015, 0.5, 2000.0, 0.001, 0.5, 0.015, 6e-5), 10.0),
]
MEMORY = [
    ("magnetic_remanence", "exponential", (0.2, 0.1, 1.0, 0.02, 0.1, 1.0), -1.0 + 1.2 * E1),
    ("magnetic_remanence", "exponential", (0.2, -0.1, 1.0, 0.02, 0.1, 1.0), 1.0 - 0.8 * E1),
    ("magnetic_remanence", "exponential", (0.0, 1e-6, 1.0, 0.02, 0.0, 1.0), -1.0 + E1),
    ("magnetic_remanence", "closing", (0.2, 0.1, 1.0, 0.02, 0.1, 0.4, 1.0), -1.0 + 1.2 * E1),
    ("magnetic_remanence", "closing", (0.2, -0.1, 1.0, 0.02, 0.1, 0.4, 1.0), 1.0 - 0.8 * E1),
    ("magnetic_remanence", "play_operator", (0.005, 0.01, 1.0, 0.02, 1.0), -0.005),
    ("magnetic_remanence", "play_operator", (0.005, 0.1, 1.0, 0.02, 1.0), -0.02),
    ("magnetic_remanence", "play_operator", (0.005, -0.1, 1.0, 0.02, 1.0), 0.02),
    ("magnetic_remanence", "prandtl_ishlinskii", (0.005, 0.1, 0.25, 0.3, 0.08, 2.0, 1.0), -0.005),
    ("magnetic_remanence", "prandtl_ishlinskii", (0.005, 0.1, 0.25, 0.3, 0.08, 0.5, 1.0), -0.04),
    ("seal_friction", "presliding", (0.2, 6e-5, 0.1, 20.0, 10.0, 0.015, 6e-5), 1.0 - 0.8 * E1),
    ("seal_friction", "presliding", (0.2, -6e-5, 0.1, 20.0, 10.0, 0.015, 6e-5), -1.0 + 1.2 * E1),
    ("seal_friction", "bristle", (0.2, 9e-5, 0.0, 20.0, 0.5, 0.015, 6e-5), 1.5 - 1.3 * E1),
    ("seal_friction", "bristle", (0.2, -6e-5, -1.0, 20.0, 0.5, 0.015, 6e-5), -1.0 + 1.2 * E1),
    ("side_load_friction", "bristle", (0.2, 9e-5, 0.0, 2000.0, 0.001, 0.5, 0.015, 6e-5), 1.5 - 1.3 * E1),
    ("side_load_friction", "bristle", (0.2, -6e-5, -1.0, 2000.0, 0.001, 0.5, 0.015, 6e-5), -1.0 + 1.2 * E1),
]


@pytest.mark.parametrize(("effect", "form", "arguments", "expected"), CASES)
def test_a_form_returns_the_value_computed_by_hand(effect, form, arguments, expected):
    found = EFFECTS[effect].find_form(form).function(*arguments)
    assert np.asarray(found) == pytest.approx(np.asarray(expected), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize(("effect", "form", "arguments", "expected"), MEMORY)
def test_a_memory_changes_by_the_value_computed_by_hand(effect, form, arguments, expected):
    assert EFFECTS[effect].find_form(form).memory(*arguments) == pytest.approx(expected, rel=1e-6)


SPRING = (1e-6, 2e-4, 1e7, 0.5)
"""Compliance [m/N], gap [m], hardening [1/m²] and in-gap stiffness ratio [1] of a connection."""


@pytest.mark.parametrize(
    ("elongation", "force", "stiffness"),
    [(5e-5, 25.005, 0.5001e6), (3e-4, 330.01, 2.2e6), (-3e-4, -330.01, 2.2e6), (-5e-5, -25.005, 0.5001e6)],
)
def test_a_connection_transmits_the_force_of_its_gap_and_its_hardening_spring(elongation, force, stiffness):
    assert connection.compute_transmitted_force(elongation, *SPRING) == pytest.approx(force, rel=1e-9)
    assert connection.compute_tangent_stiffness(elongation, *SPRING) == pytest.approx(stiffness, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "values", "elongation"),
    [
        (25.0, SPRING, 5e-5),
        (-25.0, SPRING, -5e-5),
        (330.0, SPRING, 3e-4),
        (-330.0, SPRING, -3e-4),
        (0.5, (1e-6, 2e-4, 0.0, 0.0), 1.005e-4),
        (0.0, (1e-6, 2e-4, 0.0, 0.0), -1e-4),
        (10.0, (1.0, 0.0, 1.0, 0.0), 2.0),
    ],
)
def test_the_elongation_of_a_connection_is_that_at_which_it_carries_the_force(force, values, elongation):
    assert connection.compute_elongation(force, *values) == pytest.approx(elongation, rel=1e-9)


def test_the_field_approaches_the_drive_at_its_rate_constant():
    assert law.compute_field_rate(1.0, 0.4, 60.0) == pytest.approx(-36.0)


@pytest.mark.parametrize(("c0", "faults"), [(0.5, 0), (0.0, 0), (-0.5, 2)])
def test_only_a_negative_coefficient_would_generate_energy(c0, faults):
    p = find_parameter_set("laboratory").parameters._replace(c0_a=c0, c0_b=0.0)
    assert len(check_drive_range(p, 0.0, 0.5)) == faults


def test_a_coefficient_may_become_negative_at_either_end_of_the_drives():
    p = find_parameter_set("laboratory").parameters._replace(c1_a=100.0, c1_b=-1000.0)
    assert check_drive_range(p, 0.0, 0.1) == []
    (fault,) = check_drive_range(p, 0.0, 0.5)
    assert fault == "c1 is -400 N s/m at drive 0.5: the damper would generate energy"


BOUNDS = {
    "F_a": (0.0001, 1e07, 50),
    "F_b": (0, 1e10, 900),
    "D_y": (1e-09, 10, 3e-05),
    "rho": (0.02, 0.98, 0.5),
    "n": (1, 6, 2),
    "eta": (0.0001, 1e06, 100),
    "c0_a": (1e-05, 1e10, 1000),
    "c0_b": (-1e13, 1e13, 1000),
    "c1_a": (0.0001, 1e13, 20000),
    "c1_b": (-1e16, 1e16, 20000),
    "k0": (-1e10, 1e10, 2000),
    "k1": (-1e10, 1e10, 1000),
    "f0": (-1e08, 1e08, 50),
    "alpha_a": (1e-09, 1e14, 10000),
    "alpha_b": (-1e17, 1e17, 50000),
    "beta": (0, 1e45, 1e06),
    "gamma": (0, 1e45, 1e06),
    "A": (0.001, 1e06, 301),
    "x0": (-1e06, 1e06, 0.1),
}
"""Bounds and scale of each coordinate and parameter of the law, in SI units."""
SCALES = {
    "clevis_backlash": {"gap": 1e-4, "contact_compliance": 1e-4, "film_damping": 1e4},
    "coil_crosstalk": {"gain": 10},
    "coil_lag": {"delay": 0.005, "slow_fraction": 0.3},
    "direction_asymmetry": {
        "yield_share": 0.05, "viscous_share": 0.05, "width": 0.01, "damping": 100, "friction": 10,
    },
    "displacement_delay": {"delay": 0.002},
    "end_stop": {"stiffness": 2e4, "gap": 0.008, "softness": 0.001},
    "fixture_compliance": {"compliance": 1e-6, "hardening": 1e7, "load": 100, "ratio": 1},
    "force_delay": {"delay": 0.002},
    "force_filter": {"lag": 0.002},
    "gas_spring": {"preload": 90, "length": 0.05, "exchange_time": 0.5},
    "orifice_turbulence": {"coefficient": 1000, "force": 10, "exponent": 2},
    "seal_friction": {
        "sliding": 20, "peak": 10, "peak_ratio": 0.3, "stribeck": 0.015, "presliding_distance": 5e-5,
    },
    "side_load_friction": {
        "growth": 1000, "middle": 0.005, "peak_ratio": 0.3, "stribeck": 0.015, "presliding_distance": 5e-5,
    },
    "viscous_heating": {"softening": 2e-4, "recovery_time": 100, "yield_exponent": 0.5},
}  # fmt: skip
"""Usual magnitude of the parameters of some effects, in SI units."""


@pytest.mark.parametrize("quantity", [*COORDINATES, *PARAMETERS], ids=lambda q: q.symbol)
def test_the_bounds_of_the_law_admit_dampers_from_10_newtons_to_400_kilonewtons(quantity):
    assert (quantity.low, quantity.high, quantity.scale) == pytest.approx(BOUNDS[quantity.symbol])


@pytest.mark.parametrize("effect", SCALES)
def test_parameters_of_effects_have_their_usual_magnitude(effect):
    scales = {q.symbol: q.scale for form in EFFECTS[effect].forms for q in form.parameters}
    lags = {"lag": scales["lag"]} if effect == "coil_lag" else {}
    assert scales == pytest.approx(SCALES[effect] | lags)


def read_documented_bounds():
    """Return {(effect, form): [(symbol, low, high)]} as the reference of effects states them."""
    text = (Path(__file__).parents[4] / "docs/reference/effects.md").read_text("utf-8")
    found = {}
    for section in text.split("\n## ")[1:]:
        for part in section.split("\nForm `")[1:]:
            rows = re.findall(r"^\| `(\w+)` \| [^|]+ \| (\S+) … (\S+) \|", part, re.MULTILINE)
            found[section.split("\n")[0].strip(), part.split("`")[0]] = [
                (symbol, float(low.replace("−", "-")), float(high.replace("−", "-"))) for symbol, low, high in rows
            ]
    return found


@pytest.mark.parametrize(("effect", "form"), [(e, f.name) for e in EFFECTS for f in EFFECTS[e].forms])
def test_the_bounds_of_a_form_are_those_that_its_reference_states(effect, form):
    bounds = [(q.symbol, q.low, q.high) for q in EFFECTS[effect].find_form(form).parameters]
    assert bounds == read_documented_bounds()[effect, form]


def test_searches_start_at_plausible_sizes():
    assert EFFECTS["end_stop"].find_form().starts[0] == (0.0, 0.004, 1e-3)
    assert EFFECTS["side_load_friction"].find_form().starts == ((0.0, 0.0), (0.0, -0.01), (0.0, 0.01))
    assert EFFECTS["gas_spring"].find_form("heat_exchange").starts[:2] == ((0.0, 0.025, 0.1), (0.0, 0.025, 1.0))
