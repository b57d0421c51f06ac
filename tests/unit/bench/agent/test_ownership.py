"""Lock that admits one agent per bench."""

import pytest

from bench.agent.ownership import acquire_agent_lock
from bench.errors import RunError


def test_bench_is_locked_until_its_agent_releases_it(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text("[rig]")
    with (
        acquire_agent_lock(config),
        pytest.raises(RunError, match="another rig agent has this bench"),
        acquire_agent_lock(config),
    ):
        pytest.fail("two agents have the bench")
    with acquire_agent_lock(config):
        pass
