"""Result of a trial from its folder."""

from sim_rig.errors import TrialError
from sim_rig.trial.cases import TrialFolder, read_sealed_truth
from sim_rig.trial.execution import WIRES_SUFFIX, TrialOptions
from sim_rig.trial.scoring.score import compute_scores
from sim_rig.trial.scoring.trial_report import TrialReport
from sim_rig.trial.scoring.unseal import unseal_case


def score_trial(folder: TrialFolder, options: TrialOptions) -> TrialReport:
    """Open the sealed truth, compare it with the diagnoses, and score.

    Raises:
        TrialError: nothing is sealed, or the truth differs from the published hash.
    """
    seal = folder.read_seal()
    if seal is None:
        raise TrialError(f"{folder.root}: nothing is sealed here; run the trial first")
    truth = read_sealed_truth(folder.truth, seal.sha256)
    cases = [unseal_case(folder, case, case.id) for case in truth.cases]
    cases += [unseal_case(folder, case, case.id + WIRES_SUFFIX) for case in truth.cases[: options.wired]]
    return TrialReport(
        version=seal.version,
        seed=seal.seed,
        kind=seal.kind,
        sealed_sha256=seal.sha256,
        scores=compute_scores(cases),
        cases=tuple(cases),
    )
