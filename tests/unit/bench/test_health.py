"""Health of the parts of a bench, each by a socket that answers."""

import socket

import pytest

from bench.errors import AgentUnreachableError
from bench.health import HealthError, check_part
from tests.support.fake_rig import BENCH_TOML

NOWHERE = "http://127.0.0.1:1"


@pytest.fixture
def listening():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener.getsockname()[1]


def write_bench(folder, port):
    """Write a bench.toml whose instruments with a TCP address are at one port."""
    path = folder / "bench.toml"
    path.write_text(BENCH_TOML.replace("10.0.0.6", f"127.0.0.1:{port}").replace("10.0.0.7", f"127.0.0.1:{port}"))
    return path


def test_instruments_are_healthy_while_their_tcp_addresses_answer(tmp_path, listening):
    assert check_part("instruments", write_bench(tmp_path, listening), tmp_path, NOWHERE) == "2 addresses answer"
    with pytest.raises(HealthError, match=r"tcp://127\.0\.0\.1:1: nothing answers"):
        check_part("instruments", write_bench(tmp_path, 1), tmp_path, NOWHERE)


def test_a_scheduler_is_healthy_while_it_listens(tmp_path, listening):
    with pytest.raises(HealthError, match="no scheduler has written its address"):
        check_part("scheduler", tmp_path, tmp_path, NOWHERE)
    (tmp_path / "scheduler.address").write_text(f"tls://127.0.0.1:{listening}")
    assert check_part("scheduler", tmp_path, tmp_path, NOWHERE) == f"listens at tls://127.0.0.1:{listening}"


def test_the_address_of_a_killed_scheduler_is_not_healthy(tmp_path):
    (tmp_path / "scheduler.address").write_text("tls://127.0.0.1:1")
    with pytest.raises(HealthError, match=r"tls://127\.0\.0\.1:1: nothing answers"):
        check_part("scheduler", tmp_path, tmp_path, NOWHERE)


def test_an_absent_agent_is_not_healthy(tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text(BENCH_TOML)
    with pytest.raises(AgentUnreachableError, match="no rig agent replied"):
        check_part("agent", config, tmp_path, NOWHERE)


@pytest.mark.parametrize("part", ["service", "worker"])
def test_an_absent_service_is_not_healthy(part, tmp_path):
    with pytest.raises(HealthError, match="the service does not answer"):
        check_part(part, tmp_path, tmp_path, NOWHERE)
