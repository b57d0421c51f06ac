"""States and constants of the motion: what stands where in their arrays."""

STATES = 14
"""Command behind the lag [m], actuator position [m] and velocity [m/s], y [m], z [m], field u, amplifier output
[both V or A], temperature [degC], drive behind a second lag [V or A], energy in the damper [J], displacement of
the damper behind a fixture that gives way [m], bend of a seal's lip [1], drive behind two such lags [V or A],
displacement at which the gas had the temperature of its wall [m]."""
(
    *(COMMAND, POSITION, SPEED, Y, Z, FIELD, OUTPUT, TEMPERATURE, LAGGED, ENERGY, BEHIND, BENT, TWICE),
    FOLLOWED,
) = range(STATES)

CONSTANTS = 26
"""Rates and weights of everything but the law, in the order of the names below."""
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
    SATURATED,  # [m] z_ss, where z settles in long motion
    EVER_PRESENT,  # [1/s] fastest rate beside that of the law
    PLAY,  # 1 where the mounting holds the damper back, else 0
    GIVE,  # [m/N] of the fixture between load cell and damper
    MASS,  # [kg] between load cell and damper
    SECOND_LAG,  # [1/s] rate of the coil's second lag, 0 without one
    SLOW_PART,  # [1] of the field behind that lag
    DEAD_TIME,  # [s] between output and field
    COOLING,  # [1/s] rate with which the energy leaves the damper
    MEMORY,  # 1 where the iron remembers, else 0
    GAP,  # [m] of the connection between load cell and damper
    HARDENING,  # [1/m²] of the same
    FILM,  # [N s/m] in that gap
    INSIDE,  # [1] stiffness in that gap over that outside
    BRISTLES,  # [1/m] rate over the way with which a seal's lip bends, 0 without one
    LAYERS,  # second lags in a row, one or two
    EXCHANGE,  # [1/s] rate with which gas takes the temperature of its wall, 0 without
) = range(CONSTANTS)
