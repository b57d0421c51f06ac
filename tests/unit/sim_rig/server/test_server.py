"""The ``bench.toml`` that reaches a simulated rig."""

import tomllib

import pytest

from sim_rig.errors import WireError
from sim_rig.scenario.scenario import load_scenario
from sim_rig.server.bench_toml import Wire, write_bench_toml

WIRES = [Wire("lvdt", "Modbus TCP", {"driver": "lvdt", "url": "tcp://127.0.0.1:5020", "unit": 1})]


def test_a_generated_file_is_replaced(tmp_path):
    path = tmp_path / "bench.toml"
    for _ in range(2):
        write_bench_toml(path, WIRES, load_scenario("default"))
    assert tomllib.loads(path.read_text())["instruments"]["lvdt"]["url"] == "tcp://127.0.0.1:5020"


def test_a_file_written_by_a_person_is_not_replaced(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text("[rig]\nname = 'the real one'\n")
    with pytest.raises(WireError, match=r"bench\.toml: was written by hand and is not replaced; choose another"):
        write_bench_toml(path, WIRES, load_scenario("default"))
    assert "the real one" in path.read_text()
