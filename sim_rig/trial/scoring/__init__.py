"""Scores of the blind trial."""

from sim_rig.trial.scoring.score import compute_proportion, compute_scores, is_confident
from sim_rig.trial.scoring.summary import score_trial
from sim_rig.trial.scoring.table import render_table
from sim_rig.trial.scoring.trial_report import CaseResult, Proportion, Scores, TrialReport
from sim_rig.trial.scoring.unseal import compute_force_noise, compute_true_shrinkage, unseal_case

__all__ = [
    "CaseResult",
    "Proportion",
    "Scores",
    "TrialReport",
    "compute_force_noise",
    "compute_proportion",
    "compute_scores",
    "compute_true_shrinkage",
    "is_confident",
    "render_table",
    "score_trial",
    "unseal_case",
]
