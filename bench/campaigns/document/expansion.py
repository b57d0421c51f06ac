"""Expansion of a campaign into its steps in order; a random order is drawn by the seed of the document."""

from itertools import product
from random import Random

from bench.campaigns.document.document import Campaign, Matrix, MatrixSteps
from bench.campaigns.document.errors import CampaignDocumentError
from bench.campaigns.document.steps import CellRepeatStep, RunSpec, RunStep, Step, find_unfounded_step

MAX_STEPS = 10_000
"""Largest number of steps of a campaign."""


def expand_campaign(campaign: Campaign) -> tuple[Step, ...]:
    """Return the steps of a campaign in order; equal documents give equal orders.

    The runs of one specimen stay together, because every change of the specimen is work by hand.

    Raises:
        CampaignDocumentError: there are too many steps, or a matrix puts a next_stroke before the first run.
    """
    steps = campaign.steps
    expanded = _expand_matrix(steps.matrix, campaign.seed) if isinstance(steps, MatrixSteps) else tuple(steps)
    if len(expanded) > MAX_STEPS:
        raise CampaignDocumentError(
            f"campaign {campaign.name} has {len(expanded)} steps, at most {MAX_STEPS} are possible; divide it"
        )
    # A list of steps was checked as a part of its document.
    if isinstance(steps, MatrixSteps) and (number := find_unfounded_step(expanded)) is not None:
        raise CampaignDocumentError(
            f"step {number} of the matrix of campaign {campaign.name} is a next_stroke, but no run precedes it; "
            "put it into after_run"
        )
    return expanded


def _expand_matrix(matrix: Matrix, seed: int) -> tuple[Step, ...]:
    random = Random(seed)
    steps: list[Step] = []
    for specimen in matrix.specimens:
        steps += matrix.before_specimen
        for run in _order_runs(matrix, specimen, random):
            steps += [*matrix.before_run, *_expand_cell(matrix, RunStep(run=run))]
    return tuple(steps)


def _expand_cell(matrix: Matrix, run: RunStep) -> list[Step]:
    """Return the run of a cell with the steps after it; a repetition of the run takes its place."""
    steps = [step.make_step(run) if isinstance(step, CellRepeatStep) else step for step in matrix.after_run]
    first = matrix.after_run[0] if matrix.after_run else None
    is_repeated = isinstance(first, CellRepeatStep) and first.repeat.step is None
    return steps if is_repeated else [run, *steps]


def _order_runs(matrix: Matrix, specimen: str, random: Random) -> list[RunSpec]:
    cells = product(range(matrix.repeats), matrix.methods, matrix.drives)
    runs = [RunSpec(specimen=specimen, method=method, drive=drive) for _, method, drive in cells]
    if matrix.order == "random":
        random.shuffle(runs)
    return runs
