"""Simulated damper with its actuator, amplifier and mounting."""

from sim_rig.plant.alternative_plant import AlternativePlant, apply_displacement_channel, make_plant
from sim_rig.plant.effects import EffectFunctions
from sim_rig.plant.jit import Array, compile_function, compile_inline
from sim_rig.plant.plant import Plant, TrueSignals, apply_start_ramp, count_substeps, split_into_chunks

__all__ = [
    "AlternativePlant",
    "Array",
    "EffectFunctions",
    "Plant",
    "TrueSignals",
    "apply_displacement_channel",
    "apply_start_ramp",
    "compile_function",
    "compile_inline",
    "count_substeps",
    "make_plant",
    "split_into_chunks",
]
