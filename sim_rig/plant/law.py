"""The damper's law as machine code, for both integrators."""

from identification.damper import law
from sim_rig.plant.jit import compile_function

evaluate_coefficient = compile_function(law.evaluate_coefficient)
compute_field_rate = compile_function(law.compute_field_rate)
compute_inner_velocity = compile_function(law.compute_inner_velocity)
compute_hysteresis_rate = compile_function(law.compute_hysteresis_rate)
compute_force = compile_function(law.compute_force)
