"""Changes over the runs of one specimen."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from identification.damper.effects.seal_friction import CREEP_SPEED
from identification.documents import Trend
from identification.errors import UnusableDataError
from identification.gap.trend import analyse_trend, find_change_point
from tests.support.runs import run

WEAR = (0.0, 0.0, 0.0, 10.0, 20.0, 30.0)
"""Friction of the seal in six runs [N]."""


def rub(friction):
    return lambda x, v: friction * np.tanh(v / (3 * CREEP_SPEED))


@pytest.fixture(scope="module")
def trend():
    runs = [run(rub(friction), seed=number) for number, friction in enumerate(WEAR)]
    return analyse_trend([replace(r, path=r.path.with_name(f"run{k}.mcap")) for k, r in enumerate(runs)])


def test_a_rising_friction_is_found_with_its_first_run(trend):
    assert "seal_friction" in trend.effects
    friction = next(c for c in trend.changes if c.quantity == "seal_friction.sliding")
    assert friction.direction == "rising"
    assert friction.since == "run3.mcap"
    assert friction.change_per_run == pytest.approx(10.0, rel=0.25)
    assert [s.value for s in friction.values] == pytest.approx(WEAR, abs=5.0)


def test_coordinates_that_do_not_change_are_steady(trend):
    steady = {c.quantity for c in trend.changes if c.direction == "steady"}
    assert {"F_b", "c0_b", "n", "eta"} <= steady


def test_the_explanation_names_the_change_and_a_check(trend):
    assert "seal_friction.sliding rises by" in trend.explanation
    assert "since run3.mcap" in trend.explanation
    assert "rod seal" in trend.explanation


def test_the_document_follows_its_schema(trend):
    jsonschema.validate(json.loads(trend.model_dump_json(by_alias=True)), Trend.model_json_schema(by_alias=True))


def test_two_runs_are_refused():
    with pytest.raises(UnusableDataError, match="at least 3 runs; 2 were given"):
        analyse_trend([run(), run(seed=1)])


def test_a_change_point_is_found_with_its_slope():
    point = find_change_point(np.array([1.0, 1.1, 0.9, 1.0, 2.0, 3.0, 4.0]), np.full(7, 0.1))
    assert point.start == 3
    assert point.slope == pytest.approx(1.0, abs=0.05)
    assert point.deviations > 20.0


def test_scatter_beyond_the_deviations_is_not_a_change():
    scattered = np.random.default_rng(3).standard_normal(8)
    assert find_change_point(scattered, np.full(8, 0.01)).deviations < 5.0


def test_runs_with_infinite_deviations_do_not_count():
    values, deviations = np.array([0.0, 50.0, 0.0, 0.0, 0.0]), np.array([1.0, np.inf, 1.0, 1.0, 1.0])
    assert find_change_point(values, deviations).deviations < 1.0
    assert find_change_point(values, np.full(5, np.inf)).deviations == 0.0
