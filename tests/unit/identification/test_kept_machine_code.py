"""Machine code is kept between processes, but not that of functions that take other functions."""

import os
import subprocess
import sys

SCRIPT = """
import sys
import numpy as np
from identification.damper.effects import EFFECTS
from identification.simulate.inputs import remembered
from identification.simulate.motion import machine

form = EFFECTS[sys.argv[1]].form(sys.argv[2])
way = np.array([0.0, 1e-4, 3e-4])
print(remembered(machine(form.memory), way, *(q.scale for q in form.parameters))[-1])
"""
FORMS = [
    ("magnetic_remanence", "exponential"),
    ("seal_friction", "bending_lip"),
    ("magnetic_remanence", "closing"),
    ("seal_friction", "bending_lip"),
]


def test_one_memory_after_another_is_followed_by_processes_that_share_what_they_keep(tmp_path):
    environment = {**os.environ, "MRBENCH_CACHE": str(tmp_path)}
    for words in FORMS:
        ended = subprocess.run(
            [sys.executable, "-c", SCRIPT, *words], env=environment, capture_output=True, text=True, check=False
        )
        assert ended.returncode == 0, ended.stderr[-500:]
        assert abs(float(ended.stdout)) > 0.0
