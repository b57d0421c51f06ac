"""Effects as terms of the local network's residuals: their slopes, and what a training with them finds."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_problem import TRUTH, network_on, problem
from numpy.random import default_rng

from identification.damper.effects import EFFECTS
from identification.effect_choice import EffectChoice
from identification.errors import IdentificationError
from identification.pinn.effect_terms import takes
from identification.pinn.local_rows import Weights
from identification.pinn.settings import read_settings
from identification.pinn.train import train
from identification.simulate import ActiveEffect

STEP = 1e-6
SPRING = ActiveEffect(EFFECTS["gas_spring"], (150.0, 0.03))
LATE = ActiveEffect(EFFECTS["force_delay"], (3e-3,))
BEYOND = {"clevis_backlash", "fixture_compliance", "force_filter"}
TAKEN = [EffectChoice(e.name, f.name) for e in EFFECTS.values() for f in e.forms if takes(f)]
SEVERAL = [
    tuple(EffectChoice.of(name) for name in names)
    for names in (
        ("force_delay", "gas_spring", "moving_mass"),
        ("displacement_delay", "displacement_nonlinearity", "coil_lag", "shear_thinning"),
    )
]


def with_usual_size(*choices):
    """A problem with effects, and shared unknowns beside the truth with the effects at their usual size."""
    given = problem((0.1, 0.4), 0.8).with_effects(choices)
    piece = given.pieces[0]
    warm = replace(piece.stroke, power=np.abs(piece.force * piece.stroke.velocity))
    given = replace(given, pieces=(replace(piece, stroke=warm),))
    sizes = [c.to_search(tuple(q.scale for q in c.quantities)) for c in choices]
    q = given.space.to_search(TRUTH) + 0.05 * default_rng(0).standard_normal(13)
    return given, np.concatenate([q, [0.3, -0.2], *sizes])


@pytest.mark.parametrize(
    "choices",
    [*((choice,) for choice in TAKEN), *SEVERAL],
    ids=lambda choices: "+".join(f"{c.name}-{c.form_name}" for c in choices),
)  # fmt: skip
def test_rows_with_effects_have_the_slopes_of_finite_differences(choices):
    given, unknowns = with_usual_size(*choices)
    compare_slopes(given, unknowns)


def test_rows_of_logs_that_differ_have_the_slopes_of_finite_differences():
    first, second = problem((0.1, 0.4), 0.8, pieces=2).pieces
    given = replace(problem((0.1, 0.4), 0.8), pieces=(first, replace(second, log=1)), own=("offset", "viscosity"))
    given = given.with_effects((EffectChoice.of("orifice_turbulence", "power"),))
    q = given.space.to_search(TRUTH) + 0.05 * default_rng(0).standard_normal(13)
    size = [quantity.scale for quantity in given.effects[0].quantities]
    compare_slopes(given, np.concatenate([q, [0.3, -0.2], given.effects[0].to_search(tuple(size)), [0.7, -0.4]]))


def compare_slopes(given, unknowns):
    network, loss = network_on(given)
    weights = Weights(7.0, given.noise)
    rows = loss.rows(unknowns, network.heads, weights, slopes=True)
    for k in range(len(unknowns)):
        step = np.zeros(len(unknowns))
        step[k] = STEP
        high, low = (loss.rows(unknowns + way, network.heads, weights, slopes=False) for way in (step, -step))
        moved = [(above.all - below.all) / (2 * STEP) for above, below in zip(high, low, strict=True)]
        largest = max(float(np.abs(rows).max()) for rows in moved)
        assert largest > 0.0
        for row, expected in zip(rows, moved, strict=True):
            found = row.slopes[..., k - len(unknowns)]
            assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * largest + 1e-7)


@pytest.mark.parametrize("effects", [(SPRING,), (SPRING, LATE)], ids=["one", "two"])
def test_a_training_with_effects_inside_finds_them_and_the_law_beside_them(effects):
    given = replace(problem(effects=effects), delay_limit=3.0)
    choices = tuple(EffectChoice.of(e.effect.name) for e in effects)
    found = train(given.with_effects(choices), read_settings("local"))
    assert found.accepted
    assert found.simulation.train == pytest.approx(given.noise, rel=0.03)
    assert found.reconstruction.train == pytest.approx(given.noise, rel=0.03)
    apart = (np.array(found.coordinates) - np.array(TRUTH)) / found.deviations
    assert np.abs(apart).max() < 4.0
    wanted, there = (np.concatenate([e.values for e in some]) for some in (effects, found.effects))
    assert (np.abs(there - wanted) < 4.0 * found.effect_deviations).all()


def test_the_law_alone_does_not_reach_the_noise_where_an_effect_is_at_work():
    given = problem(effects=(SPRING,))
    alone = train(given, read_settings("local"))
    assert alone.simulation.train > 1.2 * given.noise


@pytest.mark.parametrize("name", sorted(BEYOND))
def test_effects_that_would_be_a_state_of_their_own_are_refused_in_words(name):
    with pytest.raises(IdentificationError, match=f"{name} .* a state that the"):
        train(problem().with_effects((EffectChoice.of(name),)), read_settings("local"))


@pytest.mark.parametrize("preset", ["global", "paper"])
def test_networks_that_know_the_law_alone_refuse_effects(preset):
    with pytest.raises(IdentificationError, match="say --preset local"):
        train(problem().with_effects((EffectChoice.of("gas_spring"),)), read_settings(preset))
