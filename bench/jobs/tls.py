"""TLS with mutual authentication between scheduler, workers and services.

A scheduler and its workers execute any code that a connected process sends. All of them therefore show the same
certificate, and accept only that one. Its file contains the key: anybody who has it can execute code.
"""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, NamedTuple

from distributed.comm.addressing import get_address_host_port
from distributed.security import Security

from bench.jobs.errors import WorkerError
from bench.private_file import check_private_file, create_private_file

LOOPBACK: Final = "127.0.0.1"
_LOOPBACK_NAMES = (LOOPBACK, "localhost", "::1")
_FILE_NAME = "jobs.pem"
_COMMON_NAME = "mrbench jobs"
_PURPOSE = f"the TLS key of the jobs; copy {_FILE_NAME} from the scheduler's data folder, or give --scheduler-tls"
_SECURITY: Any = Security
"""Untyped in dask."""
_BEGIN, _END = datetime(2000, 1, 1, tzinfo=UTC), datetime(9999, 12, 31, 23, 59, 59, tzinfo=UTC)
"""Validity of a certificate: unlimited, because its file is what counts, and clocks of machines differ."""


class SchedulerLocation(NamedTuple):
    """Address of a scheduler, and the credentials for it."""

    address: str
    """Such as ``tls://127.0.0.1:8786``."""
    security: Security


def get_tls_file(data: Path) -> Path:
    """Return the file with key and certificate of the jobs in a data folder."""
    return data / _FILE_NAME


def create_security(data: Path) -> Security:
    """Return the credentials of a data folder; they are created unless they exist.

    Raises:
        SecretFileError: their file cannot be created, or other users may read it.
    """
    create_private_file(get_tls_file(data), _make_certificate)
    return load_security(get_tls_file(data))


def load_security(path: Path) -> Security:
    """Return the credentials in a PEM file: private key, certificate and, if it differs, its authority.

    Raises:
        SecretFileError: the file is missing, or other users may read it.
        WorkerError: its content is not a key with a certificate.
    """
    check_private_file(path, _PURPOSE)
    # One file in every role: who may submit code to a scheduler may execute it on a worker anyway.
    name = str(path)
    certificates = {f"tls_{role}_cert": name for role in ("client", "scheduler", "worker")}
    security: Security = _SECURITY(require_encryption=True, tls_ca_file=name, **certificates)
    try:
        _SECURITY.get_connection_args(security, "client")
    except OSError as error:  # the errors of TLS, too
        raise WorkerError(f"{path}: not a PEM file with a private key and a certificate ({error})") from None
    return security


def locate_scheduler(address: str, tls_file: Path, *, allow_plain: bool = False) -> SchedulerLocation:
    """Return a scheduler's address with the credentials for it.

    Args:
        address: ``tls://HOST:PORT``, or ``tcp://HOST:PORT`` for a scheduler without TLS.
        tls_file: file of the credentials; not read for a scheduler without TLS.
        allow_plain: accept a scheduler without TLS that is not on the loopback interface.

    Raises:
        WorkerError: the address is not valid, or without TLS and reached over a network.
        SecretFileError: the file of the credentials is missing, or other users may read it.
    """
    scheme, host = _parse_address(address)
    if scheme == "tls":
        return SchedulerLocation(address, load_security(tls_file))
    if host not in _LOOPBACK_NAMES and not allow_plain:
        raise WorkerError(
            f"--scheduler {address} has no TLS: anybody who reaches it can execute code; "
            "use `mrbench scheduler` with tls://, or accept the risk with --plain-scheduler"
        )
    return SchedulerLocation(address, _SECURITY(require_encryption=False))


def _parse_address(address: str) -> tuple[str, str]:
    scheme, separator, rest = address.partition("://")
    try:
        host, _ = get_address_host_port(f"tcp://{rest}")
    except ValueError:
        host = ""
    if not separator or not host or scheme not in ("tls", "tcp"):
        raise WorkerError(f"--scheduler {address}: not of the form tls://HOST:PORT")
    return scheme, host


def _make_certificate() -> str:
    """Return a new private key and its self-signed certificate as PEM."""
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import NameOID

    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, _COMMON_NAME)])
    certificate = (
        x509.CertificateBuilder(name, name, key.public_key(), x509.random_serial_number(), _BEGIN, _END)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    return (secret + certificate.public_bytes(pem)).decode()
