"""Where the paper's training takes the parameters, from the regression's start to its end.

python -m benchmarks.pinn_drift                    both readings of the derivative, and eta held
python -m benchmarks.pinn_drift total              one of them
"""

import sys
from collections.abc import Mapping

import torch

from benchmarks.pinn_cases import LABORATORY, pooled_error, problem_of, unseen_ratio
from identification.damper.coordinates import to_coordinates
from identification.damper.parameters import Parameters
from identification.pinn.paper_runs import PaperTraining
from identification.pinn.settings import PaperSettings, read_settings
from identification.pinn.split import validation_masks
from identification.pinn.supervision import Supervision

SEED = 0
SHOWN = (100, 400, 1000, 4000, 4100, 4200)
"""Steps, of Adam and then of L-BFGS, after which a row is printed."""
FOLLOWED = ("F_b", "D_y", "eta", "c0_a", "c1_a")
CASES: Mapping[str, tuple[str, bool]] = {
    "total": ("total", False), "held": ("total", True), "partial": ("partial", False),
}  # fmt: skip
"""Which derivative, and whether eta stays where it starts."""


def training(derivative: str, supervision: Supervision) -> PaperTraining:
    """The preset `paper` on six voltages."""
    settings = read_settings("paper")
    assert isinstance(settings, PaperSettings)
    settings = settings.model_copy(update={"seed": SEED, "derivative": derivative})
    problem = problem_of(LABORATORY, SEED)
    held = validation_masks(problem.pieces, settings.validation_share, SEED)
    return PaperTraining(problem, held, settings, supervision)


def follow(derivative: str, *, hold_eta: bool) -> None:
    """Print what is found on the way."""
    torch.set_num_threads(1)
    print(f"derivative: {derivative}{', eta held' if hold_eta else ''}; unseen and pooled error, own force over")
    print(f"the noise, and {', '.join(FOLLOWED)} over the true ones")

    def row(what: str, error: float) -> None:
        if trained.steps in SHOWN:
            _row(trained, error)

    trained = training(derivative, Supervision(progress=row))
    if hold_eta:
        moved = torch.tensor([name != "eta" for name in Parameters._fields])
        trained.raw.register_hook(lambda slopes: slopes * moved)
    _row(trained, float("nan"))
    trained.run()


def _row(trained: PaperTraining, error: float) -> None:
    """What the training holds; it is judged by what it would hand out, which lies within the search's bounds."""
    problem, found = trained.problem, to_coordinates(trained.parameters())
    given = problem.space.to_coordinates(problem.space.to_search(found))
    parts = " ".join(f"{getattr(found, name) / getattr(LABORATORY, name):9.3g}" for name in FOLLOWED)
    unseen, pooled = unseen_ratio(given, LABORATORY, SEED), pooled_error(problem, given, LABORATORY)
    print(f"  {trained.steps:>5} {unseen:8.3g} {pooled:8.3g} {error / problem.noise:8.3g}   {parts}", flush=True)


if __name__ == "__main__":
    for name in sys.argv[1:] or CASES:
        follow(CASES[name][0], hold_eta=CASES[name][1])
