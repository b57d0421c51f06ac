"""A double of the simulated rig as a process: it reads commands and writes channels within a second.

No machine is faster, so that kills at random moments find a campaign that still runs.
"""

import argparse
import json
import time as clock
from pathlib import Path

import numpy as np
import psutil

DURATION = 1.0
"""[s] Shortest duration of the process."""
INFO = {
    "channels": {"force": {"unit": "N", "rate_hz": 1000, "filter": None, "delay_s": 0.0}},
    "clocks": {},
    "drive_kind": "coil_v",
    "drive_unit": "V",
    "specimen": {"name": "double"},
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    for name in ("--scenario", "--commands", "--out", "--seed", "--temperature"):
        parser.add_argument(name)
    given = parser.parse_args()
    with np.load(given.commands) as commands:
        time, displacement, drive = (commands[name] for name in ("time", "displacement", "drive"))
    arrays = {"time": time, "displacement": displacement, "force": 900 * drive, "coil_drive": drive}
    arrays["temperature"] = np.full(len(time), 22.0)
    clock.sleep(max(DURATION - (clock.time() - psutil.Process().create_time()), 0.0))
    with Path(given.out).open("wb") as file:
        np.savez(file, info=np.array(json.dumps(INFO)), **arrays)
