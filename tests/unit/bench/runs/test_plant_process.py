"""Simulated rig as a process: commands in, channels out, and its failures."""

import sys
import textwrap

import numpy as np
import pytest

from bench.errors import RunError
from bench.runs.plant_process import play_scenario

GIVEN = {name: np.linspace(0, 1, 20) for name in ("time", "displacement", "drive")}
WRITES = """
    import sys, numpy as np
    out = sys.argv[sys.argv.index("--out") + 1]
    given = np.load(sys.argv[sys.argv.index("--commands") + 1])
    found = {"time": given["time"], "displacement": given["displacement"], "coil_drive": given["drive"]}
    found |= {"force": 2 * given["drive"], "info": np.array('{"drive_unit": "V"}')}
"""


def rig(code: str) -> tuple[str, ...]:
    """Return the command of a rig that executes this code."""
    return (sys.executable, "-c", textwrap.dedent(code))


def test_commands_reach_the_rig_and_its_channels_come_back():
    shares: list[float] = []
    said = """
    print('{"progress": 0.5}', file=sys.stderr)
    print('', file=sys.stderr)
    np.savez(out, **found)
    """
    found = play_scenario("any", GIVEN, shares.append, rig(WRITES + said))
    assert found.channels["force"] == pytest.approx(2 * GIVEN["drive"])
    assert found.info == {"drive_unit": "V"}
    assert shares == [0.5]


def test_last_line_of_a_failing_rig_is_its_error():
    code = "import sys; sys.stderr.write('first\\nsim_rig: no such scenario\\n'); sys.exit(1)"
    with pytest.raises(RunError, match=r"^the simulated rig failed: no such scenario$"):
        play_scenario("any", GIVEN, rig=rig(code))


def test_failure_without_output_is_reported_by_its_exit_status():
    with pytest.raises(RunError, match="exit status 3"):
        play_scenario("any", GIVEN, rig=rig("import sys; sys.exit(3)"))


def test_rig_that_cannot_be_started_is_an_error():
    with pytest.raises(RunError, match="cannot be started"):
        play_scenario("any", GIVEN, rig=("/nowhere/rig",))


def test_silent_rig_is_stopped():
    with pytest.raises(RunError, match=r"was silent for 0\.3 s and was stopped"):
        play_scenario("any", GIVEN, rig=rig("import time; time.sleep(60)"), silence_timeout=0.3)


@pytest.mark.parametrize(
    ("code", "words"),
    [
        ("", "returned no usable channels"),
        ("open(out, 'w').write('no zip')", "returned no usable channels"),
        ("del found['info']; np.savez(out, **found)", "returned no usable channels"),
        ("del found['force']; np.savez(out, **found)", "returned no channel force"),
        ("found['force'] = np.zeros(3); np.savez(out, **found)", "returned 3 values of force for 20 commands"),
    ],
)
def test_unusable_channels_are_refused(code, words):
    with pytest.raises(RunError, match=words):
        play_scenario("any", GIVEN, rig=rig(WRITES + "    " + code + "\n"))
