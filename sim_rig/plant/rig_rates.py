"""Time derivatives of the states around the damper: actuator, amplifier, coil and heat.

The actuator is a servo: a first-order lag of the command, followed by a second-order position loop that the force
on the rod deflects by force / stiffness.
"""

from sim_rig.plant.defined_effects import DRIVE_PLACE, DefinedFunctions, evaluate
from sim_rig.plant.jit import Array, compile_function
from sim_rig.plant.law import compute_field_rate
from sim_rig.plant.states import (
    ACTUATOR_COMPLIANCE,
    AMBIENT,
    AMPLIFIER_RATE,
    COIL_HEAT,
    COMMAND,
    COMMAND_LAG,
    COOLING_RATE,
    DEAD_TIME,
    ENERGY,
    FIELD,
    HEAT_CAPACITY,
    HEAT_LOSS,
    LAG_COUNT,
    LAGGED,
    LAGGED_FRACTION,
    LAGGED_TWICE,
    MASS,
    OUTPUT,
    POSITION,
    SECOND_LAG_RATE,
    SERVO_BANDWIDTH,
    SERVO_DAMPING,
    TEMPERATURE,
    VELOCITY,
)


@compile_function
def compute_actuator_rates(s: Array, command: float, force: float, k: Array, rate: Array) -> None:
    """Write the rates of the actuator under the force [N] of the damper and the mass at the rod."""
    rate[COMMAND] = k[COMMAND_LAG] * (command - s[COMMAND])
    rate[POSITION] = s[VELOCITY]
    error = s[COMMAND] - s[POSITION] - k[ACTUATOR_COMPLIANCE] * force
    unloaded = k[SERVO_BANDWIDTH] * (k[SERVO_BANDWIDTH] * error - 2.0 * k[SERVO_DAMPING] * s[VELOCITY])
    # The force of the mass also deflects the rod and is this rate times the mass: solved for the rate.
    rate[VELOCITY] = unloaded / (1.0 + k[SERVO_BANDWIDTH] * k[SERVO_BANDWIDTH] * k[ACTUATOR_COMPLIANCE] * k[MASS])


@compile_function
def compute_coil_rates(
    s: Array,
    drive: float,
    delayed_output: float,
    eta: float,
    k: Array,
    defined: DefinedFunctions | None,
    rate: Array,
) -> None:
    """Write the rates from the amplifier's output through the second lag to the field."""
    rate[OUTPUT] = k[AMPLIFIER_RATE] * (drive - s[OUTPUT])
    is_delayed = k[DEAD_TIME] > 0.0
    if defined is not None:
        is_delayed |= len(defined.weights) > 0
    source = delayed_output if is_delayed else s[OUTPUT]
    if defined is not None:
        # A delayed output already contains what the effects add.
        source += 0.0 if is_delayed else evaluate(defined, DRIVE_PLACE)
    rate[LAGGED] = k[SECOND_LAG_RATE] * (source - s[LAGGED])
    rate[LAGGED_TWICE] = k[SECOND_LAG_RATE] * (s[LAGGED] - s[LAGGED_TWICE])
    fraction = k[LAGGED_FRACTION] if k[SECOND_LAG_RATE] > 0.0 else 0.0
    lagged = s[LAGGED_TWICE] if k[LAG_COUNT] > 1.0 else s[LAGGED]
    rate[FIELD] = compute_field_rate(s[FIELD], source + fraction * (lagged - source), eta)


@compile_function
def compute_heat_rates(s: Array, power: float, k: Array, rate: Array) -> None:
    """Write the rates of energy and temperature of a damper that dissipates a power [W]."""
    rate[ENERGY] = power - k[COOLING_RATE] * s[ENERGY]
    heat = power + k[COIL_HEAT] * s[OUTPUT] * s[OUTPUT]
    rate[TEMPERATURE] = (heat - k[HEAT_LOSS] * (s[TEMPERATURE] - k[AMBIENT])) / k[HEAT_CAPACITY]
