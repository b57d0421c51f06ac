"""Servers of the wire protocols: Modbus, serial lines, CANopen over socketcand; and wire faults."""

from sim_rig.protocols.canopen_slave import CanopenSlave, SendFrame
from sim_rig.protocols.fault_proxy import FaultProxy, WireFault, load_wire_faults
from sim_rig.protocols.modbus_frames import MBAP
from sim_rig.protocols.modbus_requests import ModbusDevice, ModbusRequestError
from sim_rig.protocols.modbus_server import ModbusServer
from sim_rig.protocols.object_dictionary import ObjectDictionary
from sim_rig.protocols.serial_adapter import SerialAdapter
from sim_rig.protocols.serial_port import SerialPort
from sim_rig.protocols.socketcand_server import SocketcandServer

__all__ = [
    "MBAP",
    "CanopenSlave",
    "FaultProxy",
    "ModbusDevice",
    "ModbusRequestError",
    "ModbusServer",
    "ObjectDictionary",
    "SendFrame",
    "SerialAdapter",
    "SerialPort",
    "SocketcandServer",
    "WireFault",
    "load_wire_faults",
]
