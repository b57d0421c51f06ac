"""The file that says where a simulated rig is reached."""

import tomllib

import pytest

from sim_rig.errors import WireError
from sim_rig.scenario import load_scenario
from sim_rig.serve import Wire, write_bench_toml

WIRES = [Wire("lvdt", "Modbus TCP", {"driver": "lvdt", "url": "tcp://127.0.0.1:5020", "unit": 1})]


def test_it_is_made_anew_each_time(tmp_path):
    path = tmp_path / "bench.toml"
    for _ in range(2):
        write_bench_toml(path, WIRES, load_scenario("default"))
    assert tomllib.loads(path.read_text())["instruments"]["lvdt"]["url"] == "tcp://127.0.0.1:5020"


def test_the_file_of_a_real_bench_is_never_replaced(tmp_path):
    path = tmp_path / "bench.toml"
    path.write_text("[rig]\nname = 'the real one'\n")
    with pytest.raises(WireError, match=r"bench\.toml: was written by hand and is left as it is; choose another"):
        write_bench_toml(path, WIRES, load_scenario("default"))
    assert "the real one" in path.read_text()
