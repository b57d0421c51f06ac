"""Basis functions of the hidden layer."""

import numpy as np
import pytest

from identification.pinn.common.activations import ACTIVATIONS
from identification.pinn.elements.hidden_layer import HiddenLayer
from identification.pinn.elements.quadrature import compute_gauss_points


def test_the_hidden_layer_has_two_nodal_functions_and_all_others_vanish_at_both_ends():
    layer = HiddenLayer(60, 20, 3)
    ends = layer.evaluate(np.array([0.0, 1.0]))
    expected = np.zeros((2, 20))
    expected[0, 0] = expected[1, 1] = 1.0
    assert ends == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_derivatives_of_the_basis_functions_are_those_of_finite_differences(activation):
    layer = HiddenLayer(60, 12, 3, activation)
    place = np.linspace(0.05, 0.95, 9)
    slopes, curvatures = layer.differentiate_twice(place)
    assert slopes == pytest.approx(layer.differentiate(place), rel=1e-12)
    differences = (layer.evaluate(place + 1e-5) - layer.evaluate(place - 1e-5)) / 2e-5
    assert differences == pytest.approx(slopes, rel=1e-5, abs=1e-5)
    differences = (layer.differentiate(place + 1e-5) - layer.differentiate(place - 1e-5)) / 2e-5
    assert differences == pytest.approx(curvatures, rel=1e-5, abs=1e-4)


@pytest.mark.parametrize(("units", "rank"), [(160, 40), (200, 48), (300, 64)])
def test_slopes_and_curvatures_of_the_layers_in_use_integrate_to_values_and_slopes(units, rank):
    layer = HiddenLayer(units, rank, 1)
    places, weights = compute_gauss_points(300)
    slopes, curvatures = layer.differentiate_twice(places)
    values, ends = (f(np.array([0.0, 1.0])) for f in (layer.evaluate, layer.differentiate))
    # The mixing of nearly collinear units leaves values a rounding of some 1e-6.
    assert weights @ slopes == pytest.approx(values[1] - values[0], abs=2e-5)
    assert weights @ curvatures == pytest.approx(ends[1] - ends[0], abs=1e-6 * np.abs(slopes).max())
