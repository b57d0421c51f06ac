import hashlib
import json
import sys
from pathlib import Path

import pytest
import typer
import typer.testing

from sim_rig.errors import TrialError
from sim_rig.trial.cases.folder import Seal, TrialFolder
from sim_rig.trial.cases.truth import SealedTruth, read_sealed_truth, write_sealed_truth
from sim_rig.trial.commands import trial
from sim_rig.trial.execution import run as running
from sim_rig.trial.execution.processes import CommandFailedError, run_command
from sim_rig.trial.execution.run import TrialOptions, prepare_truth, run_cases
from sim_rig.trial.scoring.summary import score_trial
from sim_rig.trial.scoring.trial_report import TrialReport
from tests.support.trial import make_diagnosis, make_truth


def silent(task, fraction):
    """Ignore progress."""


@pytest.fixture
def folder(tmp_path):
    trial_folder = TrialFolder(tmp_path / "trial.json")
    trial_folder.prepare()
    return trial_folder


@pytest.fixture
def three(monkeypatch):
    """Three cases without simulation of their sizes, and a double of the recording that writes its arguments."""
    cases = [
        make_truth("gas_spring", id="case_000"),
        make_truth(id="case_001"),
        make_truth("end_stop", id="case_002", seed=5),
    ]
    monkeypatch.setattr(running, "_size_cases", lambda *_: cases)

    def record(method, scenario, seed, log):
        log.write_text(f"{method.name} {scenario.name} {seed}")

    monkeypatch.setattr(running, "_record_from_plant", record)
    return cases


def write_diagnosis_script(tmp_path, text):
    """Return a command that diagnoses by a Python script."""
    script = tmp_path / "diagnose.py"
    script.write_text(text)
    return (sys.executable, str(script))


def diagnose_always(tmp_path, document):
    calls = tmp_path / "calls.txt"
    return write_diagnosis_script(
        tmp_path,
        "import json, sys; from pathlib import Path\n"
        f"calls = Path({str(calls)!r})\n"
        "calls.write_text((calls.read_text() if calls.exists() else '') + Path(sys.argv[1]).name + '\\n')\n"
        f"Path(sys.argv[3]).write_text({json.dumps(document)!r})\n",
    ), calls


def test_the_published_hash_is_that_of_the_sealed_file(folder, three):
    seal, sealed = prepare_truth(folder, TrialOptions(3, 1), silent)
    assert seal.sha256 == hashlib.sha256(folder.truth.read_bytes()).hexdigest()
    assert sealed == SealedTruth(cases=tuple(three))


def test_a_changed_truth_breaks_the_seal(folder):
    sha256 = write_sealed_truth(folder.truth, SealedTruth(cases=(make_truth("gas_spring"),)))
    assert read_sealed_truth(folder.truth, sha256).cases[0].kind == "single"
    folder.truth.write_text(folder.truth.read_text().replace("gas_spring", "gas_Spring"))
    with pytest.raises(TrialError, match="the seal is broken"):
        read_sealed_truth(folder.truth, sha256)


def test_another_trial_in_the_same_folder_is_refused(folder, three):
    prepare_truth(folder, TrialOptions(3, 1), silent)
    with pytest.raises(TrialError, match="contains a trial of 3 cases with seed 1"):
        prepare_truth(folder, TrialOptions(3, 2), silent)


def test_a_trial_runs_to_its_report(folder, three, tmp_path):
    diagnose, _ = diagnose_always(tmp_path, make_diagnosis("explained", "gas_spring"))
    options = TrialOptions(3, 1, workers=2, diagnose=diagnose)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    report = score_trial(folder, options)
    assert [case.correct for case in report.cases] == [True, False, False]
    assert (report.scores.false_alarms.count, report.scores.failures) == (1, 0)
    assert report.scores.confusion["end_stop"] == {"gas_spring": 1}


def test_a_killed_trial_continues(folder, three, tmp_path):
    diagnose, calls = diagnose_always(tmp_path, make_diagnosis("no_gap"))
    options = TrialOptions(3, 1, diagnose=diagnose)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    folder.get_case_files("case_001").outcome.unlink()
    folder.get_case_files("case_001").diagnosis.unlink()
    modified_ns = folder.get_case_files("case_001").log.stat().st_mtime_ns
    run_cases(folder, sealed, options, silent)
    assert calls.read_text().split() == ["case_000.mcap", "case_001.mcap", "case_002.mcap", "case_001.mcap"]
    assert folder.get_case_files("case_001").log.stat().st_mtime_ns == modified_ns


def test_a_failed_diagnosis_is_an_outcome_and_repeated(folder, three, tmp_path):
    broken = write_diagnosis_script(tmp_path, "import sys; sys.exit('mrbench: no result today')")
    options = TrialOptions(3, 1, diagnose=broken)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    report = score_trial(folder, options)
    assert report.scores.failures == 3
    assert "no result today" in report.cases[0].failure
    repaired, _ = diagnose_always(tmp_path, make_diagnosis("no_gap"))
    run_cases(folder, sealed, options._replace(diagnose=repaired), silent)
    assert score_trial(folder, options).scores.failures == 0


def test_a_diagnosis_gets_only_its_log(folder, three, tmp_path):
    """It is started in an empty folder, and its command does not reveal the case's effects."""
    record = tmp_path / "record.json"
    spy = write_diagnosis_script(
        tmp_path,
        "import json, os, sys\n"
        f"json.dump([os.listdir('.'), sys.argv[1:]], open({str(record)!r}, 'w'))\n"
        "sys.exit('enough')\n",
    )
    options = TrialOptions(3, 1, diagnose=spy)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    files, arguments = json.loads(record.read_text())
    assert files == []
    assert not any(word in " ".join(arguments) for word in ("sealed", "gas", "stop"))


def test_the_twin_predicts_a_validation_run(folder, three, tmp_path, monkeypatch):
    script = write_diagnosis_script(
        tmp_path,
        "import sys; from pathlib import Path\n"
        f"Path(sys.argv[3]).write_text({json.dumps(make_diagnosis('explained', 'gas_spring'))!r})\n"
        "Path(sys.argv[5]).write_text('{}')\n",
    )
    predictions = []

    def run_and_record(arguments):
        if "predict" in arguments:
            predictions.append([str(argument) for argument in arguments])
            Path(arguments[-1]).write_text(json.dumps({"noise_floor_n": 2.0, "before_n": 4.0, "rmse_n": 2.5}))
        else:
            run_command(arguments)

    monkeypatch.setattr(running, "run_command", run_and_record)
    options = TrialOptions(3, 1, diagnose=script)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    assert [words[-4:-2] for words in predictions] == [["--free", "offset"]] * 2
    assert {Path(words[-5]).parent.name for words in predictions} == {"validation"}
    first = score_trial(folder, options).cases[0]
    assert first.true_shrinkage == 1.0
    assert (
        folder.get_case_files("case_000")
        .validation_log.read_text()
        .startswith("validation_rich_small_0.json case_000.json")
    )


def test_some_cases_are_recorded_again_over_wires(folder, three, tmp_path, monkeypatch):
    recorded = []

    def record_wired(method, scenario, log):
        recorded.append(scenario.name)
        log.write_text("over wires")

    monkeypatch.setattr(running, "record_over_wires", record_wired)
    diagnose, _ = diagnose_always(tmp_path, make_diagnosis("explained", "gas_spring"))
    options = TrialOptions(3, 1, wired=1, diagnose=diagnose)
    _, sealed = prepare_truth(folder, options, silent)
    run_cases(folder, sealed, options, silent)
    report = score_trial(folder, options)
    assert recorded == ["case_000_wires.json"]
    assert [case.wired for case in report.cases] == [False, False, False, True]
    assert (report.scores.correct["over wires"].count, report.scores.correct["over wires"].total) == (1, 1)


def test_a_failed_command_is_reported_with_name_and_reason():
    with pytest.raises(CommandFailedError, match=r"ended with 3: it is broken"):
        run_command([sys.executable, "-c", "import sys; print('it is broken', file=sys.stderr); sys.exit(3)"])
    with pytest.raises(CommandFailedError, match=r"cannot be started|ended with 127"):
        run_command(["/nowhere/at/all"])


def test_the_command_writes_the_report_and_prints_its_table(three, tmp_path):
    diagnose, _ = diagnose_always(tmp_path, make_diagnosis("explained", "gas_spring"))
    app = typer.Typer()
    app.command()(trial)
    out = tmp_path / "report.json"
    words = ["--cases", "3", "--out", str(out), "--diagnose", " ".join(diagnose)]
    result = typer.testing.CliRunner().invoke(app, words, catch_exceptions=False)
    assert result.exit_code == 0
    report = TrialReport.model_validate_json(out.read_bytes())
    assert report.sealed_sha256 in result.stderr
    assert "true set named" in result.stdout
    assert report.scores.correct["all"].total == 2


def test_a_case_that_another_process_has_claimed_is_skipped(folder, three, tmp_path):
    command, calls = diagnose_always(tmp_path, make_diagnosis("no_gap"))
    options = TrialOptions(3, 1, diagnose=command)
    _, sealed = prepare_truth(folder, options, silent)
    with folder.claim("case_001") as claimed:
        assert claimed
        run_cases(folder, sealed, options, silent)
    assert calls.read_text().split() == ["case_000.mcap", "case_002.mcap"]
    run_cases(folder, sealed, options, silent)
    assert calls.read_text().split()[2:] == ["case_001.mcap"]


def test_a_trial_folder_with_the_former_name_of_the_validation_logs_is_continued(tmp_path):
    (tmp_path / "trial.cases" / "unseen").mkdir(parents=True)
    former = TrialFolder(tmp_path / "trial.json")
    former.prepare()
    assert former.get_case_files("case_000").validation_log.parent.name == "unseen"


def test_a_seal_with_the_former_field_name_is_read():
    former = {"cases": 3, "seed": 1, "draw": "grid", "version": "0", "sha256": "ab"}
    assert Seal.model_validate(former).kind == "grid"
