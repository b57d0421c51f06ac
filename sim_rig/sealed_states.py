"""States and constants of the motion with sealed forms: what stands where in their arrays."""

from sim_rig.scenarios.sealed.form import MEMORY
from sim_rig.states import SATURATED

MOST_FORMS = 3
"""Forms in one scenario."""
COMMAND, POSITION, SPEED, Y, Z, FIELD, OUTPUT, TEMPERATURE, PATH, DAMPER = range(10)
"""Command behind the lag, actuator position [both m] and velocity [m/s], y, z [both m], field, amplifier output
[both V or A], temperature [degC], path travelled and displacement of the damper [both m]; then the memories."""
STATES = 10 + MOST_FORMS * MEMORY

CONSTANTS = SATURATED + 4
"""Those of the rig, from ``states.LAG`` to ``states.SATURATED``; then, of the forms:"""
(
    FASTEST,  # [1/s] fastest rate beside that of the law
    CONNECTED,  # 1 where a connection may give way, else 0
    CONTACT,  # [1/s] fastest rate of that connection
) = range(SATURATED + 1, CONSTANTS)
