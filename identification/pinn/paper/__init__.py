"""The network of the paper, as published."""

from identification.pinn.paper.training import PaperTraining, decode_parameters, train_paper

__all__ = ["PaperTraining", "decode_parameters", "train_paper"]
