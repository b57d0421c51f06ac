"""Planning in the catalogue: specimens, methods, their approvals, certificates, checks, keys of requests."""

from bench.catalogue.planning.approvals import ApprovalRow, ApprovalStore
from bench.catalogue.planning.certificates import CertificateStore, StoredCertificate, find_stored_state
from bench.catalogue.planning.checks import CheckStore
from bench.catalogue.planning.idempotency import ClaimedKey, IdempotencyKeys
from bench.catalogue.planning.method_library import MethodLibrary, StoredMethod
from bench.catalogue.planning.methods import SHIPPED_VERSION, MethodRow, MethodStore
from bench.catalogue.planning.specimens import Specimen, SpecimenStore

__all__ = [
    "SHIPPED_VERSION",
    "ApprovalRow",
    "ApprovalStore",
    "CertificateStore",
    "CheckStore",
    "ClaimedKey",
    "IdempotencyKeys",
    "MethodLibrary",
    "MethodRow",
    "MethodStore",
    "Specimen",
    "SpecimenStore",
    "StoredCertificate",
    "StoredMethod",
    "find_stored_state",
]
