"""Compiled simulation of the law with chosen effects, and its exact sensitivities."""

from identification.simulate.chain import MAX_TRAVEL, simulate
from identification.simulate.channel import (
    apply_force_channel,
    compute_parallel_force,
    differentiate_parallel_force,
)
from identification.simulate.digital_filter import compute_settled_state, design_low_pass, filter_series
from identification.simulate.inputs import COIL_ACTIONS, compute_damper_field
from identification.simulate.kernel import StepCounts
from identification.simulate.motion import DamperMotion, compute_damper_motion
from identification.simulate.scaling import compute_scale_factors
from identification.simulate.simulation_model import (
    SENSITIVITY_COLUMNS,
    ActiveEffect,
    Excitation,
    Response,
    SimulationModel,
)
from identification.simulate.variables import (
    DamperVariables,
    apply_deadband,
    make_coil_variables,
    trace_last_reversal,
)

__all__ = [
    "COIL_ACTIONS",
    "MAX_TRAVEL",
    "SENSITIVITY_COLUMNS",
    "ActiveEffect",
    "DamperMotion",
    "DamperVariables",
    "Excitation",
    "Response",
    "SimulationModel",
    "StepCounts",
    "apply_deadband",
    "apply_force_channel",
    "compute_damper_field",
    "compute_damper_motion",
    "compute_parallel_force",
    "compute_scale_factors",
    "compute_settled_state",
    "design_low_pass",
    "differentiate_parallel_force",
    "filter_series",
    "make_coil_variables",
    "simulate",
    "trace_last_reversal",
]
