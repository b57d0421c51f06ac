"""States and constants of the motion with sealed forms: what stands where in their arrays."""

from sim_rig.scenarios.sealed.form import MEMORY

MOST_FORMS = 3
"""Forms in one scenario."""
COMMAND, POSITION, SPEED, Y, Z, FIELD, OUTPUT, TEMPERATURE, PATH, DAMPER = range(10)
"""Command behind the lag, actuator position [both m] and velocity [m/s], y, z [both m], field, amplifier output
[both V or A], temperature [degC], path travelled and displacement of the damper [both m]; then the memories."""
STATES = 10 + MOST_FORMS * MEMORY

(
    LAG,  # [1/s] rate of the command's lag
    SERVO,  # [rad/s] bandwidth of the servo
    DAMPING,  # [1] damping ratio of the servo
    COMPLIANCE,  # [m/N] deflection of the actuator under load
    AMPLIFIER,  # [1/s] rate of the drive amplifier
    HEAT_CAPACITY,  # [J/K]
    HEAT_LOSS,  # [W/K]
    AMBIENT,  # [degC]
    COIL,  # [W per squared drive] heat of the coil
    SATURATED,  # [m] where z settles in long motion
    FASTEST,  # [1/s] fastest rate beside that of the law
    CONNECTED,  # 1 where a connection may give way, else 0
    CONTACT,  # [1/s] fastest rate of that connection
) = range(13)
CONSTANTS = 13
