"""Defaults and limits of the sections of a scenario, in SI units."""

import pytest
from pydantic import ValidationError

from sim_rig.scenario.sections import (
    Actuator,
    Amplifier,
    ClockDeviation,
    ClockDeviations,
    ForceSensor,
    Sensor,
    Sensors,
)

LOW_PASS = {"kind": "butterworth", "order": 2, "cutoff": 300.0}


@pytest.mark.parametrize(
    ("channel", "errors"),
    [
        (
            "displacement",
            {"noise": 2e-6, "resolution": 1e-6, "limit": 0.1, "zero_spread": 2e-5, "delay": 2e-4, "jitter": 1e-6},
        ),
        (
            "force",
            {"noise": 2.5, "resolution": 0.05, "limit": 1e4, "zero_spread": 2.0, "delay": 2e-4, "jitter": 1e-6},
        ),
        ("coil_drive", {"noise": 1e-3, "resolution": 1e-4}),
        ("actuator_position", {"noise": 1e-6, "resolution": 5e-6, "delay": 1e-3, "jitter": 2e-5}),
        ("coil_current", {"noise": 5e-4, "resolution": 1e-4}),
        ("coil_voltage", {"noise": 1e-3, "resolution": 1e-4}),
        ("temperature", {"noise": 0.03, "resolution": 0.01, "rate": 10.0}),
    ],
)
def test_default_sensor_has_the_errors_of_a_decent_laboratory(channel, errors):
    low_pass = LOW_PASS if channel in ("displacement", "force") else None
    kind = ForceSensor if channel == "force" else Sensor
    assert getattr(Sensors(), channel) == kind(**errors, filter=low_pass)


def test_a_load_cell_that_names_no_shunt_has_one():
    assert Sensors(force={"noise": 1.0}).force == ForceSensor(noise=1.0, shunt=1000.0)


@pytest.mark.parametrize(
    ("device", "ppm", "mapping_error", "drift"),
    [
        ("load_cell", 47.0, 1e-5, 3e-6),
        ("lvdt", -38.0, 1e-5, 3e-6),
        ("coil_amplifier", 0.0, 0.0, 0.0),
        ("actuator", 12.0, 1e-5, 3e-6),
        ("thermometer", -85.0, 1e-3, 0.0),
    ],
)
def test_default_clock_has_its_rate_error_and_mapping_error(device, ppm, mapping_error, drift):
    clock = getattr(ClockDeviations(), device)
    assert (clock.ppm, clock.mapping_error, clock.drift) == (ppm, mapping_error, drift)


@pytest.mark.parametrize(
    ("section", "field", "inside", "outside"),
    [
        (Actuator, "bandwidth", 500.0, 501.0),
        (Actuator, "stiffness", 1e5, 0.9e5),
        (Actuator, "command_lag", 0.1, 0.11),
        (Actuator, "force", 1e6, 1.1e6),
        (Amplifier, "bandwidth", 1e5, 1.1e5),
        (Amplifier, "resistance", 1e3, 1001.0),
        (Sensor, "jitter", 1e-3, 1.1e-3),
        (Sensor, "delay", 0.1, 0.11),
        (Sensor, "gain_error", -0.5, -0.51),
        (ClockDeviation, "ppm", 1000.0, 1001.0),
        (ClockDeviation, "ppm", -1000.0, -1001.0),
        (ClockDeviation, "mapping_error", 1e-2, 1.1e-2),
    ],
)
def test_value_at_its_limit_is_accepted_and_beyond_it_refused(section, field, inside, outside):
    assert getattr(section(**{field: inside}), field) == inside
    with pytest.raises(ValidationError):
        section(**{field: outside})
