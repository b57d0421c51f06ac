"""Defined effects of a scenario in compiled code: their functions, their variables and the stack machine."""

from sim_rig.plant.defined_effects.functions import compute_steepest_slope, make_defined_functions
from sim_rig.plant.defined_effects.stack_machine import (
    DEFINED_TYPE,
    DRIVE_PLACE,
    FIELD_PLACE,
    FORCE_PLACE,
    GAIN_PLACE,
    MOUNTING_PLACE,
    DefinedFunctions,
    evaluate,
)
from sim_rig.plant.defined_effects.variables import (
    hold_drive,
    improve_acceleration,
    set_variables,
    set_velocity,
    start_variables,
    update_memory,
)

__all__ = [
    "DEFINED_TYPE",
    "DRIVE_PLACE",
    "FIELD_PLACE",
    "FORCE_PLACE",
    "GAIN_PLACE",
    "MOUNTING_PLACE",
    "DefinedFunctions",
    "compute_steepest_slope",
    "evaluate",
    "hold_drive",
    "improve_acceleration",
    "make_defined_functions",
    "set_variables",
    "set_velocity",
    "start_variables",
    "update_memory",
]
