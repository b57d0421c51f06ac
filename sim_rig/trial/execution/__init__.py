"""Execution of a trial's cases: recording and diagnosis."""

from sim_rig.trial.execution.processes import MRBENCH, CommandFailedError, run_command
from sim_rig.trial.execution.run import DIAGNOSE, WIRES_SUFFIX, TrialOptions, prepare_truth, run_cases

__all__ = [
    "DIAGNOSE",
    "MRBENCH",
    "WIRES_SUFFIX",
    "CommandFailedError",
    "TrialOptions",
    "prepare_truth",
    "run_cases",
    "run_command",
]
