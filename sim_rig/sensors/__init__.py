"""Sensor models: from true signals to readings."""

from sim_rig.sensors.channels import CHANNELS, add_shunt, compute_true_values, make_readings, make_streams
from sim_rig.sensors.faults import apply_channel_faults, apply_faults, select_faults
from sim_rig.sensors.sensor import ChannelErrors, ChannelStream

__all__ = [
    "CHANNELS",
    "ChannelErrors",
    "ChannelStream",
    "add_shunt",
    "apply_channel_faults",
    "apply_faults",
    "compute_true_values",
    "make_readings",
    "make_streams",
    "select_faults",
]
