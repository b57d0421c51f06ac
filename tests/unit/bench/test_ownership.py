import pytest

from bench.agent.ownership import sole_agent
from bench.errors import RunError


def test_a_bench_is_one_agent_s_until_it_lets_go(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text("[rig]")
    with sole_agent(config), pytest.raises(RunError, match="another rig agent has this bench"), sole_agent(config):
        pytest.fail("both have it")
    with sole_agent(config):
        pass
