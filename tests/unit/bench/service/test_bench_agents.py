"""Benches of a command line, and the start of their agents."""

from pathlib import Path

import pytest

from bench.errors import ConfigError
from bench.service import bench_agents
from bench.service.bench_agents import BenchPlace, make_agents, parse_benches
from bench.service.errors import ServiceError
from tests.support.fake_rig import BENCH_TOML


class Process:
    """Process of an agent that runs and does not answer yet."""

    pid, returncode = 7, None

    def poll(self):
        return None


@pytest.fixture
def configs(tmp_path):
    """Return two files bench.toml."""
    paths = [tmp_path / f"{name}.toml" for name in ("left", "right")]
    for path in paths:
        path.write_text(BENCH_TOML)
    return paths


def test_benches_are_files_or_addresses_with_keys():
    found = parse_benches(["left=a/bench.toml", "right=tcp://rig:5570,right.key", "third=ipc:///run/third"])
    assert found == (
        BenchPlace("left", config=Path("a/bench.toml")),
        BenchPlace("right", address="tcp://rig:5570", key=Path("right.key")),
        BenchPlace("third", address="ipc:///run/third"),
    )


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (["bench.toml"], "not a bench; give NAME=bench.toml"),
        (["left="], "not a bench; give NAME=bench.toml"),
        (["Left=bench.toml"], "cannot name a bench"),
        (["left=a.toml", "right=b.toml", "left=c.toml"], "two benches have the name left"),
    ],
)
def test_another_command_line_is_refused(texts, message):
    with pytest.raises(ConfigError, match=message):
        parse_benches(texts)


def test_two_benches_have_two_agents(configs):
    left, right = configs
    agents = make_agents([BenchPlace("left", left), BenchPlace("right", right)])
    assert [agent.make_settings().name for agent in agents] == ["left", "right"]
    with pytest.raises(ConfigError, match="the benches left and right have the same rig agent"):
        make_agents([BenchPlace("left", left), BenchPlace("right", left)])


def test_only_an_agent_on_this_machine_writes_into_the_data_folder():
    places = [BenchPlace("near", address="tcp://127.0.0.1:5570"), BenchPlace("far", address="tcp://rig:5570")]
    assert [agent.make_settings().has_local_logs for agent in make_agents(places)] == [True, False]


def test_the_start_of_one_of_several_agents_is_not_waited_for(configs, tmp_path, monkeypatch):
    """A rig without power must not keep the other benches from work."""
    logs = []
    monkeypatch.setattr(bench_agents, "is_answering", lambda link: False)
    monkeypatch.setattr(bench_agents, "launch_agent", lambda config, log: logs.append(log.name) or Process())
    monkeypatch.setattr(bench_agents, "start_agent", lambda *given: pytest.fail("it was waited for"))
    for agent in make_agents([BenchPlace(path.stem, path) for path in configs]):
        agent.supervise(tmp_path, is_started=True, is_only=False)
    assert logs == ["agent-left.log", "agent-right.log"]


def test_the_start_of_the_only_agent_is_waited_for(configs, tmp_path, monkeypatch):
    def fail(config, link, log):
        raise ServiceError(f"the rig agent ended at once; see {log.name}")

    monkeypatch.setattr(bench_agents, "is_answering", lambda link: False)
    monkeypatch.setattr(bench_agents, "start_agent", fail)
    with pytest.raises(ServiceError, match=r"ended at once; see agent\.log"):
        make_agents([BenchPlace(config=configs[0])])[0].supervise(tmp_path, is_started=True, is_only=True)


def test_an_agent_that_another_process_starts_is_only_supervised(configs, tmp_path, monkeypatch):
    monkeypatch.setattr(bench_agents, "is_answering", lambda link: pytest.fail("it was asked"))
    agent = make_agents([BenchPlace("left", configs[0])])[0]
    agent.supervise(tmp_path, is_started=False, is_only=True)
    assert agent.shut_down_if_started() is None
