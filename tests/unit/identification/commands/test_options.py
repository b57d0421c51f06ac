"""Options of the commands: defaults, limits, and combinations that are refused."""

from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from identification.commands.design import foresee
from identification.commands.diagnose import diagnose
from identification.commands.identify import _is_recording, _parse_free, predict
from identification.commands.tune import tune
from identification.errors import IdentificationError
from identification.fitting import HoldOut


def run(command, *arguments):
    app = typer.Typer()
    app.command()(command)
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture
def requests(monkeypatch):
    """Requests of studies, which are not run."""
    asked = []

    def run_study(request, workers, report):
        asked.append((request, workers))
        raise IdentificationError("not run")

    monkeypatch.setattr("identification.tuning.run_study", run_study)
    return asked


@pytest.mark.parametrize(
    ("options", "weight"),
    [((), 0.001), (("--time-weight", 0.02), 0.02), (("--price", 0.3), 0.3), (("--price", 0), 0.0)],
)
def test_a_second_of_training_weighs_a_thousandth_unless_another_weight_is_given(
    requests, tmp_path, options, weight
):
    run(tune, "a.mcap", "--out", tmp_path / "p.json", *options)
    ((request, workers),) = requests
    assert (request.time_weight, request.study, workers) == (weight, tmp_path / "p.db", 1)


def test_a_study_may_have_a_file_of_its_own(requests, tmp_path):
    run(tune, "a.mcap", "--out", tmp_path / "p.json", "--study", tmp_path / "s.db", "--workers", 3)
    assert (requests[0][0].study, requests[0][1]) == (tmp_path / "s.db", 3)


@pytest.mark.parametrize("out", ["-", "preset.txt", "preset"])
def test_a_preset_needs_a_json_file(requests, tmp_path, out):
    result = run(tune, "a.mcap", "--out", out if out == "-" else tmp_path / out)
    assert "needs a file whose name ends in .json" in str(result.exception)
    assert requests == []


def test_the_noise_of_planned_strokes_is_positive(tmp_path):
    arguments = (tmp_path / "none.npz", "--out", tmp_path / "d.json", "--noise")
    assert run(foresee, *arguments, 0.0).exit_code == 2
    assert "not a file of planned strokes" in str(run(foresee, *arguments, 1e-3).exception)


@pytest.mark.parametrize(("options", "asked"), [((), False), (("--cross-check",), True), (("--witness",), True)])
def test_a_cross_check_is_run_under_its_present_and_its_former_name(monkeypatch, tmp_path, options, asked):
    given = []

    def record(recordings, simulation, *, cross_check, hold_out, **others):
        assert hold_out == HoldOut()
        given.append((recordings, simulation, cross_check))
        raise IdentificationError("not run")

    monkeypatch.setattr("identification.gap.diagnose", record)
    monkeypatch.setattr("identification.logs.load", lambda path: path)
    run(diagnose, "a.mcap", "--out", tmp_path / "d.json", *options)
    assert given == [([Path("a.mcap")], None, asked)]


def test_a_diagnosis_holds_out_the_strokes_that_are_named(monkeypatch, tmp_path):
    given = []

    def record(recordings, simulation, *, hold_out, **others):
        given.append(hold_out)
        raise IdentificationError("not run")

    monkeypatch.setattr("identification.gap.diagnose", record)
    monkeypatch.setattr("identification.logs.load", lambda path: path)
    run(diagnose, "a.mcap", "--out", tmp_path / "d.json", "--hold-out", "5mm*,25mm*", "--hold-out-after", "0.8")
    assert given == [HoldOut(("5mm*", "25mm*"), 0.8)]


def test_a_log_is_an_mcap_file_or_any_other_file_that_is_no_plan(tmp_path):
    for name in ("x", "a.json", "a.npz", "a.csv"):
        (tmp_path / name).touch()
    assert [_is_recording(str(tmp_path / n)) for n in ("x", "a.csv", "a.json", "a.npz", "none")] == [
        True, True, False, False, False,
    ]  # fmt: skip
    assert _is_recording("missing.mcap")


def test_per_log_parameters_are_those_of_a_log():
    assert _parse_free("") == ()
    assert _parse_free("offset,viscosity") == ("offset", "viscosity")
    for free, reason in (("A", "no recording determines it"), ("offset,k0", "--free k0: every parameter")):
        with pytest.raises(IdentificationError, match=reason):
            _parse_free(free)


@pytest.mark.parametrize(
    ("coverage", "physics", "text"),
    [
        (0.953, None, "; 95.3 % inside the 95 % band of 4.9 N"),
        (None, None, ""),
        ("no band", None, ""),
        (0.95, 3.1, "; 95.0 % inside the 95 % band of 4.9 N; without the learned residual 3.1 N"),
    ],
)
def test_a_prediction_reports_its_error_and_its_band(monkeypatch, tmp_path, capsys, coverage, physics, text):
    alone = None if physics is None else SimpleNamespace(rmse_n=physics)
    band = None if coverage == "no band" else SimpleNamespace(coverage=coverage, half_width_n=4.9)
    prediction = SimpleNamespace(
        band=band, physics=alone, freed=["y0"], rmse_n=2.5, nrmse=0.0125, noise_floor_n=2.4
    )
    monkeypatch.setattr("identification.predict.predict_log", lambda *a, **k: (prediction, None))
    monkeypatch.setattr("identification.documents.write_document", lambda *a: None)
    monkeypatch.setattr("identification.fitting.read_fit_or_model", lambda path: None)
    monkeypatch.setattr("identification.logs.load", lambda path: None)
    predict(tmp_path / "fit.json", "a.mcap", tmp_path / "p.json", None, "")
    errors = "force error 2.5 N (1.2 % of the force's deviation), noise floor 2.4 N"
    assert capsys.readouterr().err.strip() == f"{tmp_path / 'p.json'}: {errors}; freed: y0{text}"


def test_only_a_force_offset_is_estimated_on_another_log(tmp_path):
    with pytest.raises(IdentificationError, match="--free k0: only a force offset"):
        predict(tmp_path / "fit.json", "a.mcap", tmp_path / "p.json", None, "k0")
