"""Simulated instruments: load cells, LVDT, thermometer, coil amplifier and servo drive."""

from sim_rig.instruments.ascii_load_cell import make_ascii_load_cell
from sim_rig.instruments.coil_amplifier import CoilAmplifierDevice
from sim_rig.instruments.encoder import DriveMechanics, compute_torque
from sim_rig.instruments.load_cell import make_load_cell
from sim_rig.instruments.modbus_sensor import SensorDevice
from sim_rig.instruments.servo_drive import ServoDriveDevice
from sim_rig.instruments.wire_files import load_wire_file

__all__ = [
    "CoilAmplifierDevice",
    "DriveMechanics",
    "SensorDevice",
    "ServoDriveDevice",
    "compute_torque",
    "load_wire_file",
    "make_ascii_load_cell",
    "make_load_cell",
]
