"""Values and states of alternative forms at single instants, computed by hand."""

import math

import numpy as np
import pytest

from sim_rig.effect_forms import FORMS
from sim_rig.effect_forms import form as inputs
from sim_rig.effect_forms.form import INPUT_COUNT, MAX_STATES

TANH_1, TANH_2 = math.tanh(1.0), math.tanh(2.0)
ROOT = (0.03**2 + 4e-6) ** 0.5


@pytest.mark.parametrize(
    ("name", "values", "now", "memory", "result", "rates"),
    [
        ("arctangent", (0.0,), {"FIELD": 0.4}, (), 0.4, ()),
        ("arctangent", (1 / math.pi,), {"FIELD": 2.0}, (), math.pi / 2, ()),
        ("arctangent", (4 / math.pi,), {"FIELD": 0.5}, (), math.pi / 8, ()),
        ("relaxing_rubber", (1e4, 8e-3, 1.0), {"X": 7e-3, "V": 0.2}, (1e-3,), 0.0, (-0.0125,)),
        ("relaxing_rubber", (1e4, 8e-3, 1.0), {"X": 12e-3, "V": 0.2}, (0.0,), 80.0, (0.2,)),
        ("relaxing_rubber", (1e4, 8e-3, -1.0), {"X": -12e-3, "V": -0.2}, (1e-3,), -88.0, (0.1875,)),
        ("relaxing_rubber", (1e4, 8e-3, 1.0), {"X": 9e-3, "V": -0.2}, (-0.01,), 0.0, (-0.075,)),
        (
            "mass_with_bracket", (2.0, 10.0), {"ACCELERATION": 3.0}, (1e-3, 0.1),
            2.0 * (0.65 * 3.0 - 0.35 * (0.4 * math.pi**2 + 0.32 * math.pi)),
            (0.1, -3.0 - 0.4 * math.pi**2 - 0.32 * math.pi),
        ),
        ("closing_loop", (0.3, 0.1), {"FIELD": 0.0, "FIELD_RATE": -2.0}, (0.05,), 0.015, (1.75,)),
        ("closing_loop", (0.3, 0.1), {"FIELD": 0.5, "FIELD_RATE": 2.0}, (0.1,),
         0.5 + 0.03 / math.cosh(1.0), (-4.0,)),
        ("swelling_harmonics", (4.0, 50.0, 0.0), {"TIME": 0.005}, (),
         4.0 * TANH_2 * (1 + 0.3 * math.sin(0.004)), ()),
        ("two_valves", (0.2, 0.004, 0.01), {"V": 0.004}, (), 1.1, ()),
        ("two_valves", (0.2, 0.004, 0.01), {"V": 0.014}, (), 1.1 + 0.1 * TANH_1, ()),
        ("uneven_winding", (1e-4, 5e-3, 8e-3), {"X": 5e-3}, (), 5.1e-3, ()),
        ("uneven_winding", (1e-4, 5e-3, 8e-3), {"X": 13e-3}, (), 13e-3 + 1e-4 / math.e, ()),
        ("reynolds_transition", (3000.0, 0.05), {"V": -0.05}, (), -3.75, ()),
        ("reynolds_transition", (3000.0, 0.05), {"V": 0.1}, (), 15.0 * 2**0.75 * 16 / 17, ()),
        ("every_nth_stroke", (30.0, 0.1), {"V": 0.03, "PATH": 0.2}, (), 30.0 * 0.03 / ROOT, ()),
        ("every_nth_stroke", (30.0, 0.1), {"V": -0.03, "PATH": 0.1 / 6}, (), -30.0 / 4096 * 0.03 / ROOT, ()),
        ("every_nth_stroke", (30.0, 0.1), {"V": 0.03, "PATH": 0.05}, (), 0.0, ()),
        ("lugre", (15.0, 0.7, 5e-5, 0.02), {"V": 0.02}, (0.27,), 15.0 * (0.27 + 2e-5 * 320.0), (320.0,)),
        ("lugre", (15.0, 0.7, 5e-5, 0.02), {"V": -0.02}, (-0.27,), -15.0 * (0.27 + 2e-5 * 320.0), (-320.0,)),
        ("closing_joint", (1e-7, 1e-4), {"ELONGATION": 1e-4, "ELONGATION_RATE": 0.1}, (), 2500.0, ()),
        ("warm_up_and_walk", (20.0, 30.0, 0.7), {"TIME": 0.0}, (), 0.0, ()),
        ("bursts", (15.0, 2.5, 4.0), {"TIME": 0.1}, (), 15.0 * math.exp(-5 * (1 - math.cos(math.pi / 20))), ()),
        ("bursts", (15.0, 2.25, 4.0), {"TIME": 1.0}, (), 15.0 * math.exp(-5), ()),
    ],
)  # fmt: skip
def test_form_has_the_value_and_rates_of_its_formula(name, values, now, memory, result, rates):
    instant, states, found = np.zeros(INPUT_COUNT), np.zeros(MAX_STATES), np.zeros(MAX_STATES)
    for symbol, value in now.items():
        instant[getattr(inputs, symbol)] = value
    states[: len(memory)] = memory
    assert FORMS[name].function(instant, states, np.array(values), found) == pytest.approx(result, abs=1e-12)
    assert found[: len(rates)] == pytest.approx(rates)


@pytest.mark.parametrize(
    ("name", "symbol", "low", "high"),
    [
        ("closing_joint", "closing_deflection", 1e-6, 1.0),
        ("lugre", "presliding_distance", 5e-6, 1e-3),
        ("lugre", "stribeck", 1e-3, 0.2),
        ("every_nth_stroke", "period_path", 1e-3, 2.0),
        ("reynolds_transition", "drag", 0.0, 1e6),
        ("reynolds_transition", "transition", 1e-3, 1.0),
        ("uneven_winding", "width", 1e-3, 0.5),
        ("uneven_winding", "position", -0.2, 0.2),
        ("two_valves", "softness", 1e-3, 0.2),
        ("warm_up_and_walk", "time_constant", 1.0, 1000.0),
        ("relaxing_rubber", "direction", -1.0, 1.0),
    ],
)
def test_parameter_has_its_limits_in_si_units(name, symbol, low, high):
    (found,) = (one for one in FORMS[name].parameters if one.symbol == symbol)
    assert (found.low, found.high) == (low, high)


@pytest.mark.parametrize("form", FORMS.values(), ids=lambda form: form.form)
def test_usual_value_of_a_parameter_is_within_its_limits(form):
    assert all(one.low <= one.scale <= one.high for one in form.parameters)
