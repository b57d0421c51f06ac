"""Every effect in the simulated chain: exact slopes, nothing at no size, and the rig's own force."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.coordinates import Coordinates
from identification.damper.effects import EFFECTS
from identification.simulate import SENSITIVITY_COLUMNS, ActiveEffect, SimulationModel, simulate
from identification.simulate.channel import compute_parallel_force
from identification.simulate.motion import DamperMotion
from tests.support.effects import FORMS, IDS, LABORATORY, MEDIUM, active, sine

SETTING = SimulationModel(LABORATORY, y0=1e-4, force_delay=3.3e-4, drive_delay=1e-4)
TOGETHER = [
    ("direction_asymmetry", "clevis_backlash", "force_delay", "gas_spring", "displacement_nonlinearity"),
    ("fixture_compliance", "direction_asymmetry", "gas_spring", "viscous_heating", "coil_lag", "clevis_backlash"),
    ("field_saturation", "magnetic_remanence", "seal_friction", "moving_mass", "force_filter", "force_drift"),
]


def moved(setting, name, relative):
    """The setting with one unknown moved, and the size that the move is relative to."""
    if name in Coordinates._fields:
        value = getattr(setting.coordinates, name)
        return replace(setting, coordinates=setting.coordinates._replace(**{name: value * (1 + relative)})), value
    if name in SENSITIVITY_COLUMNS:
        return replace(setting, **{name: getattr(setting, name) + 1e-3 * relative}), 1e-3
    owner, _, symbol = name.partition(".")
    effects, size = [], 0.0
    for effect in setting.effects:
        values = list(effect.values)
        if effect.effect.name == owner:
            at = [q.symbol for q in effect.form.parameters].index(symbol)
            size = values[at]
            values[at] *= 1 + relative
        effects.append(effect._replace(values=tuple(values)))
    return replace(setting, effects=tuple(effects)), size


def worst_slope(effects, relative=3e-6):
    """Largest difference between slopes and central differences, relative to the slope."""
    setting, stroke, worst = replace(SETTING, effects=effects), sine(), 0.0
    found = simulate(setting, stroke, sensitivities=True)
    for k, name in enumerate(found.columns):
        # A line's frequency counts its periods since the start of the run: a small part of it is a large phase.
        step = relative / 100 if name.endswith("frequency") else relative
        (ahead, size), (behind, _) = moved(setting, name, step), moved(setting, name, -step)
        forces = [simulate(s, stroke, found.step_counts).force for s in (ahead, behind)]
        difference, slope = (forces[0] - forces[1]) / (2 * step), found.sensitivities[:, k] * size
        # A corner of play or of a loop may fall between the two: all but a hundredth of the samples have to agree.
        error = np.sort(np.abs(slope - difference))[: -len(slope) // 100]
        worst = max(worst, np.sqrt(np.mean(error**2)) / np.sqrt(np.mean(slope**2)))
    return worst


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_slopes_agree_with_central_differences(name, form):
    assert worst_slope((active(name, form),)) < 5e-6


@pytest.mark.parametrize("names", TOGETHER, ids=["mounting", "yielding", "coil"])
def test_slopes_of_several_effects_together_agree_with_central_differences(names):
    assert worst_slope(tuple(active(name) for name in names)) < 5e-6


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_an_effect_of_no_size_leaves_the_plain_law(name, form):
    shape = EFFECTS[name].find_form(form)
    none = tuple(
        0.0 if q.low <= 0.0 else value for q, value in zip(shape.parameters, MEDIUM[name][form], strict=True)
    )
    plain = simulate(SETTING, sine()).force
    with_none = simulate(replace(SETTING, effects=(ActiveEffect(EFFECTS[name], none, form),)), sine()).force
    assert np.abs(with_none - plain).max() < 1e-6


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_an_effect_of_medium_size_shows_in_the_force(name, form):
    plain = simulate(SETTING, sine()).force
    force = simulate(replace(SETTING, effects=(active(name, form),)), sine()).force
    assert 0.5 < np.sqrt(np.mean((force - plain) ** 2)) < 0.5 * np.std(plain)


@pytest.mark.parametrize(("name", "form"), FORMS, ids=IDS)
def test_the_force_is_finite_at_every_bound(name, form):
    shape = EFFECTS[name].find_form(form)
    for bound in ("low", "high"):
        for k, quantity in enumerate(shape.parameters):
            values = list(MEDIUM[name][form])
            values[k] = getattr(quantity, bound)
            effect = ActiveEffect(EFFECTS[name], tuple(values), form)
            found = simulate(replace(SETTING, effects=(effect,)), sine(seconds=0.6), sensitivities=True)
            assert np.isfinite(found.force).all()
            assert np.isfinite(found.sensitivities).all()


def test_a_coarser_stroke_keeps_the_steps_of_its_drive():
    stroke = sine()
    fine = simulate(SETTING, stroke).force
    coarse = simulate(SETTING, stroke.decimate(4)).force
    assert np.sqrt(np.mean((coarse - fine[::4][: len(coarse)]) ** 2)) < 2e-3 * fine.std()


def test_heat_softens_only_where_the_power_is_known():
    heated = replace(SETTING, effects=(active("viscous_heating"),))
    cold = replace(sine(), power=None)
    assert np.array_equal(simulate(heated, cold).force, simulate(SETTING, cold).force)


def test_a_lip_keeps_its_force_through_the_noise_of_a_rest():
    seal = replace(SETTING, effects=(active("seal_friction", "presliding"),))
    noise = 3e-7 * np.random.default_rng(0).standard_normal(4000)
    x = np.concatenate([np.linspace(0.0, 1e-3, 1000), 1e-3 + noise])
    motion = DamperMotion(x, *np.zeros((2, len(x))), *np.zeros((3, 0, len(x))), ())
    force = compute_parallel_force(seal, motion, 1e-3)[1000:]
    assert force[-500:].mean() == pytest.approx(force[:500].mean(), rel=0.03)
    assert force.mean() > 5.0
