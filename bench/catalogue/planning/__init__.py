"""Planning in the catalogue: specimens, stored methods and their approvals, and keys of requests."""

from bench.catalogue.planning.approvals import ApprovalRow, ApprovalStore
from bench.catalogue.planning.idempotency import ClaimedKey, IdempotencyKeys
from bench.catalogue.planning.methods import SHIPPED_VERSION, MethodRow, MethodStore
from bench.catalogue.planning.specimens import Specimen, SpecimenStore

__all__ = [
    "SHIPPED_VERSION",
    "ApprovalRow",
    "ApprovalStore",
    "ClaimedKey",
    "IdempotencyKeys",
    "MethodRow",
    "MethodStore",
    "Specimen",
    "SpecimenStore",
]
