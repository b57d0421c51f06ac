"""Configuration of a bench: valid files, and the errors of invalid ones."""

import tomllib
from pathlib import Path

import pytest

from bench.config import BenchConfig, load_config
from bench.errors import ConfigError
from bench.rig.instruments import SETPOINT_TIMEOUT, SETPOINT_TIMEOUT_WITHOUT_PRIORITY, build_rig
from bench.safety.limits import Action

REAL = """
[rig]
name = "bench 2"
[instruments.drive]
driver = "actuator"
interface = "socketcan"
channel = "can1"
clamped = true
[instruments.cell]
driver = "load_cell"
url = "/dev/ttyUSB0"
[instruments.lvdt]
driver = "lvdt"
url = "rfc2217://rack:7001"
baud = 115200
parity = "E"
[instruments.coil]
driver = "coil_amplifier"
url = "tcp://10.0.0.7:502"
mode = "current"
[channels.force]
filter = { order = 2, cutoff = 300.0 }
delay = 0.0002
[limits]
force = { indicate = 800.0, trip = 1500.0 }
"""


def write_config(tmp_path, text):
    path = tmp_path / "bench.toml"
    path.write_text(text)
    return path


def test_rig_is_built_without_opening_an_instrument(tmp_path):
    config = load_config(write_config(tmp_path, REAL))
    rig = build_rig(config, lambda: 0, realtime=True)
    assert (rig.drive_kind, rig.drive_unit, rig.drive_channel) == ("coil_a", "A", "coil_current")
    assert [one.name for one in rig.instruments] == ["drive", "cell", "lvdt", "coil"]
    assert next(one.address for one in rig.instruments) == "socketcan://can1"
    assert rig.thermometer is None
    assert rig.actuator.settings.setpoint_timeout == SETPOINT_TIMEOUT
    assert not any(one.instrument.get_health().connected for one in rig.instruments)


def test_ramp_that_is_too_slow_for_a_stop_is_refused(tmp_path):
    text = REAL.replace('mode = "current"', 'mode = "current"\nramp = 1.0')
    with pytest.raises(ConfigError, match=r"ramp.*20"):
        load_config(write_config(tmp_path, text))


@pytest.mark.parametrize("key", ["setpoint_timeout", "stale_after"])
def test_setpoint_timeout_is_longer_without_priority_and_can_be_set(tmp_path, key):
    def find_timeout(text):
        config = load_config(write_config(tmp_path, text))
        return build_rig(config, lambda: 0, realtime=False).actuator.settings.setpoint_timeout

    assert find_timeout(REAL) == SETPOINT_TIMEOUT_WITHOUT_PRIORITY
    assert find_timeout(REAL.replace('channel = "can1"', f'channel = "can1"\n{key} = 0.1')) == 0.1


def test_given_limits_replace_the_default_ones():
    matrix = BenchConfig.model_validate(tomllib.loads(REAL)).limits.make_limit_matrix()
    assert matrix["force"] == {Action.INDICATE: 800.0, Action.TRIP: 1500.0}
    assert Action.TRIP in matrix["force_age"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("baud = 115200", "baud = -1"), r"\[instruments.lvdt\] baud = -1.*greater than 0"),
        (("clamped = true", "clampd = true"), r"\[instruments.drive\] clampd = True.*no such key"),
        (('driver = "lvdt"', 'driver = "ldvt"'), r"\[instruments\] lvdt.*'ldvt'.*'lvdt'"),
        (('driver = "lvdt"', 'driver = "thermometer"'), "0 instruments with driver lvdt; a bench has one of them"),
        (("trip = 1500.0", "trip = -3.0"), r"\[limits.force\] trip = -3.0"),
        (("[channels.force]", "[channels.farce]"), r"channels.*farce"),
        (('mode = "current"', 'mode = "power"'), r"\[instruments.coil\] mode = 'power'.*'voltage' or 'current'"),
        (("delay = 0.0002", "delay = nan"), r"\[channels.force\] delay = nan"),
        (
            ("clamped = true", "travel = [0.06, -0.06]"),
            r"\[instruments.drive\] travel.*smallest position first",
        ),
        (("[rig]", "[rig"), "not a TOML file"),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else None,
)
def test_error_names_file_section_key_value_and_permitted_values(tmp_path, change, message):
    assert change[0] in REAL
    path = write_config(tmp_path, REAL.replace(*change))
    with pytest.raises(ConfigError, match=message) as caught:
        load_config(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(Path(tmp_path / "none.toml"))
