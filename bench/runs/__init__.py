"""One complete run on the instruments of a bench or on the simulated plant; assessment of planned strokes."""

from bench.runs.design_check import FORESEE_COMMAND, assess_design, write_planned_strokes
from bench.runs.from_plant import run_from_plant
from bench.runs.on_rig import run_on_rig
from bench.runs.plant_process import RIG_COMMAND, play_scenario

__all__ = [
    "FORESEE_COMMAND",
    "RIG_COMMAND",
    "assess_design",
    "play_scenario",
    "run_from_plant",
    "run_on_rig",
    "write_planned_strokes",
]
