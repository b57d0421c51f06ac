"""Dry run of the methods of a campaign: limits of method and bench, and what their strokes can identify."""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

from pydantic import Field

from bench.campaigns.document.steps import NextStrokeStep, RepeatStep, RunSpec, Step, find_run
from bench.campaigns.document.strokes import Methods, get_method_name, make_run_method
from bench.errors import RunError
from bench.methods import Envelope, Method, Programme, compile_method, compute_envelope, list_checkpoints
from bench.validation import FrozenModel

Assessment: TypeAlias = Callable[[Programme], dict[str, Any]]
"""Function that returns the foresight document of a programme, such as `bench.runs.assess_design`."""


class BenchComparison(NamedTuple):
    """Method beside the bench that shall run it, in sentences for a person."""

    obstacles: tuple[str, ...]
    """Reasons why the bench would refuse or stop a run of it, whatever damper is tested."""
    remarks: tuple[str, ...]
    """Limits that a typical damper would exceed; the tested one may be weaker."""


CompareWithBench: TypeAlias = Callable[[Method, Envelope], BenchComparison]
"""Function that compares a method and its peaks with a bench."""


class PlannedMethod(FrozenModel):
    """One method with one drive, as often as the campaign runs it."""

    method: str = Field(description="Name of the method.")
    drive: float | None = Field(description="Constant drive in the unit of the drive; null for the method's own.")
    drive_unit: str = Field(description="Unit of the drive: V or A.")
    runs: int = Field(description="[1] number of runs.")
    duration_s: float = Field(description="[s] duration of one run.")
    force_n: float = Field(description="[N] largest expected force.")
    verdict: str = Field(description="Whether the expected force stays below the limit of the method.")
    obstacles: tuple[str, ...] = Field(
        default=(), description="Reasons why the bench would refuse or stop its runs; empty without a known bench."
    )
    remarks: tuple[str, ...] = Field(
        default=(), description="Limits of the bench that a typical damper would exceed; they prevent no start."
    )
    checkpoints: int = Field(description="[1] number of checkpoints.")
    identifiability: tuple[str, ...] = Field(description="Findings on what its strokes can identify.")


def plan_methods(
    steps: tuple[Step, ...], methods: Methods, assess: Assessment | None, compare: CompareWithBench | None
) -> tuple[PlannedMethod, ...]:
    """Return the methods of steps, each with each of its drives.

    Args:
        steps: expanded steps.
        methods: their methods by name.
        assess: assesses what strokes identify; None leaves that out.
        compare: compares a method with a bench; None if the bench is not known.

    Raises:
        CampaignError: a drive exceeds the limit of its method.
        MethodError: a method cannot be compiled within its limits.
    """
    counts: dict[tuple[str, float | None], int] = {}
    for step in steps:
        if (run := find_run(step)) is not None:
            key = (get_method_name(run), run.drive)
            counts[key] = counts.get(key, 0) + count_runs(step)
    return tuple(_plan_method(methods, key, count, assess, compare) for key, count in counts.items())


def _plan_method(
    methods: Methods,
    key: tuple[str, float | None],
    count: int,
    assess: Assessment | None,
    compare: CompareWithBench | None,
) -> PlannedMethod:
    name, drive = key
    method = make_run_method(methods, RunSpec(specimen="any", method=name, drive=drive))
    programme = compile_method(method)
    envelope = compute_envelope(programme)
    compared = BenchComparison((), ()) if compare is None else compare(method, envelope)
    return PlannedMethod(
        method=name,
        drive=drive,
        drive_unit=method.drive_unit,
        runs=count,
        duration_s=programme.duration,
        force_n=envelope.total.force_n,
        verdict=envelope.verdict,
        obstacles=compared.obstacles,
        remarks=compared.remarks,
        checkpoints=len(list_checkpoints(programme)),
        identifiability=_assess(programme, assess),
    )


def _assess(programme: Programme, assess: Assessment | None) -> tuple[str, ...]:
    if assess is None:
        return ()
    try:
        return tuple(assess(programme).get("messages", ()))
    except RunError as error:  # a bench without the identification package can still plan
        return (str(error),)


def count_runs(step: Step) -> int:
    """Return the largest number of runs of a step."""
    if isinstance(step, RepeatStep):
        return step.repeat.at_most
    return step.next_stroke.at_most if isinstance(step, NextStrokeStep) else 1
