"""Scenarios: damper, effects, sensors, clocks and faults that the simulated rig plays."""

from sim_rig.scenario.alternative_effects import find_form, get_size
from sim_rig.scenario.scenario import Scenario, load_scenario, parse_scenario
from sim_rig.scenario.sections import (
    ActiveEffect,
    ChannelFault,
    ClockDeviation,
    Filter,
    ForceSensor,
    Sensor,
    Sensors,
)

__all__ = [
    "ActiveEffect",
    "ChannelFault",
    "ClockDeviation",
    "Filter",
    "ForceSensor",
    "Scenario",
    "Sensor",
    "Sensors",
    "find_form",
    "get_size",
    "load_scenario",
    "parse_scenario",
]
