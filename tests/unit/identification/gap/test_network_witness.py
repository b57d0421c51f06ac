"""The network as a second witness of what a diagnosis names."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_runs import run

from identification.effect_choice import EffectChoice
from identification.gap import witness
from identification.gap.diagnose import diagnose, diagnosed_problem, prepare
from identification.gap.explain import Effort, fit_with
from identification.gap.words import summary


def rubbing(x, v):
    """A seal that rubs, with a sharper turn than the library's."""
    return 25.0 * np.tanh(v / 1e-3)


@pytest.fixture(scope="module")
def prepared():
    return prepare([run(rubbing)])


@pytest.fixture(scope="module")
def answer():
    return diagnose([run(rubbing)], witness=True).diagnosis


def heard(given, fit):
    return witness.hear(fit, given, "V", 1, lambda what, error: None)


def test_the_network_finds_the_size_of_the_named_effect_by_itself(answer):
    (named,) = answer.effects
    assert named.name == "seal_friction"
    said = answer.witness
    assert said.agrees, said.said
    assert set(said.effects) == {"seal_friction"}
    own, there = said.effects["seal_friction"]["sliding"], named.parameters["sliding"]
    assert own.unit == there.unit == "N"
    assert own.ci95[0] <= own.value <= own.ci95[1]
    assert own.value == pytest.approx(there.value, rel=0.05)
    assert own.value != there.value, "a copy would be no witness"
    assert said.seconds > 0.0
    assert said.said.removesuffix(".") in summary(answer)


def test_nothing_is_asked_of_it_where_nothing_is_named():
    assert diagnose([run()], witness=True).diagnosis.witness is None


def test_where_the_fit_has_gone_astray_it_says_in_what(prepared):
    given = diagnosed_problem(prepared.assembled, prepared.judge.fitted_pieces())
    rubs = (EffectChoice.of("seal_friction"),)
    fit = fit_with(given, rubs, effort=Effort(thin=2))
    unknowns = fit.minimum.unknowns.copy()
    unknowns[given.first_effect] += 1.0
    astray = replace(fit, minimum=replace(fit.minimum, unknowns=unknowns))
    said = heard(given.with_effects(rubs), astray)
    assert said.agrees is False
    assert "seal_friction.sliding" in said.said
    assert "trust neither" in said.said


@pytest.mark.parametrize("name", ["clevis_backlash", "fixture_compliance"])
def test_it_says_why_it_cannot_speak_of_a_mounting_that_moves(prepared, name):
    given = diagnosed_problem(prepared.assembled, prepared.judge.fitted_pieces())
    said = heard(given.with_effects((EffectChoice.of(name),)), None)
    assert said.agrees is None
    assert name in said.said
    assert said.effects == {}


def test_it_knows_that_every_run_has_another_zero_of_the_load_cell():
    shifted = run(lambda x, v: rubbing(x, v) + 8.0, seed=1)
    said = diagnose([run(rubbing), shifted], witness=True).diagnosis.witness
    assert said.agrees, said.said
    assert said.effects["seal_friction"]["sliding"].value == pytest.approx(25.0, rel=0.1)
