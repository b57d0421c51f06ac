import hashlib
import json
import sys
from pathlib import Path

import pytest
import typer
import typer.testing
from trial_examples import said, truth

from sim_rig.errors import TrialError
from sim_rig.trial import run as running
from sim_rig.trial.answer import Trial, trial_schema
from sim_rig.trial.commands import trial
from sim_rig.trial.folder import TrialFolder
from sim_rig.trial.processes import CommandFailedError, call
from sim_rig.trial.run import Plan, run_cases, sealed_truth
from sim_rig.trial.truth import Truth, read_sealed, write_sealed
from sim_rig.trial.whole import answer

SCHEMA = Path(__file__).parents[4] / "docs" / "reference" / "schemas" / "trial.json"


def silent(what, share):
    """No progress."""


@pytest.fixture
def folder(tmp_path):
    made = TrialFolder(tmp_path / "trial.json")
    made.prepare()
    return made


@pytest.fixture
def three(monkeypatch):
    """A draw of three cases whose sizes need no simulation, and a rig that writes what it was asked for."""
    cases = [truth("gas_spring", id="case_000"), truth(id="case_001"), truth("end_stop", id="case_002", seed=5)]
    monkeypatch.setattr(running, "_settled", lambda *_: cases)

    def record(method, scenario, seed, log):
        log.write_text(f"{method.name} {scenario.name} {seed}")

    monkeypatch.setattr(running, "_record_from_plant", record)
    return cases


def diagnosing(tmp_path, text):
    """A command that diagnoses: Python, the log's name among its words."""
    script = tmp_path / "diagnose.py"
    script.write_text(text)
    return (sys.executable, str(script))


def always(tmp_path, document):
    heard = tmp_path / "heard.txt"
    return diagnosing(
        tmp_path,
        "import json, sys; from pathlib import Path\n"
        f"heard = Path({str(heard)!r})\n"
        "heard.write_text((heard.read_text() if heard.exists() else '') + Path(sys.argv[1]).name + '\\n')\n"
        f"Path(sys.argv[3]).write_text({json.dumps(document)!r})\n",
    ), heard


def test_the_published_hash_is_that_of_the_sealed_file(folder, three):
    seal, found = sealed_truth(folder, Plan(3, 1), silent)
    assert seal.sha256 == hashlib.sha256(folder.truth.read_bytes()).hexdigest()
    assert found == Truth(cases=tuple(three))


def test_a_changed_truth_breaks_the_seal(folder):
    sha256 = write_sealed(folder.truth, Truth(cases=(truth("gas_spring"),)))
    assert read_sealed(folder.truth, sha256).cases[0].kind == "single"
    folder.truth.write_text(folder.truth.read_text().replace("gas_spring", "gas_Spring"))
    with pytest.raises(TrialError, match="the seal is broken"):
        read_sealed(folder.truth, sha256)


def test_another_trial_in_the_same_folder_is_refused(folder, three):
    sealed_truth(folder, Plan(3, 1), silent)
    with pytest.raises(TrialError, match="holds a trial of 3 cases with seed 1"):
        sealed_truth(folder, Plan(3, 2), silent)


def test_a_trial_runs_to_its_answer(folder, three, tmp_path):
    diagnose, _ = always(tmp_path, said("explained", "gas_spring"))
    plan = Plan(3, 1, workers=2, diagnose=diagnose)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    found = answer(folder, plan)
    assert [case.right for case in found.cases] == [True, False, False]
    assert (found.scores.false_alarms.count, found.scores.failures) == (1, 0)
    assert found.scores.confusion["end_stop"] == {"gas_spring": 1}


def test_a_killed_trial_goes_on_where_it_was(folder, three, tmp_path):
    diagnose, heard = always(tmp_path, said("no_gap"))
    plan = Plan(3, 1, diagnose=diagnose)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    folder.files("case_001").outcome.unlink()
    folder.files("case_001").diagnosis.unlink()
    kept = folder.files("case_001").log.stat().st_mtime_ns
    run_cases(folder, sealed, plan, silent)
    assert heard.read_text().split() == ["case_000.mcap", "case_001.mcap", "case_002.mcap", "case_001.mcap"]
    assert folder.files("case_001").log.stat().st_mtime_ns == kept


def test_a_diagnosis_that_fails_is_an_outcome_and_tried_again(folder, three, tmp_path):
    broken = diagnosing(tmp_path, "import sys; sys.exit('mrbench: no answer today')")
    plan = Plan(3, 1, diagnose=broken)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    found = answer(folder, plan)
    assert found.scores.failures == 3
    assert "no answer today" in found.cases[0].failure
    mended, _ = always(tmp_path, said("no_gap"))
    run_cases(folder, sealed, plan._replace(diagnose=mended), silent)
    assert answer(folder, plan).scores.failures == 0


def test_a_diagnosis_sees_its_log_and_nothing_else(folder, three, tmp_path):
    """It is started in an empty folder, and no word of its command tells the case's effects."""
    seen = tmp_path / "seen.json"
    spy = diagnosing(
        tmp_path,
        "import json, os, sys\n"
        f"json.dump([os.listdir('.'), sys.argv[1:]], open({str(seen)!r}, 'w'))\n"
        "sys.exit('enough')\n",
    )
    plan = Plan(3, 1, diagnose=spy)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    there, words = json.loads(seen.read_text())
    assert there == []
    assert not any(word in " ".join(words) for word in ("sealed", "gas", "stop"))


def test_the_twin_predicts_a_run_that_the_diagnosis_never_saw(folder, three, tmp_path, monkeypatch):
    script = diagnosing(
        tmp_path,
        "import sys; from pathlib import Path\n"
        f"Path(sys.argv[3]).write_text({json.dumps(said('explained', 'gas_spring'))!r})\n"
        "Path(sys.argv[5]).write_text('{}')\n",
    )
    asked = []

    def listening(words):
        if "predict" in words:
            asked.append([str(word) for word in words])
            Path(words[-1]).write_text(json.dumps({"noise_floor_n": 2.0, "before_n": 4.0, "rmse_n": 2.5}))
        else:
            call(words)

    monkeypatch.setattr(running, "call", listening)
    plan = Plan(3, 1, diagnose=script)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    assert [words[-4:-2] for words in asked] == [["--free", "offset"]] * 2
    assert {Path(words[-5]).parent.name for words in asked} == {"unseen"}
    first = answer(folder, plan).cases[0]
    assert first.true_shrinkage == 1.0
    assert folder.files("case_000").unseen.read_text().startswith("unseen_rich_small_0.json case_000.json")


def test_some_cases_go_once_more_over_wires(folder, three, tmp_path, monkeypatch):
    recorded = []

    def wired(method, scenario, log):
        recorded.append(scenario.name)
        log.write_text("over wires")

    monkeypatch.setattr(running, "record_over_wires", wired)
    diagnose, _ = always(tmp_path, said("explained", "gas_spring"))
    plan = Plan(3, 1, over_wires=1, diagnose=diagnose)
    _, sealed = sealed_truth(folder, plan, silent)
    run_cases(folder, sealed, plan, silent)
    found = answer(folder, plan)
    assert recorded == ["case_000_wires.json"]
    assert [case.over_wires for case in found.cases] == [False, False, False, True]
    assert (found.scores.named_first["over wires"].count, found.scores.named_first["over wires"].of) == (1, 1)


def test_a_command_that_fails_says_which_and_why():
    with pytest.raises(CommandFailedError, match=r"ended with 3: it is broken"):
        call([sys.executable, "-c", "import sys; print('it is broken', file=sys.stderr); sys.exit(3)"])
    with pytest.raises(CommandFailedError, match=r"cannot be started|ended with 127"):
        call(["/nowhere/at/all"])


def test_the_command_writes_the_answer_and_shows_it(three, tmp_path):
    diagnose, _ = always(tmp_path, said("explained", "gas_spring"))
    app = typer.Typer()
    app.command()(trial)
    out = tmp_path / "answer.json"
    words = ["--cases", "3", "--out", str(out), "--diagnose", " ".join(diagnose)]
    ended = typer.testing.CliRunner().invoke(app, words, catch_exceptions=False)
    assert ended.exit_code == 0
    found = Trial.model_validate_json(out.read_bytes())
    assert found.sealed_sha256 in ended.stderr
    assert "right set named first" in ended.stdout
    assert found.scores.named_first["all"].of == 2


def test_the_committed_schema_is_that_of_the_type():
    assert SCHEMA.read_text() == trial_schema()


def test_a_case_that_another_process_holds_is_left_to_it(folder, three, tmp_path):
    command, heard = always(tmp_path, said("no_gap"))
    plan = Plan(3, 1, diagnose=command)
    _, found = sealed_truth(folder, plan, silent)
    with folder.claim("case_001") as mine:
        assert mine
        run_cases(folder, found, plan, silent)
    assert heard.read_text().split() == ["case_000.mcap", "case_002.mcap"]
    run_cases(folder, found, plan, silent)
    assert heard.read_text().split()[2:] == ["case_001.mcap"]
