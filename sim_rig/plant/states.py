"""Indices of the states and constants of the plant in their arrays."""

STATE_COUNT = 14
"""States of the plant, in the order of the names below."""
(
    COMMAND,  # [m] commanded displacement behind the command lag
    POSITION,  # [m] of the actuator
    VELOCITY,  # [m/s] of the actuator
    Y,  # [m] inner displacement
    Z,  # [m] hysteretic displacement
    FIELD,  # [V or A] u of the law
    OUTPUT,  # [V or A] of the amplifier
    TEMPERATURE,  # [degC] of the damper
    LAGGED,  # [V or A] drive behind a second lag of the coil
    ENERGY,  # [J] stored in the damper as heat
    DAMPER,  # [m] displacement of the damper behind a compliant fixture
    LIP_BEND,  # [1] deflection of a seal's lip
    LAGGED_TWICE,  # [V or A] drive behind two such lags
    GAS_POSITION,  # [m] displacement at which the gas would have the temperature of its wall
) = range(STATE_COUNT)

CONSTANT_COUNT = 28
"""Constants of actuator, amplifier, coil, heat and mounting, in the order of the names below."""
(
    COMMAND_LAG,  # [1/s] rate of the command's lag
    SERVO_BANDWIDTH,  # [rad/s] bandwidth of the servo
    SERVO_DAMPING,  # [1] damping ratio of the servo
    ACTUATOR_COMPLIANCE,  # [m/N] deflection of the actuator under load
    AMPLIFIER_RATE,  # [1/s] rate of the drive amplifier
    HEAT_CAPACITY,  # [J/K]
    HEAT_LOSS,  # [W/K]
    AMBIENT,  # [degC]
    COIL_HEAT,  # [W per squared drive] heat of the coil
    Z_SATURATION,  # [m] z_ss, limit of z in long motion
    BASE_RATE,  # [1/s] fastest rate of everything but the law
    BACKLASH,  # 1 if the mounting has backlash, else 0
    FIXTURE_COMPLIANCE,  # [m/N] of the fixture between load cell and damper
    MASS,  # [kg] between load cell and damper
    SECOND_LAG_RATE,  # [1/s] rate of the coil's second lag, 0 without one
    LAGGED_FRACTION,  # [1] of the field behind that lag
    DEAD_TIME,  # [s] between output and field
    COOLING_RATE,  # [1/s] rate at which the energy leaves the damper
    FIELD_MEMORY,  # 1 if the iron has a memory (remanence), else 0
    GAP,  # [m] of the mounting between load cell and damper
    HARDENING,  # [1/m²] of the same
    FILM_DAMPING,  # [N s/m] in that gap
    IN_GAP_STIFFNESS,  # [1] stiffness inside that gap over that outside
    BRISTLE_RATE,  # [1/m] rate over the path at which a seal's lip deflects, 0 without one
    LAG_COUNT,  # number of second lags in series, one or two
    HEAT_EXCHANGE_RATE,  # [1/s] rate at which gas takes the temperature of its wall, 0 without gas
    PEAK_RATIO,  # [1] additional deflection of the lip while sticking, over that of fast sliding
    STRIBECK_SPEED,  # [m/s] velocity over which that peak falls
) = range(CONSTANT_COUNT)
