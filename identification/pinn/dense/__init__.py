"""The dense network: one multilayer perceptron for a whole recording."""

from identification.pinn.dense.mlp import Perceptron
from identification.pinn.dense.training import compute_batch_size, train_dense

__all__ = [
    "Perceptron",
    "compute_batch_size",
    "train_dense",
]
