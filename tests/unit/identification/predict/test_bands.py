"""95 % band of a prediction, on logs and on planned strokes."""

import json
from dataclasses import replace

import numpy as np
import pytest

from identification.commands.identify import predict
from identification.documents import Forecast
from identification.documents.force_series import write_force_series
from identification.errors import IdentificationError
from identification.experiment_design.planned_strokes import PlannedStrokes
from identification.predict.forecast import forecast_force
from identification.predict.predict import predict_log
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.laboratory import LABORATORY, NOISE, SLOW, recording, stretch


@pytest.mark.parametrize("seed", [11, 12, 13])
def test_the_band_contains_95_percent_of_the_samples_of_a_validation_stroke(fit, seed):
    unseen = recording(stretch("unseen", 0.012, 1.5, seed), sha256="2" * 64)
    prediction, series = predict_log(fit, unseen)
    lower, upper = series.band
    assert 0.93 < prediction.band.coverage < 0.97
    assert prediction.band.coverage == pytest.approx(np.mean((lower <= series.force) & (series.force <= upper)))
    assert prediction.band.half_width_n == pytest.approx(1.96 * NOISE, rel=0.1)
    assert prediction.band.note == ""


def test_an_uncertain_damper_has_a_wider_band(fit):
    unseen = recording(SLOW, sha256="3" * 64)
    vague = fit.model_copy(update={"covariance": (1e4 * np.array(fit.covariance)).tolist()})
    sharp, wide = (predict_log(f, unseen)[0].band for f in (fit, vague))
    assert wide.parameters_n > 30 * sharp.parameters_n - 1.0
    assert wide.half_width_n > 2 * sharp.half_width_n
    assert wide.coverage > 0.99


def test_a_misfit_beyond_the_noise_floor_widens_the_band(fit):
    errors = fit.rmse_n.model_copy(update={"train": 3 * fit.noise_floor_n})
    misfit = fit.model_copy(update={"rmse_n": errors})
    assert predict_log(misfit, recording(SLOW, sha256="3" * 64))[0].band.noise_n == pytest.approx(
        3 * NOISE, rel=0.1
    )


def test_the_note_of_a_band_names_its_limitations(fit):
    blind = fit.coordinates["eta"].model_copy(update={"ci95": None})
    unseen = fit.model_copy(update={"coordinates": fit.coordinates | {"eta": blind}})
    assert "did not observe eta" in predict_log(unseen, recording(SLOW, sha256="3" * 64))[0].band.note
    beyond = recording(replace(SLOW, drive=1.5 * SLOW.drive), sha256="3" * 64)
    assert "fitted from 0 to 0.5" in predict_log(fit, beyond)[0].band.note
    older = fit.model_copy(update={"covariance": None})
    assert "no covariance" in predict_log(older, recording(SLOW, sha256="3" * 64))[0].band.note


def planned(unit="V"):
    t = np.arange(2000) / 1000
    w = 2 * np.pi * 2.0
    x = 0.008 * np.sin(w * t)
    return PlannedStrokes(
        "p", unit, Excitation(1000.0, x, 0.008 * w * np.cos(w * t), -w * w * x, np.full(2000, 0.3)), ()
    )


def test_planned_strokes_get_a_force_and_a_band(fit, tmp_path):
    document, series = forecast_force(fit, planned())
    true = simulate(SimulationModel(LABORATORY), planned().excitation).force
    lower, upper = series.band
    assert np.mean((lower <= true) & (true <= upper)) > 0.99
    assert document.largest_force_n == pytest.approx(np.abs(true).max(), rel=0.02)
    assert document.band.coverage is None
    write_force_series(tmp_path / "s.csv", series)
    head = (tmp_path / "s.csv").read_text().splitlines()[0]
    assert head.endswith("voltage_v,lower_force_n,upper_force_n")


def test_strokes_with_another_unit_of_the_drive_are_refused(fit):
    with pytest.raises(IdentificationError, match="driven in A"):
        forecast_force(fit, planned("A"))


def test_the_command_reads_planned_strokes_from_their_file(fit, tmp_path):
    (tmp_path / "fit.json").write_text(fit.model_dump_json(by_alias=True))
    stroke = planned().excitation
    channels = np.stack([stroke.displacement, stroke.velocity, stroke.acceleration, stroke.drive])
    info = {"method": "p", "rate_hz": 1000.0, "drive_unit": "V", "additions": []}
    np.savez(tmp_path / "planned.npz", plan=channels, info=json.dumps(info))
    predict(tmp_path / "fit.json", str(tmp_path / "planned.npz"), tmp_path / "forecast.json", free="")
    document, _ = forecast_force(fit, planned())
    assert Forecast.model_validate_json((tmp_path / "forecast.json").read_bytes()) == document


def test_an_argument_that_is_neither_log_nor_planned_strokes_names_the_commands(tmp_path):
    with pytest.raises(IdentificationError, match=r"mrbench run METHOD --dry-run --planned FILE\.npz"):
        predict(tmp_path / "fit.json", "nonsense", tmp_path / "forecast.json", free="")
