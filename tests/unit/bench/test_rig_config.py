"""``bench.toml``: what it takes, and what it says of what it does not."""

import tomllib
from pathlib import Path

import pytest

from bench.errors import ConfigError
from bench.rig.config import BenchConfig, load_config
from bench.rig.instruments import STALE_AFTER, STALE_WITHOUT_PRIORITY, build_rig
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


def written(tmp_path, text):
    path = tmp_path / "bench.toml"
    path.write_text(text)
    return path


def test_a_real_bench_is_built_without_opening_anything(tmp_path):
    config = load_config(written(tmp_path, REAL))
    rig = build_rig(config, lambda: 0, prompt=True)
    assert (rig.drive_kind, rig.drive_unit, rig.drive_channel) == ("coil_a", "A", "coil_current")
    assert [one.name for one in rig.named] == ["drive", "cell", "lvdt", "coil"]
    assert next(one.address for one in rig.named) == "socketcan://can1"
    assert rig.thermometer is None
    assert rig.actuator.settings.stale_after == STALE_AFTER
    assert not any(one.instrument.health().connected for one in rig.named)


def test_a_ramp_that_a_stop_could_not_wait_for_is_refused(tmp_path):
    text = REAL.replace('mode = "current"', 'mode = "current"\nramp = 1.0')
    with pytest.raises(ConfigError, match=r"ramp.*20"):
        load_config(written(tmp_path, text))


def test_a_drive_waits_longer_for_an_agent_without_priority(tmp_path):
    config = load_config(written(tmp_path, REAL))
    assert build_rig(config, lambda: 0, prompt=False).actuator.settings.stale_after == STALE_WITHOUT_PRIORITY
    own = REAL.replace('channel = "can1"', 'channel = "can1"\nstale_after = 0.1')
    config = load_config(written(tmp_path, own))
    assert build_rig(config, lambda: 0, prompt=False).actuator.settings.stale_after == 0.1


def test_limits_that_are_given_take_the_place_of_the_usual_ones():
    matrix = BenchConfig.model_validate(tomllib.loads(REAL)).limits.matrix()
    assert matrix["force"] == {Action.INDICATE: 800.0, Action.TRIP: 1500.0}
    assert Action.TRIP in matrix["force_age"]


@pytest.mark.parametrize(
    ("change", "words"),
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
            r"\[instruments.drive\] travel.*least position stands first",
        ),
        (("[rig]", "[rig"), "no TOML"),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else None,
)
def test_an_error_names_file_section_key_value_and_what_is_allowed(tmp_path, change, words):
    assert change[0] in REAL
    path = written(tmp_path, REAL.replace(*change))
    with pytest.raises(ConfigError, match=words) as caught:
        load_config(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        load_config(Path(tmp_path / "none.toml"))
