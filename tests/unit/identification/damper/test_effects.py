"""Effects: what they declare, and the physics of each form."""

import json
import subprocess
import sys

import numpy as np
import pytest

from identification.damper.effects import COMMON_EFFECTS, EFFECTS

STAGES = ("coil", "damper", "mounting", "force_channel", "displacement_channel")
FORMS = [(e, f) for e in EFFECTS.values() for f in e.forms]
IDS = [f"{e.name}-{f.name}" for e, f in FORMS]
V = np.linspace(-0.3, 0.3, 61)
X = np.linspace(-0.03, 0.03, 61)


def act(name, form=None):
    return EFFECTS[name].find_form(form).function


def test_the_usual_ones_are_those_that_a_diagnosis_owes():
    assert (
        *("field_saturation", "magnetic_remanence", "coil_lag"),
        *(
            "gas_spring",
            "seal_friction",
            "orifice_turbulence",
            "direction_asymmetry",
            "viscous_heating",
            "end_stop",
        ),
        *("clevis_backlash", "fixture_compliance", "moving_mass"),
        *("force_delay", "force_drift", "mains_hum"),
        "displacement_nonlinearity",
    ) == COMMON_EFFECTS


@pytest.mark.parametrize(("effect", "form"), FORMS, ids=IDS)
def test_each_form_declares_its_place_and_parameters(effect, form):
    assert effect.stage in STAGES
    assert len({f.name for f in effect.forms}) == len(effect.forms)
    assert all(q.low <= q.scale <= q.high and q.unit for q in form.parameters)
    for start in form.starts:
        assert all(q.low <= value <= q.high for q, value in zip(form.parameters, start, strict=True))


@pytest.mark.parametrize(
    ("name", "symbol"),
    [
        ("moving_mass", "mass"),
        ("force_delay", "delay"),
        ("fixture_compliance", "compliance"),
        ("orifice_turbulence", "coefficient"),
        ("viscous_heating", "softening"),
        ("clevis_backlash", "gap"),
    ],
)
def test_what_cannot_be_negative_is_not(name, symbol):
    (quantity,) = [q for q in EFFECTS[name].find_form().parameters if q.symbol == symbol]
    assert quantity.low == 0.0


def test_the_usual_form_comes_first_and_others_by_name():
    assert EFFECTS["gas_spring"].find_form().name == "polytropic"
    assert EFFECTS["gas_spring"].find_form("polytropic_reversed").name == "polytropic_reversed"
    with pytest.raises(KeyError):
        EFFECTS["gas_spring"].find_form("cubic")


def test_gas_spring_is_at_rest_in_the_middle_and_stiffens_in_compression():
    force = act("gas_spring")
    assert force(0.0, 0.0, 90.0, 0.05) == 0.0
    assert -force(-0.01, 0.0, 90.0, 0.05) > force(0.01, 0.0, 90.0, 0.05) > 0


def test_the_turned_gas_spring_is_the_recording_turned_round():
    one, other = act("gas_spring"), act("gas_spring", "polytropic_reversed")
    np.testing.assert_allclose(other(X, 0.0, 90.0, 0.05), -one(-X, 0.0, 90.0, 0.05))


def test_gas_is_isothermal_where_its_heat_has_left_and_adiabatic_where_it_has_not():
    force = act("gas_spring", "heat_exchange")
    slow, fast = force(-0.01, 0.0, -0.01, 90.0, 0.05, 0.3), force(-0.01, 0.0, 0.0, 90.0, 0.05, 0.3)
    assert slow == pytest.approx(-90.0 * (1.0 / 0.8 - 1.0))
    assert fast == pytest.approx(-90.0 * (0.8**-1.4 - 1.0))
    turned = act("gas_spring", "heat_exchange_reversed")
    assert turned(0.01, 0.0, 0.0, 90.0, 0.05, 0.3) == pytest.approx(-fast)


def test_asymmetry_adds_to_extension_what_it_takes_from_compression():
    alpha, c0, c1 = act("direction_asymmetry")(0.0, np.array([-0.2, 0.2]), 0.1, 0.2, 0.01)
    np.testing.assert_allclose(alpha, [0.9, 1.1], rtol=1e-3)
    np.testing.assert_allclose(c0, [0.8, 1.2], rtol=1e-3)
    np.testing.assert_array_equal(c0, c1)
    one_way = act("direction_asymmetry", "one_sided")
    np.testing.assert_allclose(one_way(0.0, V, 100.0, 5.0, 0.01), one_way(0.0, -V, 100.0, 5.0, 0.01))


def test_heat_softens_the_oil_and_in_one_form_the_yield_too():
    assert act("viscous_heating")(500.0, 2e-3, 100.0) == pytest.approx((1.0, 0.5, 0.5))
    assert act("viscous_heating", "uniform")(500.0, 2e-3, 100.0) == pytest.approx((0.5, 0.5, 0.5))
    assert act("viscous_heating", "partial")(500.0, 2e-3, 100.0, 0.5) == pytest.approx((0.5**0.5, 0.5, 0.5))


def test_an_end_stop_is_silent_inside_its_gap_and_pushes_back_beyond():
    both, out, back = (act("end_stop", f) for f in ("both_ends", "extended_end", "compressed_end"))
    values = (2e4, 0.01, 1e-3)
    assert both(0.0099, 0.0, *values) == out(-0.02, 0.0, *values) == back(0.02, 0.0, *values) == 0.0
    assert both(0.02, 0.0, *values) == out(0.02, 0.0, *values) > 0.8 * 2e4 * 0.01
    assert both(-0.02, 0.0, *values) == back(-0.02, 0.0, *values) == -both(0.02, 0.0, *values)


def test_backlash_holds_the_damper_until_the_gap_is_crossed():
    follow = act("clevis_backlash")
    held = follow(0.0, 0.001, 2e-4)
    assert held == pytest.approx(0.0009)
    assert follow(held, 0.00085, 2e-4) == held
    assert follow(held, 0.0007, 2e-4) == pytest.approx(0.0008)


@pytest.mark.parametrize(("form", "values"), [("tanh", (2.0,)), ("knee", (2.0, 3.0))])
def test_a_saturated_field_is_bounded_and_begins_straight(form, values):
    field = act("field_saturation", form)
    assert field(1e-4, *values) == pytest.approx(1e-4, rel=1e-6)
    assert field(0.4, *values) < 0.4
    assert field(50.0, *values) == pytest.approx(0.5, rel=1e-3)


def test_iron_that_begins_slowly_begins_slowly_and_is_full_at_last():
    field = act("field_saturation", "magnetisation")
    missing = 0.6
    values = (0.5, missing, 0.2)
    assert field(1e-6, *values) == pytest.approx(1e-6 * (1.0 - missing), rel=1e-3)
    assert field(0.6, *values) / 0.6 > 1.3 * field(0.1, *values) / 0.1, "its permeability grows"
    assert field(500.0, *values) == pytest.approx(2.0, rel=1e-3)
    assert field(-0.3, *values) == -field(0.3, *values)


@pytest.mark.parametrize(("form", "values"), [("exponential", (0.02, 0.05, 1.0)), ("play_operator", (0.02, 1.0))])
def test_iron_is_below_on_the_way_up_and_above_on_the_way_down(form, values):
    shape = EFFECTS["magnetic_remanence"].find_form(form)
    up = shape.memory(0.0, 0.5, 1.0, *values)
    down = shape.memory(up, -0.5, 1.0, *values)
    assert shape.function(0.5, up, *values) == pytest.approx(0.48, abs=1e-4)
    assert shape.function(0.0, down, *values) == pytest.approx(0.02, abs=1e-4)


@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("exponential", (0.02, 0.05, 1.0)),
        ("play_operator", (0.02, 1.0)),
        ("prandtl_ishlinskii", (0.5, 0.03, 1.0, 1.0)),
    ],
)
def test_what_iron_remembers_does_not_depend_on_how_a_change_is_cut(form, values):
    memory = EFFECTS["magnetic_remanence"].find_form(form).memory
    cut = 0.01
    for _ in range(30):
        cut = memory(cut, 0.001, 1.0, *values)
    assert cut == pytest.approx(memory(0.01, 0.03, 1.0, *values))


def test_a_bent_channel_has_no_gain_of_its_own_and_stays_bounded():
    bend = act("displacement_nonlinearity")
    assert bend(1e-6, 1e-4, 1e-4, 0.015) / 1e-6 < 1e-4
    assert np.abs(bend(np.array([-1.0, 1.0]), 1e-4, 1e-4, 0.015)).max() < 2.01e-4


@pytest.mark.parametrize(("form", "values"), [("settling", (5.0, 60.0)), ("sinusoidal", (3.0, 4.0, 100.0, 1e5))])
def test_a_drift_stays_bounded_for_all_time(form, values):
    time = np.linspace(0.0, 1e5, 10_001)
    assert np.abs(act("force_drift", form)(time, 0.0, *values)).max() <= 5.0 + 1e-9


@pytest.mark.parametrize(("effect", "form"), FORMS, ids=IDS)
def test_forms_without_memory_take_arrays_as_they_take_numbers(effect, form):
    arguments = {"parallel_force": 2, "scaling": 2, "additive_force": 2, "softening": 1, "field": 1}.get(
        form.action, 0
    )
    if not arguments:
        return
    values = [q.scale for q in form.parameters]
    many = np.asarray(form.function(*[np.abs(X) + 1e-3] * arguments, *values))
    one = np.asarray(form.function(*[abs(X[7]) + 1e-3] * arguments, *values))
    np.testing.assert_allclose(many[..., 7], one)


def test_the_library_needs_no_compiler():
    code = (
        "import sys, json; import identification.damper.effects;"
        "print(json.dumps([m for m in ('numba', 'torch', 'scipy') if m in sys.modules]))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(found.stdout) == []
