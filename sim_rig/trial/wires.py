"""A case once more over wires: the simulated rig serves its instruments, the bench reaches them by its drivers."""

import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from sim_rig.trial.processes import MRBENCH, CommandFailedError, call, environment

START_WITHIN = 120.0
"""[s] in which the rig has to say where its instruments are."""
_STOP_WITHIN = 20.0
_LOOK = 0.1


def record_over_wires(method: Path, scenario: Path, log: Path) -> None:
    """Record a method from a scenario in real time, every instrument on its own wire.

    Raises:
        CommandFailedError: the rig does not come up, or the run fails.
    """
    with TemporaryDirectory(prefix="mrbench-wires-") as folder:
        config, complaints = Path(folder) / "bench.toml", Path(folder) / "complaints.txt"
        command = [*MRBENCH, "sim", "--scenario", str(scenario), "--out", str(config)]
        with complaints.open("w") as heard:
            rig = subprocess.Popen(
                command, cwd=folder, env=environment(), stdin=subprocess.DEVNULL, stdout=heard, stderr=heard
            )
        try:
            _wait_for(config, rig, complaints)
            call([*MRBENCH, "run", method, "--config", config, "--out", log], in_real_time=True)
        finally:
            rig.terminate()
            try:
                rig.wait(_STOP_WITHIN)
            except subprocess.TimeoutExpired:
                rig.kill()
                rig.wait()


def _wait_for(config: Path, rig: "subprocess.Popen[bytes]", complaints: Path) -> None:
    deadline = time.monotonic() + START_WITHIN
    while not config.exists():
        if rig.poll() is not None or time.monotonic() > deadline:
            lines = complaints.read_text().splitlines() or ["no complaint"]
            raise CommandFailedError(f"mrbench sim served nothing within {START_WITHIN:g} s: {lines[-1]}")
        time.sleep(_LOOK)
