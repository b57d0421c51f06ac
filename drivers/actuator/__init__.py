"""Driver of the servo drive (CANopen, CiA 402)."""

from drivers.actuator.actuator import Actuator
from drivers.actuator.sample_decoder import ActuatorDecoder, CountScale
from drivers.actuator.servo_drive import METRES_PER_COUNT, ActuatorSettings

__all__ = [
    "METRES_PER_COUNT",
    "Actuator",
    "ActuatorDecoder",
    "ActuatorSettings",
    "CountScale",
]
