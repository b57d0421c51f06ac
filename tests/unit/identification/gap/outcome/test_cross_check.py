"""The network estimates the named effects independently of the fit."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting.effect_model import EffectModel
from identification.gap.diagnosis import diagnose, make_diagnosis_problem, prepare_recordings
from identification.gap.fits import FitOptions, fit_jointly
from identification.gap.outcome.cross_check import cross_check_effects
from identification.gap.outcome.explanation import summarise_diagnosis
from identification.progress import ignore_progress
from tests.support.runs import run


def rub(x, v):
    """Friction [N] with a sharper transition than that of the library."""
    return 25.0 * np.tanh(v / 1e-3)


@pytest.fixture(scope="module")
def problem():
    prepared = prepare_recordings([run(rub)])
    return make_diagnosis_problem(prepared.dataset, prepared.evaluation.select_fitted_pieces())


@pytest.fixture(scope="module")
def diagnosis():
    return diagnose([run(rub)], cross_check=True).diagnosis


def test_the_network_agrees_on_the_size_of_the_named_effect(diagnosis):
    (named,) = diagnosis.effects
    assert named.name == "seal_friction"
    check = diagnosis.cross_check
    assert check.consistent, check.message
    assert set(check.effects) == {"seal_friction"}
    network, fit = check.effects["seal_friction"]["sliding"], named.parameters["sliding"]
    assert network.unit == fit.unit == "N"
    assert network.ci95[0] <= network.value <= network.ci95[1]
    assert network.ci95[0] <= fit.value <= network.ci95[1]
    # Sliding and peak of a short recording share the friction: only their sum is known well.
    total = network.value + check.effects["seal_friction"]["peak"].value
    assert total == pytest.approx(fit.value + named.parameters["peak"].value, rel=0.1)
    assert network.value != fit.value, "a copy would not be independent"
    assert check.seconds > 0.0
    assert check.message.removesuffix(".") in summarise_diagnosis(diagnosis)


def test_nothing_is_checked_where_no_effect_is_named():
    assert diagnose([run()], cross_check=True).diagnosis.cross_check is None


def test_a_wrong_fit_is_reported_with_the_parameter_that_differs(problem):
    friction = (EffectModel.from_name("seal_friction"),)
    fit = fit_jointly(problem, friction, options=FitOptions(decimation=2))
    unknowns = fit.minimum.unknowns.copy()
    unknowns[problem.layout.effects.start] += 1.0
    wrong = replace(fit, minimum=replace(fit.minimum, unknowns=unknowns))
    wrong.__dict__["covariance"] = fit.covariance  # as certain as the right one
    check = cross_check_effects(wrong, problem.replace_effects(friction), "V", 1, ignore_progress)
    assert check.consistent is False
    assert "seal_friction.sliding" in check.message
    assert "neither interval of these is reliable" in check.message


@pytest.mark.parametrize("name", ["clevis_backlash", "fixture_compliance"])
def test_an_effect_that_the_network_does_not_support_is_skipped_with_the_reason(problem, name):
    models = (EffectModel.from_name(name),)
    fit = fit_jointly(problem, models, options=FitOptions(decimation=4, starts=1, descents=1, iterations=1))
    check = cross_check_effects(fit, problem.replace_effects(models), "V", 1, ignore_progress)
    assert check.consistent is None
    assert "skipped" in check.message
    assert name in check.message
    assert check.effects == {}


def test_the_zero_of_the_load_cell_may_differ_from_run_to_run():
    shifted = run(lambda x, v: rub(x, v) + 8.0, seed=1)
    check = diagnose([run(rub), shifted], cross_check=True).diagnosis.cross_check
    assert check.consistent, check.message
    friction = check.effects["seal_friction"]
    assert friction["sliding"].value + friction["peak"].value == pytest.approx(25.0, rel=0.1)
