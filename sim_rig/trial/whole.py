"""The whole answer, from the folder of a trial that has ended."""

from sim_rig.errors import TrialError
from sim_rig.trial.answer import Trial
from sim_rig.trial.folder import TrialFolder
from sim_rig.trial.run import WIRES, Plan
from sim_rig.trial.score import scores
from sim_rig.trial.truth import read_sealed
from sim_rig.trial.unseal import unsealed


def answer(folder: TrialFolder, plan: Plan) -> Trial:
    """Break the seal, put truth and diagnoses side by side, and score.

    Raises:
        TrialError: nothing is sealed, or the truth is not what was published.
    """
    seal = folder.seal()
    if seal is None:
        raise TrialError(f"{folder.root}: nothing is sealed here; run the trial first")
    truth = read_sealed(folder.truth, seal.sha256)
    cases = [unsealed(folder, case, case.id) for case in truth.cases]
    cases += [unsealed(folder, case, case.id + WIRES) for case in truth.cases[: plan.over_wires]]
    return Trial(
        version=seal.version,
        seed=seal.seed,
        draw=seal.draw,
        sealed_sha256=seal.sha256,
        scores=scores(cases),
        cases=tuple(cases),
    )
