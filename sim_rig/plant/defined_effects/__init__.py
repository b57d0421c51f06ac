"""Defined effects of a scenario in compiled code: their functions, their variables and the stack machine."""

from sim_rig.plant.defined_effects.functions import (
    compute_steepest_slope,
    make_defined_functions,
    set_drive_response,
)
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
    respond_to_drive,
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
    "respond_to_drive",
    "set_drive_response",
    "set_variables",
    "set_velocity",
    "start_variables",
    "update_memory",
]
