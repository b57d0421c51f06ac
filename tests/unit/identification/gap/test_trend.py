import json

import jsonschema
import numpy as np
import pytest
from made_up_runs import run

from identification import schemas
from identification.damper.effects.seal_friction import CREEP
from identification.errors import NothingToFit
from identification.gap.trend import bent, trend

WEAR = (0.0, 0.0, 0.0, 10.0, 20.0, 30.0)
"""[N] dry friction of the seal in six runs."""


def rubbing(friction):
    return lambda x, v: friction * np.tanh(v / (3 * CREEP))


@pytest.fixture(scope="module")
def life():
    runs = [run(rubbing(friction), seed=number) for number, friction in enumerate(WEAR)]
    named = [made.path.with_name(f"run{number}.mcap") for number, made in enumerate(runs)]
    return trend([made.__class__(**{**vars(made), "path": path}) for made, path in zip(runs, named, strict=True)])


def test_a_growing_friction_is_found_in_every_run_and_since_when_is_said(life):
    assert "seal_friction" in life.effects
    friction = next(c for c in life.changes if c.quantity == "seal_friction.sliding")
    assert friction.way == "grows"
    assert friction.since == "run3.mcap"
    assert friction.per_run == pytest.approx(10.0, rel=0.25)
    assert [s.value for s in friction.sizes] == pytest.approx(WEAR, abs=5.0)


def test_what_does_not_change_is_called_steady(life):
    steady = {c.quantity for c in life.changes if c.way == "steady"}
    assert {"F_b", "c0_b", "n", "eta"} <= steady


def test_the_words_name_it_and_what_to_check(life):
    assert "seal_friction.sliding grows by" in life.explanation
    assert "since run3.mcap" in life.explanation
    assert "rod seal" in life.explanation


def test_the_document_is_of_its_schema(life):
    jsonschema.validate(json.loads(life.model_dump_json(by_alias=True)), json.loads(schemas.schema_text("trend")))


def test_two_runs_are_no_trend():
    with pytest.raises(NothingToFit, match="2 runs are no trend"):
        trend([run(), run(seed=1)])


def test_a_bend_is_found_where_it_is():
    found = bent(np.array([1.0, 1.1, 0.9, 1.0, 2.0, 3.0, 4.0]), np.full(7, 0.1))
    assert found.start == 3
    assert found.slope == pytest.approx(1.0, abs=0.05)
    assert found.deviations > 20.0


def test_scatter_beyond_what_runs_claim_is_no_change():
    scattered = np.random.default_rng(3).standard_normal(8)
    assert bent(scattered, np.full(8, 0.01)).deviations < 5.0


def test_runs_that_say_nothing_do_not_count():
    values, deviations = np.array([0.0, 50.0, 0.0, 0.0, 0.0]), np.array([1.0, np.inf, 1.0, 1.0, 1.0])
    assert bent(values, deviations).deviations < 1.0
    assert bent(values, np.full(5, np.inf)).deviations == 0.0
