"""Shortlists of screened effects, and gains of joint problems, with hand-made numbers."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import EffectModel
from identification.gap.selection.screening import (
    ScreeningResult,
    _Linearisation,
    _make_difference_step,
    list_effect_models,
    select_shortlist,
)


def make_gain(name, predicted, achieved=0.0, form=0):
    model = list_effect_models([name])[form]
    return ScreeningResult(model, predicted, achieved, np.zeros(0))


def name_shortlist(gains, count=5):
    return [(g.effect_model.name, g.effect_model.form_name) for g in select_shortlist(gains, count)]


def test_a_shortlist_has_the_effects_with_the_largest_gain_of_both_estimates():
    gains = [make_gain("end_stop", 0.5), make_gain("moving_mass", 0.1, 0.6), make_gain("coil_lag", 0.3)]
    assert [name for name, _ in name_shortlist(gains, 2)] == ["moving_mass", "end_stop"]


@pytest.mark.parametrize(("gain", "listed"), [(0.021, True), (0.02, False)])
def test_a_gain_of_two_per_cent_is_too_small(gain, listed):
    assert bool(name_shortlist([make_gain("end_stop", gain)])) == listed


@pytest.mark.parametrize(("second", "forms"), [(0.36, 2), (0.34, 1)])
def test_a_further_form_is_listed_if_it_gains_nearly_as_much(second, forms):
    gains = [make_gain("gas_spring", 0.5, form=1), make_gain("gas_spring", second, form=0)]
    assert len(name_shortlist(gains)) == forms


def make_linearisation(cost, samples):
    return _Linearisation(SimpleNamespace(samples=samples), np.zeros(0), SimpleNamespace(cost=cost), (), (), 49.5)


@pytest.mark.parametrize(("cost", "excess"), [(150.0, 50.0), (100.5, 1.0), (90.0, 1.0)])
def test_the_excess_is_the_cost_beyond_the_noise(cost, excess):
    assert make_linearisation(cost, 100).excess == excess


class ScriptedLinearisation(_Linearisation):
    """A linearisation whose steps achieve stated gains."""

    def _take_step(self, predicted):
        return replace(predicted, achieved_gain=float(predicted.unknowns[0]))


@pytest.mark.parametrize(
    ("achieved", "chosen"),
    [
        pytest.param((0.3, 0.9), 0, id="the first step reduces the error"),
        pytest.param((-2.0, 0.4, 0.9), 1, id="the second one does"),
        pytest.param((-2.0, -1.0), 0, id="none does, and the first predicts most"),
    ],
)
def test_a_step_is_taken_from_the_next_start_where_one_only_increases_the_error(achieved, chosen):
    linearisation = ScriptedLinearisation(SimpleNamespace(samples=1), np.zeros(0), None, (), (), 50.0)
    model = list_effect_models(["force_delay"])[0]
    starts = [ScreeningResult(model, 0.2 - 0.01 * k, 0.0, np.array([a])) for k, a in enumerate(achieved)]
    assert linearisation.take_step(starts).unknowns == starts[chosen].unknowns


def test_mains_interference_starts_at_the_measured_frequency():
    model = list_effect_models(["mains_hum"])[0]
    (start,) = make_linearisation(1.0, 1)._list_starts(model)
    assert start == (*model.form.starts[0][:-1], 49.5)
    lag = EffectModel.from_name("coil_lag")
    assert make_linearisation(1.0, 1)._list_starts(lag) == lag.form.starts


@pytest.mark.parametrize(
    ("column", "start", "absent", "step"),
    [
        (15, 0.0, True, 0.05),  # a size
        (15, 0.94, False, 0.05),
        (15, 0.96, False, -0.05),  # beyond its bound of one
        (16, 0.0, True, 0.0),  # a length of an absent effect
        (16, 0.0, False, 0.03),
        (16, 0.98, False, -0.03),
    ],
)
def test_a_difference_steps_over_a_size_or_the_logarithm_of_a_length(column, start, absent, step):
    joint = SimpleNamespace(
        effects=[SimpleNamespace(log_mask=np.array([False, True]))],
        layout=SimpleNamespace(effects=slice(15, 17)),
        get_bounds=lambda: (-np.ones(17), np.ones(17)),
    )
    unknowns = np.zeros(17)
    unknowns[column] = start
    expected = np.zeros(17)
    expected[column] = step
    assert _make_difference_step(joint, unknowns, column, absent).tolist() == expected.tolist()
