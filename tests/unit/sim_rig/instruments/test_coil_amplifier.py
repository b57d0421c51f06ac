"""Simulated coil amplifier without its wire: whether its output changes by itself."""

import pytest

from sim_rig.instruments.coil_amplifier import CoilAmplifierDevice

SECOND = 1_000_000_000
WATCHDOG = 0.5
"""[s]"""


@pytest.fixture
def amplifier(signals):
    return CoilAmplifierDevice(signals)


def write(amplifier, name, value):
    """Set a register of two words by its name."""
    entry = next(one for one in amplifier._document["register"] if one["name"] == name)
    number = round(value / entry.get("scale", 1.0))
    words = [number] if entry["type"].endswith("16") else [number >> 16, number & 0xFFFF]
    low_first = amplifier._document["word_order"] == "low_first"
    amplifier.write(entry["address"], words[::-1] if low_first else words)


def test_an_output_at_rest_does_not_change_until_requests_are_missing(signals, amplifier):
    signals.now = SECOND
    write(amplifier, "watchdog", WATCHDOG)
    assert not amplifier.follow_time()
    signals.now += round(0.4 * WATCHDOG * SECOND)
    assert not amplifier.follow_time()
    signals.now += round(0.2 * WATCHDOG * SECOND)
    assert amplifier.follow_time()


def test_an_output_changes_while_it_ramps_to_its_target(signals, amplifier):
    write(amplifier, "mode", 1)
    write(amplifier, "ramp", 10.0)
    write(amplifier, "setpoint", 1.0)
    signals.now += SECOND // 20
    assert amplifier.follow_time()
    assert signals.commands[-1] == ("drive", pytest.approx(0.5))
    signals.now += SECOND // 10
    assert not amplifier.follow_time()
    assert signals.commands[-1] == ("drive", 1.0)
