"""The 95 % band of a prediction: as wide as the record scatters, on logs and on strokes that are only planned."""

from dataclasses import replace

import numpy as np
import pytest
from test_identify import FAST, LABORATORY, NOISE, SLOW, fit, recording, stretch  # noqa: F401

from identification.errors import IdentificationError
from identification.forecast import forecast, planned_strokes
from identification.foresight.planned import Planned
from identification.predict import predict_log
from identification.series import write_series
from identification.simulate import Setting, Stroke, simulate


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_the_band_holds_ninety_five_of_a_hundred_unseen_samples(fit, seed):  # noqa: F811
    unseen = recording(stretch("unseen", 0.012, 1.5, seed), sha256="2" * 64)
    prediction, series = predict_log(fit, unseen)
    lower, upper = series.band
    assert 0.93 < prediction.band.inside < 0.97
    assert prediction.band.inside == pytest.approx(np.mean((lower <= series.force) & (series.force <= upper)))
    assert prediction.band.half_width_n == pytest.approx(1.96 * NOISE, rel=0.1)
    assert prediction.band.note == ""


def test_a_damper_that_is_known_badly_has_a_wider_band(fit):  # noqa: F811
    unseen = recording(SLOW, sha256="3" * 64)
    vague = fit.model_copy(update={"covariance": (1e4 * np.array(fit.covariance)).tolist()})
    sharp, wide = (predict_log(f, unseen)[0].band for f in (fit, vague))
    assert wide.parameters_n > 30 * sharp.parameters_n - 1.0
    assert wide.half_width_n > 2 * sharp.half_width_n
    assert wide.inside > 0.99


def test_what_the_fit_left_beyond_its_floor_widens_the_band(fit):  # noqa: F811
    errors = fit.rmse_n.model_copy(update={"train": 3 * fit.noise_floor_n})
    misfit = fit.model_copy(update={"rmse_n": errors})
    assert predict_log(misfit, recording(SLOW, sha256="3" * 64))[0].band.noise_n == pytest.approx(
        3 * NOISE, rel=0.1
    )


def test_the_band_says_where_it_cannot_be_trusted(fit):  # noqa: F811
    blind = fit.coordinates["eta"].model_copy(update={"ci95": None})
    unseen = fit.model_copy(update={"coordinates": fit.coordinates | {"eta": blind}})
    assert "never saw eta" in predict_log(unseen, recording(SLOW, sha256="3" * 64))[0].band.note
    beyond = recording(replace(SLOW, drive=1.5 * SLOW.drive), sha256="3" * 64)
    assert "fitted from 0 to 0.5" in predict_log(fit, beyond)[0].band.note
    older = fit.model_copy(update={"covariance": None})
    assert "no covariance" in predict_log(older, recording(SLOW, sha256="3" * 64))[0].band.note


def planned(unit="V"):
    t = np.arange(2000) / 1000
    w = 2 * np.pi * 2.0
    x = 0.008 * np.sin(w * t)
    return Planned("p", unit, Stroke(1000.0, x, 0.008 * w * np.cos(w * t), -w * w * x, np.full(2000, 0.3)), ())


def test_planned_strokes_get_a_force_and_a_band(fit, tmp_path):  # noqa: F811
    document, series = forecast(fit, planned())
    true = simulate(Setting(LABORATORY), planned().stroke).force
    lower, upper = series.band
    assert np.mean((lower <= true) & (true <= upper)) > 0.99
    assert document.largest_force_n == pytest.approx(np.abs(true).max(), rel=0.02)
    assert document.band.inside is None
    write_series(tmp_path / "s.csv", series)
    head = (tmp_path / "s.csv").read_text().splitlines()[0]
    assert head.endswith("voltage_v,lower_force_n,upper_force_n")


def test_strokes_driven_otherwise_are_refused(fit):  # noqa: F811
    with pytest.raises(IdentificationError, match="driven in A"):
        forecast(fit, planned("A"))


def test_what_is_neither_log_nor_method_is_refused(tmp_path):
    refusing = ("false",)
    with pytest.raises(IdentificationError, match="is no log, and as a method"):
        planned_strokes("nonsense", refusing)
