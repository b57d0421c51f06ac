"""Certificate and key of the service."""

from datetime import UTC, datetime, timedelta

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

from bench.service import TlsFiles
from bench.service.errors import ServiceError
from bench.service.serving import check_tls

NAME = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "127.0.0.1")])


def write_pair(folder, name, password=None):
    """Write a self-signed certificate and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    now = datetime.now(UTC)
    builder = x509.CertificateBuilder(NAME, NAME, key.public_key(), 1, now, now + timedelta(days=1))
    files = TlsFiles(folder / f"{name}.pem", folder / f"{name}.key")
    files.certificate.write_bytes(builder.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
    secret = serialization.BestAvailableEncryption(password) if password else serialization.NoEncryption()
    pem = (serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, secret)
    files.key.write_bytes(key.private_bytes(*pem))
    return files


def test_a_pair_that_belongs_together_is_accepted(tmp_path):
    check_tls(write_pair(tmp_path, "one"))


def test_a_foreign_missing_or_locked_key_is_refused_without_asking_for_a_password(tmp_path):
    one, two = write_pair(tmp_path, "one"), write_pair(tmp_path, "two")
    locked = write_pair(tmp_path, "locked", b"secret")
    for files in (one._replace(key=two.key), one._replace(key=tmp_path / "no.key"), locked):
        with pytest.raises(ServiceError, match="cannot be used for TLS"):
            check_tls(files)
