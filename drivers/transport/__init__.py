"""Transports: serial line, Modbus, CAN and CANopen."""

from drivers.transport.can_bus import CanAddress, CanBus, unpack_frame
from drivers.transport.canopen_node import CanopenNode, Emergency
from drivers.transport.canopen_pdo import PdoField, PdoMapping
from drivers.transport.modbus_address import ModbusAddress, compute_line_capacity
from drivers.transport.modbus_line import ModbusLine, RegisterReply
from drivers.transport.modbus_registers import (
    RegisterMap,
    Registers,
    RegisterType,
    WordOrder,
    count_words,
    decode_number,
    encode_number,
    load_register_map,
)
from drivers.transport.serial_line import SerialLine

__all__ = [
    "CanAddress",
    "CanBus",
    "CanopenNode",
    "Emergency",
    "ModbusAddress",
    "ModbusLine",
    "PdoField",
    "PdoMapping",
    "RegisterMap",
    "RegisterReply",
    "RegisterType",
    "Registers",
    "SerialLine",
    "WordOrder",
    "compute_line_capacity",
    "count_words",
    "decode_number",
    "encode_number",
    "load_register_map",
    "unpack_frame",
]
