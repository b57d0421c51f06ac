"""Effect terms in the residuals of the network of elements: their Jacobian, and trainings with effects."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng

from identification.damper.effects import EFFECTS
from identification.errors import IdentificationError
from identification.fitting.effect_model import EffectModel
from identification.pinn.common.effect_terms import is_supported
from identification.pinn.common.settings import read_settings
from identification.pinn.elements.residuals import LossWeights
from identification.pinn.training import train
from identification.simulate import ActiveEffect
from tests.support.pinn_problem import TRUTH, make_network, make_problem

STEP = 1e-6
SPRING = ActiveEffect(EFFECTS["gas_spring"], (150.0, 0.03))
DELAY = ActiveEffect(EFFECTS["force_delay"], (3e-3,))
UNSUPPORTED = {"clevis_backlash", "fixture_compliance", "force_filter"}
SUPPORTED = [EffectModel(e, f.name) for e in EFFECTS.values() for f in e.forms if is_supported(f)]
COMBINATIONS = [
    tuple(EffectModel.from_name(name) for name in names)
    for names in (
        ("force_delay", "gas_spring", "moving_mass"),
        ("displacement_delay", "displacement_nonlinearity", "coil_lag", "shear_thinning"),
    )
]


def make_effect_problem(*models):
    """Return a problem with effects, and unknowns near the truth with the effects at their typical size."""
    problem = make_problem((0.1, 0.4), 0.8).replace_effects(models)
    piece = problem.pieces[0]
    excitation = replace(piece.excitation, power=np.abs(piece.force * piece.excitation.velocity))
    problem = replace(problem, pieces=(replace(piece, excitation=excitation),))
    sizes = [m.to_search(tuple(q.scale for q in m.quantities)) for m in models]
    q = problem.space.to_search(TRUTH) + 0.05 * default_rng(0).standard_normal(13)
    return problem, np.concatenate([q, [0.3, -0.2], *sizes])


@pytest.mark.parametrize(
    "models",
    [*((model,) for model in SUPPORTED), *COMBINATIONS],
    ids=lambda models: "+".join(f"{m.name}-{m.form_name}" for m in models),
)  # fmt: skip
def test_the_jacobian_with_effects_is_that_of_finite_differences(models):
    assert_jacobian_is_that_of_finite_differences(*make_effect_problem(*models))


def test_the_jacobian_of_logs_that_differ_is_that_of_finite_differences():
    first, second = make_problem((0.1, 0.4), 0.8, pieces=2).pieces
    problem = replace(
        make_problem((0.1, 0.4), 0.8), pieces=(first, replace(second, log=1)), per_log=("offset", "viscosity")
    )
    problem = problem.replace_effects((EffectModel.from_name("orifice_turbulence", "power"),))
    q = problem.space.to_search(TRUTH) + 0.05 * default_rng(0).standard_normal(13)
    effect = problem.effects[0]
    size = effect.to_search(tuple(quantity.scale for quantity in effect.quantities))
    assert_jacobian_is_that_of_finite_differences(problem, np.concatenate([q, [0.3, -0.2], size, [0.7, -0.4]]))


def assert_jacobian_is_that_of_finite_differences(problem, unknowns):
    network, loss = make_network(problem)
    weights = LossWeights(7.0, problem.noise)
    residuals = loss.compute_weighted_residuals(unknowns, network.output_weights, weights, jacobian=True)
    without_influence = 0
    for k in range(len(unknowns)):
        step = np.zeros(len(unknowns))
        step[k] = STEP
        high, low = (
            loss.compute_weighted_residuals(unknowns + change, network.output_weights, weights, jacobian=False)
            for change in (step, -step)
        )
        columns = [(above.vector - below.vector) / (2 * STEP) for above, below in zip(high, low, strict=True)]
        largest = max(float(np.abs(column).max()) for column in columns)
        without_influence += largest == 0.0
        for batch_residuals, expected in zip(residuals, columns, strict=True):
            column = batch_residuals.jacobian[..., k - len(unknowns)]
            assert column == pytest.approx(expected, rel=1e-4, abs=1e-5 * largest + 1e-7)
    # A play that is saturated at the first field does not show how the field came there.
    assert without_influence <= 1


@pytest.mark.parametrize("effects", [(SPRING,), (SPRING, DELAY)], ids=["one", "two"])
def test_a_training_with_effects_identifies_them_together_with_the_law(effects):
    problem = replace(make_problem(effects=effects), delay_limit=3.0)
    models = tuple(EffectModel.from_name(e.effect.name) for e in effects)
    result = train(problem.replace_effects(models), read_settings("elements"))
    assert result.accepted
    assert result.simulation.train == pytest.approx(problem.noise, rel=0.03)
    assert result.reconstruction.train == pytest.approx(problem.noise, rel=0.03)
    distances = (np.array(result.coordinates) - np.array(TRUTH)) / result.deviations
    assert np.abs(distances).max() < 4.0
    true, estimated = (np.concatenate([e.values for e in active]) for active in (effects, result.effects))
    assert (np.abs(estimated - true) < 4.0 * result.effect_deviations).all()


def test_the_law_alone_does_not_reach_the_noise_of_a_recording_with_an_effect():
    problem = make_problem(effects=(SPRING,))
    result = train(problem, read_settings("elements"))
    assert result.simulation.train > 1.2 * problem.noise


@pytest.mark.parametrize("name", sorted(UNSUPPORTED))
def test_effects_that_would_be_a_third_state_are_refused(name):
    with pytest.raises(IdentificationError, match=f"{name} .* a state that the"):
        train(make_problem().replace_effects((EffectModel.from_name(name),)), read_settings("elements"))


@pytest.mark.parametrize("preset", ["dense", "paper"])
def test_networks_that_learn_the_law_alone_refuse_effects(preset):
    with pytest.raises(IdentificationError, match="use --preset elements"):
        train(make_problem().replace_effects((EffectModel.from_name("gas_spring"),)), read_settings(preset))
