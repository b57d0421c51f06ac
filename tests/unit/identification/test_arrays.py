"""Machine code is cached between processes, but not that of functions that take other functions."""

import os
import subprocess
import sys

SCRIPT = """
import sys
import numpy as np
from identification.damper.effects import EFFECTS
from identification.simulate.memories import trace_memory, trace_path_memory
from identification.simulate.motion import compile_once

form = EFFECTS[sys.argv[1]].find_form(sys.argv[2])
path = np.array([0.0, 1e-4, 3e-4])
values = [q.scale for q in form.parameters]
memory = compile_once(form.memory)
if form.action == "hysteretic_force":
    print(trace_path_memory(memory, path, np.zeros(3), *values)[-1])
else:
    print(trace_memory(memory, form.memories, 1.0, path, *values)[-1])
"""
FORMS = [
    ("magnetic_remanence", "exponential"),
    ("seal_friction", "presliding"),
    ("magnetic_remanence", "closing"),
    ("seal_friction", "bristle"),
]


def test_processes_that_share_a_cache_compile_one_memory_after_another(tmp_path):
    environment = {**os.environ, "MRBENCH_CACHE": str(tmp_path)}
    for arguments in FORMS:
        result = subprocess.run(
            [sys.executable, "-c", SCRIPT, *arguments],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert result.returncode == 0, result.stderr[-500:]
        assert abs(float(result.stdout)) > 0.0
