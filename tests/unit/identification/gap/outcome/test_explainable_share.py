"""The explainable share separates structure from noise."""

import numpy as np
from numpy.random import default_rng

from identification.fitting import assemble
from identification.gap.outcome.explainable_share import build_features, estimate_explainable_share
from tests.support.candidate_pools import record


def test_structure_is_explainable_and_noise_is_not():
    random = default_rng(0)
    features = random.standard_normal((8000, 4))
    noise = random.standard_normal(8000)
    train = np.arange(8000) % 4 != 2
    structure = 3.0 * np.sin(features[:, 0]) * features[:, 1]
    assert estimate_explainable_share(features, structure + noise, train, ~train, 1.0) > 0.8
    assert estimate_explainable_share(features, 2.0 * noise, train, ~train, 1.0) < 0.1


def test_at_the_floor_nothing_is_explainable():
    features, noise = default_rng(0).standard_normal((400, 2)), default_rng(1).standard_normal(400)
    train = np.arange(400) % 2 == 0
    assert estimate_explainable_share(features, 0.5 * noise, train, ~train, 1.0) == 0.0


def test_features_of_a_recording_are_standardised():
    dataset = assemble([record()])
    features = build_features(dataset.pieces)
    assert len(features) == len(dataset.pieces[0].force)
    assert np.allclose(features.mean(axis=0), 0.0, atol=1e-9)
    assert np.allclose(features.std(axis=0), 1.0)
