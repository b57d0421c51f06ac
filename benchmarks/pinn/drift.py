"""Course of the parameters during the training of the paper's network, from the start by regression to the end.

python -m benchmarks.pinn.drift         total and partial derivative, and eta fixed
python -m benchmarks.pinn.drift total   one of them
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
"""Numbers of steps (Adam, then L-BFGS) after which a row is printed."""
TRACKED_COORDINATES = ("F_b", "D_y", "eta", "c0_a", "c1_a")
CASES: Mapping[str, tuple[str, bool]] = {
    "total": ("total", False), "fixed": ("total", True), "partial": ("partial", False),
}  # fmt: skip
"""Kind of derivative, and whether eta is fixed at its start."""


def make_training(derivative: str, monitor: TrainingMonitor) -> PaperTraining:
    """Prepare a training with preset ``paper`` on six voltages."""
    settings = read_settings("paper")
    assert isinstance(settings, PaperSettings)
    settings = settings.model_copy(update={"seed": SEED, "derivative": derivative})
    problem = make_case_problem(LABORATORY, SEED)
    held = make_validation_masks(problem.pieces, settings.validation_share, SEED)
    return PaperTraining(problem, held, settings, monitor)


def trace_training(derivative: str, *, fix_eta: bool) -> None:
    """Train and print the course of errors and coordinates."""
    torch.set_num_threads(1)
    print(f"derivative: {derivative}{', eta fixed' if fix_eta else ''}; steps, validation error ratio,")
    print(f"pooled error, own force error over the noise, {', '.join(TRACKED_COORDINATES)} over the true ones")

    def on_progress(_message: str, error: float) -> None:
        if training.steps in REPORT_STEPS:
            _print_row(training, error)

    training = make_training(derivative, TrainingMonitor(progress=on_progress))
    if fix_eta:
        free = torch.tensor([name != "eta" for name in Parameters._fields])
        training.search_coordinates.register_hook(lambda gradient: gradient * free)  # type: ignore[no-untyped-call]
    _print_row(training, float("nan"))
    training.run()


def _print_row(training: PaperTraining, error: float) -> None:
    """Print one row; errors are those of the coordinates within the bounds of the search, as in a result."""
    problem, found = training.problem, to_coordinates(training.get_parameters())
    bounded = problem.space.to_coordinates(problem.space.to_search(found))
    parts = " ".join(f"{getattr(found, name) / getattr(LABORATORY, name):9.3g}" for name in TRACKED_COORDINATES)
    ratio = compute_validation_ratio(bounded, LABORATORY, SEED)
    pooled = compute_pooled_error(problem, bounded, LABORATORY)
    print(f"  {training.steps:>5} {ratio:8.3g} {pooled:8.3g} {error / problem.noise:8.3g}   {parts}", flush=True)


if __name__ == "__main__":
    for name in sys.argv[1:] or CASES:
        trace_training(CASES[name][0], fix_eta=CASES[name][1])
