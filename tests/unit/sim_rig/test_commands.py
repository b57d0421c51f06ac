"""Options of ``mrbench sim`` that choose the damper, and what the rig reveals of a drawn one."""

import pytest
from typer.testing import CliRunner

from bench.cli import _make_application, entry_points
from sim_rig import server
from sim_rig.hidden_effect import draw_scenario
from sim_rig.scenario import load_scenario
from sim_rig.server.bench_toml import make_bench_toml


@pytest.fixture
def sim(monkeypatch):
    """Return a function that calls the command; its ``played`` collects the scenarios that would be served."""

    def call(*arguments):
        application = _make_application(entry_points(group="mrbench.commands").select(name="sim"))
        return CliRunner().invoke(application, ["sim", *map(str, arguments)])

    call.played = []
    monkeypatch.setattr(server, "run_until_stopped", lambda scenario, *_: call.played.append(scenario))
    return call


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--draw", 3], "add --truth FILE"),
        (["--truth", "truth.json"], "add --draw SEED"),
        (["--draw", 3, "--truth", "truth.json", "--scenario", "default"], "leave one of them out"),
        (["--draw", -1, "--truth", "truth.json"], "--draw"),
    ],
)
def test_options_that_contradict_each_other_are_misuse(sim, tmp_path, monkeypatch, arguments, reason):
    monkeypatch.chdir(tmp_path)
    result = sim(*arguments)
    assert result.exit_code == 2
    assert reason in " ".join(result.output.split())
    assert sim.played == []
    assert list(tmp_path.iterdir()) == []


def test_without_options_the_default_rig_is_played(sim):
    assert sim().exit_code == 0
    assert sim.played == [load_scenario("default")]


def test_a_drawn_damper_is_played_and_its_truth_is_written(sim, tmp_path):
    result = sim("--draw", 3, "--truth", tmp_path / "truth.json")
    assert result.exit_code == 0
    assert sim.played == [draw_scenario(3)]
    assert (tmp_path / "truth.json").is_file()


def test_console_and_configuration_name_nothing_of_the_truth(sim, tmp_path):
    for seed in range(40):
        console = sim("--draw", seed, "--truth", tmp_path / "truth.json").output
        scenario = draw_scenario(seed)
        (effect,) = scenario.alternative_effects
        shown = console + make_bench_toml([], scenario)
        assert shown == console + make_bench_toml([], load_scenario("default"))
        hidden = [effect.name, effect.form, *effect.parameters, *map(repr, effect.parameters.values())]
        assert not [word for word in hidden if word in console.replace(str(tmp_path), "")]
