"""Every form of every effect in the simulated chain: exact sensitivities, and no effect at zero size."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.simulate import ActiveEffect, Excitation, SimulationModel, simulate
from identification.simulate.channel import compute_parallel_force
from identification.simulate.motion import DamperMotion
from tests.support.effects import FORMS, IDS, LABORATORY, MEDIUM, active, sine
from tests.support.sensitivities import compute_worst_error

MODEL = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
TOGETHER = [
    ("direction_asymmetry", "clevis_backlash", "force_delay", "gas_spring", "displacement_nonlinearity"),
    ("fixture_compliance", "direction_asymmetry", "gas_spring", "viscous_heating", "coil_lag", "clevis_backlash"),
    ("field_saturation", "magnetic_remanence", "seal_friction", "moving_mass", "force_filter", "force_drift"),
]


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_sensitivities_agree_with_central_differences(name, form):
    assert compute_worst_error(replace(MODEL, effects=(active(name, form),)), sine()) < 5e-6


@pytest.mark.parametrize("form", ["exponential", "closing", "prandtl_ishlinskii"])
def test_sensitivities_over_the_history_of_the_iron_agree_with_central_differences(form):
    stroke = replace(sine(), drive=0.5 - sine().drive)
    usual = active("magnetic_remanence", form)
    effect = usual._replace(values=(*usual.values[:-1], 0.4))
    assert compute_worst_error(replace(MODEL, effects=(effect,)), stroke) < 5e-6


@pytest.mark.parametrize("names", TOGETHER, ids=["mounting", "compliant mount", "coil"])
def test_sensitivities_of_several_effects_together_agree_with_central_differences(names):
    assert compute_worst_error(replace(MODEL, effects=tuple(map(active, names))), sine()) < 5e-6


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_an_effect_of_no_size_leaves_the_plain_law(name, form):
    shape = EFFECTS[name].find_form(form)
    none = tuple(
        0.0 if q.low <= 0.0 else value for q, value in zip(shape.parameters, MEDIUM[name][form], strict=True)
    )
    plain = simulate(MODEL, sine()).force
    with_none = simulate(replace(MODEL, effects=(ActiveEffect(EFFECTS[name], none, form),)), sine()).force
    assert np.abs(with_none - plain).max() < 1e-6


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_an_effect_of_medium_size_shows_in_the_force(name, form):
    plain = simulate(MODEL, sine()).force
    force = simulate(replace(MODEL, effects=(active(name, form),)), sine()).force
    assert 0.5 < np.sqrt(np.mean((force - plain) ** 2)) < 0.5 * np.std(plain)


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_the_force_is_finite_at_every_bound(name, form):
    shape = EFFECTS[name].find_form(form)
    for bound in ("low", "high"):
        for k, quantity in enumerate(shape.parameters):
            values = list(MEDIUM[name][form])
            values[k] = getattr(quantity, bound)
            effect = ActiveEffect(EFFECTS[name], tuple(values), form)
            found = simulate(replace(MODEL, effects=(effect,)), sine(seconds=0.6), sensitivities=True)
            assert np.isfinite(found.force).all()
            assert np.isfinite(found.sensitivities).all()


def test_a_coarser_stroke_keeps_the_steps_of_its_drive():
    stroke = sine()
    fine = simulate(MODEL, stroke).force
    coarse = simulate(MODEL, stroke.decimate(4)).force
    assert np.sqrt(np.mean((coarse - fine[::4][: len(coarse)]) ** 2)) < 2e-3 * fine.std()


def test_heat_softens_only_where_the_power_is_known():
    heated = replace(MODEL, effects=(active("viscous_heating"),))
    cold = replace(sine(), power=None)
    assert np.array_equal(simulate(heated, cold).force, simulate(MODEL, cold).force)


def test_a_lip_keeps_its_force_through_the_noise_of_a_rest():
    seal = replace(MODEL, effects=(active("seal_friction", "presliding"),))
    # The estimated motion of resting rods had 0.04 to 0.2 um, most of it slow.
    noise = 1e-7 * np.random.default_rng(0).standard_normal(4000)
    x = np.concatenate([np.linspace(0.0, 1e-3, 1000), 1e-3 + noise])
    motion = DamperMotion(x, *np.zeros((2, len(x))), *np.zeros((3, 0, len(x))), ())
    stroke = Excitation(1e3, x, *np.zeros((3, len(x))))
    force = compute_parallel_force(seal, stroke, motion)[1000:]
    assert force[-500:].mean() == pytest.approx(force[:500].mean(), rel=0.03)
    assert force.mean() > 5.0
