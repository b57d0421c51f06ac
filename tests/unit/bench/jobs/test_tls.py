"""Credentials of the jobs, and the scheduler that refuses everybody without them."""

import asyncio

import pytest
from distributed import Client
from distributed.security import Security

from bench.errors import SecretFileError
from bench.jobs.errors import WorkerError
from bench.jobs.scheduler import start_scheduler
from bench.jobs.tls import create_security, get_tls_file, load_security, locate_scheduler


@pytest.fixture
def tls_file(tmp_path):
    create_security(tmp_path)
    return get_tls_file(tmp_path)


class TestCredentials:
    """File with key and certificate."""

    def test_they_are_created_once_and_only_their_owner_can_read_them(self, tls_file):
        content = tls_file.read_bytes()
        assert tls_file.stat().st_mode & 0o777 == 0o600
        create_security(tls_file.parent)
        assert tls_file.read_bytes() == content
        assert [path.name for path in tls_file.parent.iterdir()] == [tls_file.name]

    def test_a_file_that_others_can_read_is_refused(self, tls_file):
        tls_file.chmod(0o640)
        with pytest.raises(SecretFileError, match=r"mode 0640, allowed 0600\); chmod 600"):
            load_security(tls_file)

    def test_a_missing_file_is_named_with_its_source(self, tmp_path):
        with pytest.raises(SecretFileError, match=r"copy jobs\.pem from the scheduler's data folder"):
            load_security(tmp_path / "absent.pem")

    def test_a_file_with_other_content_is_refused(self, tls_file):
        tls_file.write_text("no key")
        with pytest.raises(WorkerError, match="not a PEM file with a private key"):
            load_security(tls_file)


class TestSchedulerAddress:
    """Which schedulers are accepted."""

    @pytest.mark.parametrize("address", ["nowhere", "tcp://", "tcp://host:port", "tls://host", "http://host:1"])
    def test_a_wrong_address_is_refused(self, address, tls_file):
        with pytest.raises(WorkerError, match="not of the form tls://HOST:PORT"):
            locate_scheduler(address, tls_file)

    def test_one_with_tls_needs_the_file(self, tls_file, tmp_path):
        assert locate_scheduler("tls://rig:8786", tls_file).security.require_encryption
        with pytest.raises(SecretFileError):
            locate_scheduler("tls://127.0.0.1:8786", tmp_path / "absent.pem")

    def test_one_without_tls_is_refused_beyond_loopback_unless_it_is_accepted(self, tmp_path):
        absent = tmp_path / "absent.pem"
        with pytest.raises(WorkerError, match="has no TLS: anybody who reaches it can execute code"):
            locate_scheduler("tcp://rig:8786", absent)
        assert not locate_scheduler("tcp://rig:8786", absent, allow_plain=True).security.require_encryption
        assert not locate_scheduler("tcp://127.0.0.1:8786", absent).security.require_encryption


async def count_cores(address, security):
    """Ask a scheduler for something, as any client."""
    async with Client(address, security=security, asynchronous=True, timeout=5, set_as_default=False) as client:
        return await client.ncores()


def test_a_scheduler_answers_only_with_its_own_credentials(tmp_path):
    data, other = tmp_path / "data", tmp_path / "other"
    data.mkdir()
    other.mkdir()

    async def check():
        async with start_scheduler(data) as (address, security):
            assert address.startswith("tls://127.0.0.1:")
            assert await count_cores(address, security) == {}
            with pytest.raises(OSError, match="TLS certificate does not match"):
                await count_cores(address, create_security(other))
            plain = address.replace("tls", "tcp")
            with pytest.raises(OSError, match=r"Timed out|closed"):
                await count_cores(plain, Security(require_encryption=False))

    asyncio.run(check())
