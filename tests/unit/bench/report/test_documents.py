import json

import numpy as np
import pytest

from bench.errors import ReportError
from bench.report.documents import read_fit, read_prediction
from bench.report.series import predict, read_series
from tests.support.reports import series, write_log
from tests.support.result_documents import fit_document, write_fit


def test_a_fit_is_read_and_keys_that_no_report_shows_are_ignored(tmp_path):
    fit = read_fit(write_fit(tmp_path / "fit.json", "abc", something_new=1))
    assert fit.coordinates["F_a"].value == 44.862
    assert fit.has_fitted("abc")
    assert not fit.has_fitted("def")


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nonsense",
        "[]",
        json.dumps(fit_document() | {"schema": "mrbench.fit/9"}),
        '{"schema": "mrbench.fit/1"}',
    ],
)
@pytest.mark.parametrize("read", [read_fit, read_prediction])
def test_an_invalid_document_gives_a_message_of_one_line(tmp_path, text, read):
    path = tmp_path / "bad.json"
    path.write_text(text)
    with pytest.raises(ReportError, match=r"bad\.json: not a .* written by `mrbench") as caught:
        read(path)
    assert "\n" not in str(caught.value)


def test_a_missing_file_gives_a_message_of_one_line(tmp_path):
    with pytest.raises(ReportError, match="cannot be read"):
        read_fit(tmp_path / "none.json")


def test_a_series_is_read_back(tmp_path):
    np.savez(tmp_path / "s.npz", **series().arrays)
    assert read_series(tmp_path / "s.npz").arrays["simulated"].shape == (3000,)


def test_an_invalid_series_is_refused(tmp_path):
    (tmp_path / "bad.npz").write_text("nonsense")
    np.savez(tmp_path / "few.npz", time=np.zeros(3))
    np.savez(tmp_path / "torn.npz", **{**series().arrays, "force": np.zeros(3)})
    for name in ("none", "bad", "few"):
        with pytest.raises(ReportError, match="not a series"):
            read_series(tmp_path / f"{name}.npz")
    with pytest.raises(ReportError, match="differ in length"):
        read_series(tmp_path / "torn.npz")


def test_a_fit_that_cannot_be_simulated_gives_the_message_of_the_failed_command(tmp_path):
    log = write_log(tmp_path / "run.mcap")
    (tmp_path / "fit.json").write_text("{}")
    with pytest.raises(ReportError, match=r"cannot be simulated on .*run\.mcap: ") as caught:
        predict(tmp_path / "fit.json", log)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)


def test_a_prediction_that_takes_too_long_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr("bench.report.series.PREDICTION_TIMEOUT", 0.01)
    with pytest.raises(ReportError, match=r"stopped at its time limit of 0\.01 s"):
        predict(tmp_path / "fit.json", tmp_path / "run.mcap")
