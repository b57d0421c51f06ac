"""Physics-informed networks: the damper's parameters by training, without fitting a simulation."""

from identification.pinn.training import describe_incompatibility, group_batches, train, train_batch

__all__ = [
    "describe_incompatibility",
    "group_batches",
    "train",
    "train_batch",
]
