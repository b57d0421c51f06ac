"""Where the paper's training takes the parameters, from the regression's start to its end.

python -m benchmarks.pinn.drift                    both readings of the derivative, and eta held
python -m benchmarks.pinn.drift total              one of them
"""

import sys
from collections.abc import Mapping

import torch

from benchmarks.pinn.cases import LABORATORY, compute_pooled_error, compute_validation_ratio, make_case_problem
from identification.damper import Parameters, to_coordinates
from identification.pinn.common import PaperSettings, TrainingMonitor, make_validation_masks, read_settings
from identification.pinn.paper import PaperTraining

SEED = 0
REPORT_STEPS = (100, 400, 1000, 4000, 4100, 4200)
"""Steps, of Adam and then of L-BFGS, after which a row is printed."""
TRACKED_COORDINATES = ("F_b", "D_y", "eta", "c0_a", "c1_a")
CASES: Mapping[str, tuple[str, bool]] = {
    "total": ("total", False), "held": ("total", True), "partial": ("partial", False),
}  # fmt: skip
"""Which derivative, and whether eta stays where it starts."""


def make_training(derivative: str, supervision: TrainingMonitor) -> PaperTraining:
    """The preset `paper` on six voltages."""
    settings = read_settings("paper")
    assert isinstance(settings, PaperSettings)
    settings = settings.model_copy(update={"seed": SEED, "derivative": derivative})
    problem = make_case_problem(LABORATORY, SEED)
    held = make_validation_masks(problem.pieces, settings.validation_share, SEED)
    return PaperTraining(problem, held, settings, supervision)


def trace_training(derivative: str, *, hold_eta: bool) -> None:
    """Print what is found on the way."""
    torch.set_num_threads(1)
    print(f"derivative: {derivative}{', eta held' if hold_eta else ''}; unseen and pooled error, own force over")
    print(f"the noise, and {', '.join(TRACKED_COORDINATES)} over the true ones")

    def row(what: str, error: float) -> None:
        if trained.steps in REPORT_STEPS:
            _print_row(trained, error)

    trained = make_training(derivative, TrainingMonitor(progress=row))
    if hold_eta:
        moved = torch.tensor([name != "eta" for name in Parameters._fields])
        trained.search_coordinates.register_hook(lambda slopes: slopes * moved)
    _print_row(trained, float("nan"))
    trained.run()


def _print_row(trained: PaperTraining, error: float) -> None:
    """What the training holds; it is judged by what it would hand out, which lies within the search's bounds."""
    problem, found = trained.problem, to_coordinates(trained.get_parameters())
    given = problem.space.to_coordinates(problem.space.to_search(found))
    parts = " ".join(f"{getattr(found, name) / getattr(LABORATORY, name):9.3g}" for name in TRACKED_COORDINATES)
    unseen, pooled = (
        compute_validation_ratio(given, LABORATORY, SEED),
        compute_pooled_error(problem, given, LABORATORY),
    )
    print(f"  {trained.steps:>5} {unseen:8.3g} {pooled:8.3g} {error / problem.noise:8.3g}   {parts}", flush=True)


if __name__ == "__main__":
    for name in sys.argv[1:] or CASES:
        trace_training(CASES[name][0], hold_eta=CASES[name][1])
