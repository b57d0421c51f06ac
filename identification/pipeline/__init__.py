"""Identification of dampers, from recordings to fit documents."""

from identification.pipeline.batch import identify_batch, make_output_paths
from identification.pipeline.fit_document import make_noise_floor
from identification.pipeline.fit_input import make_problem
from identification.pipeline.fit_request import FitRequest
from identification.pipeline.identification import identify
from identification.pipeline.pinn_stage import compare_with_network

__all__ = [
    "FitRequest",
    "compare_with_network",
    "identify",
    "identify_batch",
    "make_noise_floor",
    "make_output_paths",
    "make_problem",
]
