"""Physics of the damper, written once for floats, arrays, compiled code and tensors.

Nothing here imports a compiler or a framework: each caller passes its own numbers.
"""

from identification.damper import law
from identification.damper.coordinates import COORDINATES, Coordinates, to_coordinates, to_parameters
from identification.damper.damper_size import (
    LIBRARY_SIZE,
    DamperSize,
    compute_scale_factor,
    scale_quantity,
    widen_bounds,
)
from identification.damper.law import Number, compute_hysteresis_rate, compute_inner_velocity, evaluate_coefficient
from identification.damper.parameter_sets import PARAMETER_SETS, find_parameter_set
from identification.damper.parameters import GAUGE, PARAMETERS, Parameters, Quantity

__all__ = [
    "COORDINATES",
    "GAUGE",
    "LIBRARY_SIZE",
    "PARAMETERS",
    "PARAMETER_SETS",
    "Coordinates",
    "DamperSize",
    "Number",
    "Parameters",
    "Quantity",
    "compute_hysteresis_rate",
    "compute_inner_velocity",
    "compute_scale_factor",
    "evaluate_coefficient",
    "find_parameter_set",
    "law",
    "scale_quantity",
    "to_coordinates",
    "to_parameters",
    "widen_bounds",
]
