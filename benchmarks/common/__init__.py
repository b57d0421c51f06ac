"""Shared parts of the benchmarks: timing, cache, workspace."""

from benchmarks.common import cache
from benchmarks.common.cache import load_results, make_parser, open_folder, run_mrbench, select_names
from benchmarks.common.cycle_average import POINTS, Cycles, find_cycles
from benchmarks.common.effect_logs import COMMON_EFFECTS, NO_EFFECT, lengthen_method, make_scenario, record_effect
from benchmarks.common.prediction_series import PredictionSeries, read_series
from benchmarks.common.timing import make_sine, measure_cpu_time, measure_reference_time, print_line, time_call
from benchmarks.common.workspace import SimulatedFit, Workspace

__all__ = [
    "COMMON_EFFECTS",
    "NO_EFFECT",
    "POINTS",
    "Cycles",
    "PredictionSeries",
    "SimulatedFit",
    "Workspace",
    "cache",
    "find_cycles",
    "lengthen_method",
    "load_results",
    "make_parser",
    "make_scenario",
    "make_sine",
    "measure_cpu_time",
    "measure_reference_time",
    "open_folder",
    "print_line",
    "read_series",
    "record_effect",
    "run_mrbench",
    "select_names",
    "time_call",
]
