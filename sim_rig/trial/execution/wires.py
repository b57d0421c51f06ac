"""Recording of a case over wires: the simulated rig serves its instruments to the drivers of the bench."""

import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from sim_rig.trial.execution.processes import MRBENCH, CommandFailedError, make_environment, run_command

START_TIMEOUT = 120.0
"""[s] timeout for the rig to write its addresses."""
_STOP_TIMEOUT = 20.0
"""[s] after which a rig that does not end is killed."""
_POLL_PERIOD = 0.1
"""[s] between two checks for the addresses."""


def record_over_wires(method: Path, scenario: Path, log: Path) -> None:
    """Record a method from a scenario in real time, every instrument on its own wire.

    Raises:
        CommandFailedError: the rig does not start, or the run fails.
    """
    with TemporaryDirectory(prefix="mrbench-wires-") as folder:
        config, messages = Path(folder) / "bench.toml", Path(folder) / "messages.txt"
        command = [*MRBENCH, "sim", "--scenario", str(scenario), "--out", str(config)]
        with messages.open("w") as output:
            rig = subprocess.Popen(
                command, cwd=folder, env=make_environment(), stdin=subprocess.DEVNULL, stdout=output, stderr=output
            )
        try:
            _wait_for(config, rig, messages)
            run_command([*MRBENCH, "run", method, "--config", config, "--out", log], real_time=True)
        finally:
            _stop(rig)


def _stop(rig: "subprocess.Popen[bytes]") -> None:
    # By a signal that the rig handles, so that it closes its wires; killed only if it does not react.
    rig.terminate()
    try:
        rig.wait(_STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        rig.kill()
        rig.wait()


def _wait_for(config: Path, rig: "subprocess.Popen[bytes]", messages: Path) -> None:
    deadline = time.monotonic() + START_TIMEOUT
    while not config.exists():
        if rig.poll() is not None or time.monotonic() > deadline:
            lines = messages.read_text().splitlines() or ["no message"]
            raise CommandFailedError(
                f"mrbench sim did not serve its instruments within {START_TIMEOUT:g} s: {lines[-1]}"
            )
        time.sleep(_POLL_PERIOD)
