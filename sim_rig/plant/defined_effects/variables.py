"""Variables of defined effects in compiled code, and the memory from which those of the past follow.

Memory is updated once per integration step, from its end. Inside a step, a variable is computed from the memory
and the present stage. Stages are trial points and must not change the memory. The drive is held, so its memory is
updated where the drive may change.
"""

from typing import Any

import numpy as np

from sim_rig.plant.jit import compile_function

VARIABLE_COUNT = 11
"""Variables, in the order of the names below."""
(
    DISPLACEMENT,  # [m] of the damper
    VELOCITY,  # [m/s] of the damper
    ACCELERATION,  # [m/s²] of the actuator
    TRAVEL_SINCE_REVERSAL,  # [m]
    TRAVEL_SINCE_REST,  # [m]
    DRIVE,  # [V or A] commanded drive, held
    DRIVE_HISTORY,  # [V or A] drive at its last reversal
    FIELD,  # [V or A] behind the lag of the coil
    FIELD_HISTORY,  # [V or A] field at its last reversal
    TIME,  # [s] since the start of the run
    DISSIPATED_ENERGY,  # [J] since the start of the run
) = range(VARIABLE_COUNT)

MEMORY_COUNT = 14
"""Memory, in the order of the names below."""
(
    _STEADY,  # [m] displacement after the deadband
    _DIRECTION,  # sign of its last change, 0 before any
    _REVERSAL,  # [m] its value at its last reversal
    _PATH,  # [m] its path since the last rest
    _LAST_CHANGE,  # [s] time of its last change
    _DRIVE_DIRECTION,  # sign of the last change of the drive, 0 before any
    _DRIVE_EXTREME,  # [V or A] farthest value since its last reversal
    _DRIVE_REVERSAL,  # [V or A] its value at its last reversal
    _FIELD_DIRECTION,  # the same of the field
    _FIELD_EXTREME,
    _FIELD_REVERSAL,
    _LOST_ENERGY,  # [J] energy that the damper has lost as heat
    _ASSUMED,  # [m/s²] acceleration that the last evaluation assumed
    _DEVIATION,  # [m/s²] acceleration that resulted from it, minus that
) = range(MEMORY_COUNT)

DEADBAND = 1e-6
"""[m] half width of the deadband of the displacement."""
REST_TIME = 0.2
"""[s] time without a change of the displacement, after the deadband, that counts as rest."""
_DRIVE_TOLERANCE = 1e-6
"""[V or A] least return from an extreme that counts as a reversal: rounding moves a settled field."""


@compile_function
def start_variables(functions: Any, displacement: float, drive: float, field: float) -> None:
    """Start at rest at a displacement [m] of the damper, with a drive and a field [V or A]."""
    variables, memory = functions.variables, functions.memory
    variables[:], memory[:] = 0.0, 0.0
    memory[_STEADY] = memory[_REVERSAL] = displacement
    memory[_DRIVE_EXTREME] = memory[_DRIVE_REVERSAL] = drive
    memory[_FIELD_EXTREME] = memory[_FIELD_REVERSAL] = field
    variables[DISPLACEMENT] = displacement
    variables[DRIVE], variables[DRIVE_HISTORY] = drive, drive
    variables[FIELD], variables[FIELD_HISTORY] = field, field


@compile_function
def _follow_displacement(memory: Any, x: float, time: float) -> tuple[float, float, float, float, float]:
    """Return the memory of the displacement, `_STEADY` to `_LAST_CHANGE`, after it became x [m] at a time [s]."""
    last = memory[_STEADY]
    steady = min(max(last, x - DEADBAND), x + DEADBAND)
    change = steady - last
    path = 0.0 if time - memory[_LAST_CHANGE] >= REST_TIME else memory[_PATH]
    if change == 0.0:
        return last, memory[_DIRECTION], memory[_REVERSAL], path, memory[_LAST_CHANGE]
    reversal = last if change * memory[_DIRECTION] < 0.0 else memory[_REVERSAL]
    return steady, np.sign(change), reversal, path + abs(change), time


@compile_function
def _follow_turns(memory: Any, first: int, value: float) -> tuple[float, float, float]:
    """Return direction, extreme and value at the last reversal after a drive or field has become ``value``."""
    direction, extreme, reversal = memory[first], memory[first + 1], memory[first + 2]
    change = value - extreme
    if direction == 0.0:
        moved = abs(change) > _DRIVE_TOLERANCE
        return (np.sign(change), value, reversal) if moved else (direction, extreme, reversal)
    if change * direction >= 0.0:
        return direction, value, reversal
    if abs(change) > _DRIVE_TOLERANCE:
        return -direction, value, extreme
    return direction, extreme, reversal


@compile_function
def hold_drive(functions: Any, drive: float) -> None:
    """Set the commanded drive [V or A]."""
    variables, memory = functions.variables, functions.memory
    turns = _follow_turns(memory, _DRIVE_DIRECTION, drive)
    memory[_DRIVE_DIRECTION], memory[_DRIVE_EXTREME], memory[_DRIVE_REVERSAL] = turns
    variables[DRIVE], variables[DRIVE_HISTORY] = drive, turns[2]


@compile_function
def respond_to_drive(functions: Any, drive: float, substep: int) -> float:
    """Return the response to the drive [V or A] of a substep and to those before it."""
    weights, window = functions.weights, functions.window
    count = len(weights)
    if count == 0:
        return drive
    newest = substep % count
    window[newest] = drive
    response = 0.0
    for j in range(newest + 1):
        response += weights[j] * window[newest - j]
    for j in range(newest + 1, count):
        response += weights[j] * window[newest - j + count]
    return response


@compile_function
def set_variables(functions: Any, x: float, field: float, energy: float, time: float) -> None:
    """Set the variables of a stage, except the velocity and the acceleration.

    Args:
        functions: `DefinedFunctions`.
        x: [m] displacement of the damper.
        field: [V or A] behind the coil's lag.
        energy: [J] stored in the damper as heat.
        time: [s] since the start of the run.
    """
    variables, memory = functions.variables, functions.memory
    steady, _, reversal, path, _ = _follow_displacement(memory, x, time)
    variables[DISPLACEMENT], variables[TIME] = x, time
    variables[TRAVEL_SINCE_REVERSAL], variables[TRAVEL_SINCE_REST] = abs(steady - reversal), path
    variables[FIELD], variables[FIELD_HISTORY] = field, _follow_turns(memory, _FIELD_DIRECTION, field)[2]
    variables[DISSIPATED_ENERGY] = energy + memory[_LOST_ENERGY]


@compile_function
def set_velocity(functions: Any, velocity: float) -> None:
    """Set the velocity [m/s] of the damper."""
    functions.variables[VELOCITY] = velocity


@compile_function
def update_memory(functions: Any, x: float, field: float, lost_energy: float, time: float) -> None:
    """Update the memory at the end of an integration step in which the damper has lost an energy [J] as heat.

    The other arguments are those of `set_variables`.
    """
    memory = functions.memory
    path = _follow_displacement(memory, x, time)
    memory[_STEADY], memory[_DIRECTION], memory[_REVERSAL], memory[_PATH], memory[_LAST_CHANGE] = path
    turns = _follow_turns(memory, _FIELD_DIRECTION, field)
    memory[_FIELD_DIRECTION], memory[_FIELD_EXTREME], memory[_FIELD_REVERSAL] = turns
    memory[_LOST_ENERGY] += lost_energy


@compile_function
def improve_acceleration(functions: Any, resulting: float, first: bool) -> None:
    """Set the acceleration [m/s²] for the next evaluation from that which resulted from the last, by a secant."""
    variables, memory = functions.variables, functions.memory
    assumed = variables[ACCELERATION]
    deviation = resulting - assumed
    slope = 0.0 if first else deviation - memory[_DEVIATION]
    # A force proportional to the acceleration makes the secant exact, for a mass of any size.
    step = -deviation * (assumed - memory[_ASSUMED]) / slope if slope != 0.0 else deviation
    memory[_ASSUMED], memory[_DEVIATION] = assumed, deviation
    variables[ACCELERATION] = assumed + step
