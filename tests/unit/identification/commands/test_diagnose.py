"""`mrbench diagnose` with `--discover` and `--keep`: what is searched for, and the effect file that is kept."""

import json
from types import SimpleNamespace

import pytest
import typer
from typer.testing import CliRunner

from identification.commands.diagnose import diagnose
from identification.damper.definitions import load_effects
from identification.damper.effects import EFFECTS
from identification.errors import EffectFileError, UnusableDataError
from tests.support.discovery_documents import DEFINITION, make_discovery, make_result


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Return a folder that does not exist yet, as that of the user's effect files."""
    monkeypatch.setenv("MRBENCH_EFFECTS", str(tmp_path / "effects"))
    return tmp_path / "effects"


@pytest.fixture
def bench(folder, monkeypatch):
    """Calls of a diagnosis that is not run, and the documents that were written; ``result`` is what it gives."""

    bench = SimpleNamespace(result=make_result(make_discovery()), calls=[], written={})

    def record(recordings, simulation, **options):
        bench.calls.append(options)
        return bench.result

    def write(path, document):
        bench.written[path.name] = document

    monkeypatch.setattr("identification.gap.diagnose", record)
    monkeypatch.setattr("identification.logs.load", lambda path: path)
    monkeypatch.setattr("identification.documents.write_document", write)
    return bench


def run(tmp_path, *options):
    app = typer.Typer()
    app.command()(diagnose)
    return CliRunner().invoke(app, ["a.mcap", "--out", str(tmp_path / "d.json"), *options])


@pytest.mark.parametrize(
    ("options", "searched"),
    [
        ((), False),
        (("--discover",), True),
        (("--keep", "my_gain"), True),
        (("--discover", "--keep", "my_gain"), True),
    ],
)
def test_a_cause_outside_the_library_is_searched_for_on_request(bench, tmp_path, options, searched):
    assert run(tmp_path, *options).exit_code == 0
    assert [call["discover"] for call in bench.calls] == [searched]


@pytest.mark.parametrize(("options", "learned"), [((), False), (("--residual",), True)])
def test_a_residual_is_learned_on_request(bench, tmp_path, options, learned):
    assert run(tmp_path, *options).exit_code == 0
    assert [call["learn_residual"] for call in bench.calls] == [learned]


def run_each(tmp_path, *options, logs=("a.mcap", "b.mcap")):
    app = typer.Typer()
    app.command()(diagnose)
    return CliRunner().invoke(app, [*logs, "--each", "--out", str(tmp_path / "d"), *options])


def test_every_log_is_diagnosed_by_itself_and_has_a_row(bench, tmp_path, monkeypatch):
    recordings = []
    inner = bench.result

    def record(given, simulation, **options):
        recordings.append([p.name for p in given])
        return inner

    monkeypatch.setattr("identification.gap.diagnose", record)
    result = run_each(tmp_path, "--twin", str(tmp_path / "t"))
    assert result.exit_code == 0
    assert recordings == [["a.mcap"], ["b.mcap"]]
    assert sorted(bench.written) == ["a.json", "b.json"]
    head, *rows = result.stdout.splitlines()
    assert head.split()[:2] == ["log", "verdict"]
    assert [row.split()[:2] for row in rows] == [[name, inner.diagnosis.verdict] for name in "ab"]
    assert (tmp_path / "d").is_dir()
    assert (tmp_path / "t").is_dir()


def test_a_log_that_cannot_be_diagnosed_does_not_stop_the_others(bench, tmp_path, monkeypatch):
    def record(given, simulation, **options):
        if given[0].name == "a.mcap":
            raise UnusableDataError("too short")
        return bench.result

    monkeypatch.setattr("identification.gap.diagnose", record)
    result = run_each(tmp_path)
    assert str(result.exception) == "1 of 2 logs could not be diagnosed: a.mcap: too short"
    assert list(bench.written) == ["b.json"]
    assert [row.split()[0] for row in result.stdout.splitlines()] == ["log", "b"]


@pytest.mark.parametrize(
    ("options", "logs", "reason"),
    [
        (("--keep", "my_gain"), ("a.mcap", "b.mcap"), "several causes cannot have one name"),
        (("--twin", "-"), ("a.mcap", "b.mcap"), "name folders instead"),
        ((), ("a.mcap", "other/a.mcap"), "would both be written to"),
    ],
)
def test_what_several_diagnoses_cannot_share_is_refused_first(bench, tmp_path, options, logs, reason):
    assert reason in str(run_each(tmp_path, *options, logs=logs).exception)
    assert bench.calls == []


def test_a_diagnosis_knows_the_effects_of_the_user(bench, folder, tmp_path):
    folder.mkdir()
    text = DEFINITION.model_copy(update={"name": "my_gain"}).model_dump_json(by_alias=True)
    (folder / "my_gain.json").write_text(text, encoding="utf-8")
    run(tmp_path)
    assert set(bench.calls[0]["library"]) == {*EFFECTS, "my_gain"}


def test_a_kept_effect_is_written_under_its_name_everywhere(bench, folder, tmp_path):
    result = run(tmp_path, "--keep", "my_gain", "--twin", str(tmp_path / "t.json"))
    assert result.exit_code == 0
    path = folder / "my_gain.json"
    content = json.loads(path.read_text(encoding="utf-8"))
    assert content["schema"] == "mrbench.effect/1"
    assert content["name"] == "my_gain"
    assert content == json.loads(DEFINITION.model_copy(update={"name": "my_gain"}).model_dump_json(by_alias=True))
    assert bench.written["d.json"].discovery.definition.name == "my_gain"
    assert bench.written["t.json"].effects[-1].name == "my_gain"
    assert result.stderr.splitlines()[-1] == (
        f"{path}: written; diagnoses, twins and scenarios know my_gain from now on"
    )
    assert load_effects()["my_gain"].stage == "damper"


def test_without_keep_no_file_is_written(bench, folder, tmp_path):
    result = run(tmp_path, "--discover")
    assert not folder.exists()
    assert bench.written["d.json"].discovery.definition.name == "discovered_effect"
    assert "outside the library: the formula a*displacement**2 at the damper gain" in result.stderr
    assert "written" not in result.stderr


def test_keep_says_that_nothing_was_found(bench, folder, tmp_path):
    bench.result = make_result()
    result = run(tmp_path, "--keep", "my_gain")
    assert result.exit_code == 0
    assert not folder.exists()
    assert result.stderr.splitlines()[-1] == (
        "my_gain was not written, because no cause outside the library was found"
    )
    assert list(bench.written) == ["d.json"]


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("My_gain", "cannot be the name"),
        ("my gain", "cannot be the name"),
        ("../gain", "cannot be the name"),
        ("gain2", "cannot be the name"),
        ("", "cannot be the name"),
        ("a" * 41, "cannot be the name"),
        ("gas_spring", "there is an effect gas_spring already"),
        ("my_gain", "there is an effect my_gain already"),
    ],
)
def test_a_bad_or_known_name_is_refused_before_the_diagnosis(bench, folder, tmp_path, name, reason):
    folder.mkdir()
    known = DEFINITION.model_copy(update={"name": "my_gain"}).model_dump_json(by_alias=True)
    (folder / "known.json").write_text(known, encoding="utf-8")
    result = run(tmp_path, "--keep", name)
    assert isinstance(result.exception, EffectFileError)
    assert reason in str(result.exception)
    assert bench.calls == []
    assert [p.name for p in folder.iterdir()] == ["known.json"]


@pytest.mark.parametrize("name", ["a", "_", "a" * 40, "my_gain"])
def test_a_name_has_up_to_40_small_letters_and_underscores(bench, folder, tmp_path, name):
    assert run(tmp_path, "--keep", name).exit_code == 0
    assert (folder / f"{name}.json").exists()


def test_an_unreadable_effect_file_is_refused_before_the_diagnosis(bench, folder, tmp_path):
    folder.mkdir()
    (folder / "bad.json").write_text("{}", encoding="utf-8")
    assert "bad.json" in str(run(tmp_path).exception)
    assert bench.calls == []
