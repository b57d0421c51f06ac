"""Planning in the catalogue: keys of requests."""

from bench.catalogue.planning.idempotency import ClaimedKey, IdempotencyKeys

__all__ = ["ClaimedKey", "IdempotencyKeys"]
