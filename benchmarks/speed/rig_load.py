"""Processor time of the simulated rig and of the rig agent while a run is recorded at 1 kHz over the wires.

python -m benchmarks rig_load               the method ``quick``
python -m benchmarks.speed.rig_load NAME    another method

Both consist mostly of waking up, which takes a different time on each machine and under each load. The baseline of
the same run is therefore a process that only wakes up a thousand times a second.
"""

import json
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.log import read_log
from benchmarks.common import print_line
from benchmarks.speed.soak import record_over_wires

METHOD = "quick"
_BASELINE = "baseline: a process that wakes up every millisecond"
_WAKING_LOOP = "import time\nwhile True: time.sleep(1e-3)"


def run(method: str = METHOD) -> None:
    """Print the core load of rig, agent and baseline during a run, and the lost samples of the run."""
    with TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        shares = record_over_wires(method, log, {_BASELINE: _WAKING_LOOP})
        recorded = read_log(log)
    lost = json.loads(recorded.metadata["outcome"]["lost"])
    samples = len(recorded.samples["time"])
    print(f"rig load: {method}, {samples} samples, outcome {recorded.outcome}, lost: {lost or 'nothing'}")
    shares["rig and agent"] = shares["simulated rig"] + shares["agent"]
    for name, share in shares.items():
        print_line(name, share, "s/s", f"{share / shares[_BASELINE]:.1f} times the baseline")


if __name__ == "__main__":
    run(*sys.argv[1:])
