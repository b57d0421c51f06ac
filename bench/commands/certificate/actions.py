"""Actions of `mrbench certificate` on the catalogue of a data folder."""

from datetime import UTC, date, datetime
from pathlib import Path

from bench.calibration import CertificateError, IssuedCertificate, read_certificate
from bench.catalogue import StoredCertificate, find_stored_state, open_catalogue
from bench.config import DEFAULT_BENCH


def add_certificate(path: Path, data: Path, author: str, bench: str = DEFAULT_BENCH) -> str:
    """Store the certificate in a file, and return what was stored in one line.

    Raises:
        CertificateError: the file is not a valid certificate, or its number is stored already.
        CatalogueError: the catalogue cannot be opened.
    """
    certificate = read_certificate(path)
    with open_catalogue(data, is_created=True) as catalogue:
        stored = catalogue.certificates.add(certificate, author, bench)
    if stored is None:
        raise CertificateError(
            f"{path}: certificate {certificate.number} of {certificate.laboratory} for channel "
            f"{certificate.channel} is stored already; correct it in the page or over REST"
        )
    return f"{stored.row.id}: stored; channel {certificate.channel}, due on {certificate.due}"


def withdraw_certificate(certificate_id: str, data: Path, author: str, reason: str) -> str:
    """Withdraw a certificate, and return that in one line.

    Raises:
        CertificateError: there is no such certificate, or it is withdrawn already.
        CatalogueError: the catalogue cannot be opened.
    """
    with open_catalogue(data) as catalogue:
        if catalogue.certificates.find(certificate_id) is None:
            raise CertificateError(f"there is no certificate {certificate_id}; list shows the ids")
        if not catalogue.certificates.withdraw(certificate_id, author, reason):
            raise CertificateError(f"certificate {certificate_id} is withdrawn already; nothing was changed")
    return f"{certificate_id}: withdrawn; it stays in the list and applies to no later run"


def list_certificates(data: Path) -> list[str]:
    """Return one line for each certificate, with its state today.

    Raises:
        CatalogueError: there is no catalogue, or it cannot be opened.
    """
    day = datetime.now(UTC).date()
    with open_catalogue(data) as catalogue:
        found = catalogue.certificates.list_newest()
        benches = {one.row.bench for one in found}
        current = {bench: catalogue.certificates.list_current(day, bench) for bench in benches}
    return [_describe(one, current[one.row.bench], day) for one in found] or ["no certificates"]


def _describe(stored: StoredCertificate, current: dict[str, IssuedCertificate], day: date) -> str:
    certificate, state = stored.issued.document, find_stored_state(stored, current, day).replace("_", " ")
    of = "" if stored.row.bench == DEFAULT_BENCH else f" of {stored.row.bench}"
    return (
        f"{stored.row.id}: {certificate.channel}{of}, {state}, due on {certificate.due}, "
        f"certificate {certificate.number} of {certificate.laboratory}, version {stored.row.version}"
    )
