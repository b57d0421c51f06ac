"""What places of a recording say of one effect more."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.places import evidence, most
from identification.gap.where import Left

RATE, SECONDS, FLOOR = 500.0, 40.0, 2.0
TIME = np.arange(round(RATE * SECONDS)) / RATE
NOISE = FLOOR * default_rng(1).standard_normal(len(TIME))
AFTER_STEPS = np.exp(-(TIME % 1.0) / 0.1)


def left(error, valid=None):
    there = np.ones(len(TIME), bool) if valid is None else valid
    return Left(NOISE + error, 0.0 * TIME, 0.0 * TIME, TIME, there, ((len(TIME), RATE),))


def test_a_small_effect_shows_in_many_places_beside_a_large_error_in_few():
    form = np.where(TIME < 4.0, 40.0, 0.0)
    small = 3.0 * AFTER_STEPS
    assert np.mean(form**2) > 100.0 * np.mean(small**2)
    assert evidence(left(form + small), left(form)) > 5.0


def test_an_error_that_is_only_put_elsewhere_is_no_evidence():
    here, there = np.where(TIME < 4.0, 10.0, 1.0), np.where(TIME < 4.0, 6.0, 2.0)
    assert evidence(left(here), left(there)) < 0.0
    assert np.mean(there**2) < np.mean(here**2)


def test_what_leads_to_the_floor_brings_no_more_than_the_most():
    error = 3.0 * AFTER_STEPS
    assert evidence(left(error), left(0.0 * error)) == pytest.approx(most(left(error), FLOOR), rel=0.2)
    assert most(left(0.0 * error), FLOOR) < 5.0


def test_places_that_were_hardly_measured_do_not_count():
    valid = TIME > 10.0
    wild = np.where(valid, 0.0, 100.0)
    assert evidence(left(wild, valid), left(0.0 * wild, valid)) == pytest.approx(0.0)
