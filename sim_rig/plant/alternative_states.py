"""Indices of the states and constants of the plant with alternative forms in their arrays."""

from sim_rig.effect_forms import MAX_STATES
from sim_rig.plant.states import Z_SATURATION

MAX_FORMS = 3
"""Largest number of alternative forms in one scenario."""
COMMAND, POSITION, VELOCITY, Y, Z, FIELD, OUTPUT, TEMPERATURE, PATH, DAMPER = range(10)
"""States: command behind the lag, actuator position [both m] and velocity [m/s], y, z [both m], field, amplifier
output [both V or A], temperature [degC], path travelled, displacement of the damper [both m]; then those of the
forms."""
STATE_COUNT = 10 + MAX_FORMS * MAX_STATES

CONSTANT_COUNT = Z_SATURATION + 4
"""Constants of the rig, from ``states.COMMAND_LAG`` to ``states.Z_SATURATION``, then those of the forms below."""
(
    MAX_FORM_RATE,  # [1/s] fastest rate of everything but the law
    HAS_MOUNTING,  # 1 if the mounting is compliant, else 0
    MOUNTING_RATE,  # [1/s] fastest rate of that mounting
) = range(Z_SATURATION + 1, CONSTANT_COUNT)
