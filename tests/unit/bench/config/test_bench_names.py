"""Names of benches, and the file by which commands find them."""

from pathlib import Path

import pytest

from bench.config import BENCHES_FILE, check_bench_name, choose_bench, find_bench, get_executor, write_benches
from bench.errors import ConfigError


@pytest.mark.parametrize("name", ["left", "b-2", "_", "7", "x" * 40, "bench"])
def test_a_name_has_small_letters_digits_and_two_signs(name):
    assert check_bench_name(name) == name


@pytest.mark.parametrize("name", ["", "Left", "a b", "a/b", "ä", "x" * 41, "a\n"])
def test_another_name_is_refused(name):
    with pytest.raises(ConfigError, match="cannot name a bench; use 1 to 40 small letters"):
        check_bench_name(name)


def test_the_name_of_the_first_executor_is_refused():
    with pytest.raises(ConfigError, match="cannot have the name agent"):
        check_bench_name("agent")


def test_campaigns_of_the_only_bench_keep_their_executor():
    assert [get_executor(name) for name in ("bench", "left")] == ["agent", "left"]


def test_a_bench_is_found_by_its_file(tmp_path):
    left, right = tmp_path / "left.toml", tmp_path / "right.toml"
    write_benches(tmp_path, {"left": str(left), "right": str(right), "far": "tcp://rig:5570"})
    assert find_bench(tmp_path, right) == "right"
    assert find_bench(tmp_path, tmp_path / "folder" / ".." / "left.toml") == "left"


def test_another_file_is_refused_with_the_known_ones(tmp_path):
    write_benches(tmp_path, {"left": "/x/left.toml", "far": "tcp://rig:5570"})
    with pytest.raises(
        ConfigError, match=r"no bench .* has other.toml; .* left \(/x/left.toml\), far \(tcp://rig"
    ):
        find_bench(tmp_path, Path("other.toml"))


def test_any_file_means_an_only_bench(tmp_path):
    assert find_bench(tmp_path, tmp_path / "bench.toml") == "bench"
    write_benches(tmp_path, {"left": "/x/left.toml"})
    assert find_bench(tmp_path, tmp_path / "copy.toml") == "left"


def test_a_command_names_one_of_several_benches(tmp_path):
    assert choose_bench(tmp_path) == "bench"
    write_benches(tmp_path, {"left": "/x/left.toml"})
    assert choose_bench(tmp_path) == "left"
    write_benches(tmp_path, {"left": "/x/left.toml", "right": "/x/right.toml"})
    assert choose_bench(tmp_path, "right") == "right"
    with pytest.raises(ConfigError, match=r"several benches; .* has left, right: name one with --bench"):
        choose_bench(tmp_path)
    with pytest.raises(ConfigError, match=r"there is no bench 'up'; .* has left, right"):
        choose_bench(tmp_path, "up")


def test_a_damaged_file_is_refused(tmp_path):
    (tmp_path / BENCHES_FILE).write_text("{")
    with pytest.raises(ConfigError, match=r"not readable .*start the service again"):
        find_bench(tmp_path, tmp_path / "bench.toml")
