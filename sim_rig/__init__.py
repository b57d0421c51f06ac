"""Simulated rig: specimen, actuator, sensors and their faults, on files or on wires."""

__all__: list[str] = []
