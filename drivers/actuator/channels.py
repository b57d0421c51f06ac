"""Channels of the servo drive: the objects behind them and their ranges."""

from drivers.actuator.sample_decoder import POSITION, TORQUE, VELOCITY
from drivers.actuator.servo_drive import ActuatorSettings
from drivers.channel import Channel

OBJECTS = {"actuator_position": POSITION, "actuator_velocity": VELOCITY, "actuator_torque": TORQUE}
"""Object of each channel in the drive's dictionary."""


def make_channels(settings: ActuatorSettings, origin: float, rated_torque: float) -> tuple[Channel, ...]:
    """Make the channels, with ranges from travel, origin [m from home] and rated torque [N m]."""
    low, high = (limit - origin for limit in settings.travel)
    # Wider than the limits of the drive, so that a rod or motor beyond its limits is still measured.
    speed, torque = 4 * settings.max_speed, 4 * rated_torque
    return (
        Channel("actuator_position", "m", low, high, "read_write", "rod position by the drive's encoder"),
        Channel("actuator_velocity", "m/s", -speed, speed, "read", "rod velocity by the drive"),
        Channel("actuator_torque", "N m", -torque, torque, "read", "torque of the motor"),
    )
