"""Shared parts of the benchmarks: timing, cache, workspace."""

from benchmarks.common import cache
from benchmarks.common.cache import load_figures, make_parser, open_folder, run_mrbench, select_names
from benchmarks.common.cycle_average import POINTS, Cycles, find_cycles
from benchmarks.common.effect_logs import COMMON_EFFECTS, NO_EFFECT, lengthen_method, make_scenario, record_effect
from benchmarks.common.prediction_series import PredictionSeries, read_series
from benchmarks.common.timing import make_sine, measure_cpu_time, measure_reference_time, print_line, time_call
from benchmarks.common.workspace import SimulatedFit, Workspace

__all__ = [
    "NO_EFFECT",
    "POINTS",
    "COMMON_EFFECTS",
    "Cycles",
    "Workspace",
    "SimulatedFit",
    "PredictionSeries",
    "cache",
    "select_names",
    "measure_cpu_time",
    "find_cycles",
    "load_figures",
    "open_folder",
    "print_line",
    "run_mrbench",
    "make_parser",
    "read_series",
    "record_effect",
    "measure_reference_time",
    "make_scenario",
    "make_sine",
    "lengthen_method",
    "time_call",
]
