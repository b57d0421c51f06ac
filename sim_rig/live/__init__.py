"""The plant along a clock: rig time, commands, newest samples of every channel."""

from sim_rig.live.clock import RigClock, RunningClock
from sim_rig.live.device_clock import TRUE_CLOCK, DeviceClock
from sim_rig.live.interface import RigInterface
from sim_rig.live.rig import LiveRig

__all__ = [
    "TRUE_CLOCK",
    "DeviceClock",
    "LiveRig",
    "RigClock",
    "RigInterface",
    "RunningClock",
]
