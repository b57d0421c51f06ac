"""Noise, band and limitations of a prediction against numbers computed by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting.dataset import (
    HoldOut,
)
from identification.predict.bands import (
    ForceUncertainty,
    _describe_limitations,
    compute_limits,
    estimate_record_noise,
    make_band,
)
from identification.predict.predict import _compute_shrinkage, _read_hold_out


def fit_with(train=5.0, floor=3.0, low=0.0, high=0.5, covariance=((1.0,),), **settings):
    return SimpleNamespace(
        rmse_n=SimpleNamespace(train=train), noise_floor_n=floor, drive_range=(low, high), drive_unit="V",
        covariance=covariance, provenance=SimpleNamespace(settings=settings),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("train", "floor", "noise"), [(5.0, None, 5.0), (5.0, 1.0, 17.0**0.5), (2.9, None, 3.0), (2.9, 1.0, 1.0)]
)
def test_the_misfit_of_the_fit_adds_to_the_noise_of_a_record(train, floor, noise):
    assert estimate_record_noise(fit_with(train), floor) == pytest.approx(noise)


def test_a_band_has_the_width_of_noise_and_parameters():
    uncertainties = [ForceUncertainty(np.array([4.0, 0.0, 4.0]), 3.0), ForceUncertainty(np.array([0.0]), 1.0)]
    errors = [np.array([9.7, -5.8, 9.9]), np.array([-2.0])]
    band = make_band(fit_with(), uncertainties, errors, [np.array([0.0, 0.5])], set())
    assert (band.half_width_n, band.widest_n) == pytest.approx((1.959964 * 4.0, 1.959964 * 5.0))
    assert (band.noise_n, band.parameters_n) == pytest.approx((5.0**0.5, 8.0**0.5))
    assert band.coverage == 0.5
    assert make_band(fit_with(), uncertainties, None, [np.array([0.0])], set()).coverage is None
    low, high = compute_limits(np.array([1.0, 2.0, 3.0]), uncertainties[0])
    assert (low[1], high[1], high[0]) == pytest.approx((2.0 - 5.879892, 2.0 + 5.879892, 1.0 + 9.79982))


@pytest.mark.parametrize(
    ("drives", "outside"),
    [
        ([(0.0, 0.52)], False),
        ([(0.0, 0.53)], True),
        ([(-0.02, 0.5)], False),
        ([(-0.03, 0.5)], True),
        ([(0.1, 0.2), (0.1, 0.6)], True),
        ([(0.1, 0.6), (0.1, 0.2)], True),
        ([(-0.1, 0.2), (0.1, 0.2)], True),
    ],
)
def test_drives_beyond_a_twentieth_of_the_fitted_range_are_noted(drives, outside):
    note = _describe_limitations(fit_with(), [np.array(d) for d in drives], set())
    assert ("extrapolated linearly" in note) == outside


@pytest.mark.parametrize(("drive", "outside"), [(0.3, False), (0.301, True), (0.299, True)])
def test_a_fit_at_one_drive_is_extrapolated_at_any_other(drive, outside):
    note = _describe_limitations(fit_with(low=0.3, high=0.3), [np.array([drive])], set())
    assert ("extrapolated linearly" in note) == outside


@pytest.mark.parametrize(
    ("before", "after", "part"), [(5.0, 4.0, 9.0 / 16.0), (5.0, 3.0, 1.0), (3.05, 3.0, None), (3.07, 3.0, 1.0)]
)
def test_the_gap_shrinks_by_a_part_of_the_variance_above_the_floor(before, after, part):
    assert _compute_shrinkage(before, after, 3.0) == pytest.approx(part)


def test_the_hold_out_of_a_fit_is_read_from_its_settings():
    assert _read_hold_out(fit_with()) == HoldOut()
    assert _read_hold_out(fit_with(hold_out="a,b*", hold_out_after=0.8)) == HoldOut(("a", "b*"), 0.8)
