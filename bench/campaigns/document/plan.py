"""Dry run of a whole campaign: time, heat, disk, limits, and what each method can identify."""

from collections.abc import Iterable
from typing import Literal

from pydantic import Field

from bench.campaigns.document.document import Campaign
from bench.campaigns.document.expansion import expand_campaign
from bench.campaigns.document.planned_methods import (
    Assessment,
    CompareWithBench,
    PlannedMethod,
    count_runs,
    plan_methods,
)
from bench.campaigns.document.steps import (
    BenchSetupStep,
    NextStrokeStep,
    RepeatStep,
    RestStep,
    RunSpec,
    Step,
    WarmUpStep,
    describe_setup,
    estimate_setup_duration,
    find_run,
    get_step_kind,
)
from bench.campaigns.document.strokes import Methods, get_method_name, make_run_method, make_warm_up
from bench.disk import estimate_log_size
from bench.methods import Method, compile_method, compute_heat
from bench.validation import FrozenModel

CHANNELS = 6
"""Number of channels at the full rate in the estimate of a log's size."""


class PlannedStep(FrozenModel):
    """One step with its expected time, heat and disk space."""

    number: int = Field(description="[1] position, from 1.")
    kind: str = Field(description="run, rest, warm_up, repeat, next_stroke, prompt or setup.")
    label: str = Field(description="The step for a person.")
    duration_s: float = Field(description="[s] expected duration; 0 if it is not known.")
    longest_s: float | None = Field(description="[s] longest duration; null for a step that waits for a person.")
    heat_j: float = Field(description="[J] heat that the damper dissipates at most.")
    log_bytes: int = Field(description="[byte] largest expected size of its logs.")


class CampaignPlan(FrozenModel):
    """Dry run of a campaign."""

    schema_name: Literal["mrbench.campaign-plan/1"] = Field(
        default="mrbench.campaign-plan/1", alias="schema", description="Name and version of this document type."
    )
    campaign: str = Field(description="Name of the campaign.")
    duration_s: float = Field(description="[s] expected duration, without waiting for persons.")
    longest_s: float = Field(description="[s] longest duration, with every time limit and repetition.")
    stroking_s: float = Field(description="[s] expected time in motion.")
    heat_j: float = Field(description="[J] heat that the dampers dissipate at most.")
    log_bytes: int = Field(description="[byte] largest expected size of all logs.")
    free_bytes: int | None = Field(description="[byte] free space for logs; null if it is not known.")
    methods: tuple[PlannedMethod, ...] = Field(description="Methods with their drives.")
    steps: tuple[PlannedStep, ...] = Field(description="Steps in order.")
    problems: tuple[str, ...] = Field(description="Reasons against a start; empty without any.")
    bench_unknown: str = Field(
        default="", description="Reason why drive and limits of the bench are not known; empty if they are."
    )


def plan_campaign(
    campaign: Campaign,
    methods: Methods,
    assess: Assessment | None = None,
    free_bytes: int | None = None,
    compare: CompareWithBench | None = None,
    bench_unknown: str = "",
) -> CampaignPlan:
    """Return the dry run of a campaign.

    Args:
        campaign: the campaign.
        methods: its methods by name.
        assess: assesses what strokes identify; None leaves that out.
        free_bytes: free space for logs [byte]; None if it is not known.
        compare: compares a method with a bench; None if the bench is not known.
        bench_unknown: reason why it is not known.

    Raises:
        CampaignError: a method does not fit its use.
        MethodError: a method cannot be compiled within its limits.
    """
    steps = expand_campaign(campaign)
    planned = _plan_steps(steps, methods)
    used = plan_methods(steps, methods, assess, compare)
    log_bytes = sum(step.log_bytes for step in planned)
    return CampaignPlan(
        campaign=campaign.name,
        duration_s=sum(step.duration_s for step in planned),
        longest_s=sum(step.longest_s or 0.0 for step in planned),
        stroking_s=sum(step.duration_s for step in planned if step.kind not in ("rest", "prompt", "setup")),
        heat_j=sum(step.heat_j for step in planned),
        log_bytes=log_bytes,
        free_bytes=free_bytes,
        methods=used,
        steps=planned,
        problems=tuple(_find_problems(used, log_bytes, free_bytes)),
        bench_unknown=bench_unknown,
    )


def find_problems(
    steps: tuple[Step, ...],
    methods: Methods,
    free_bytes: int | None = None,
    compare: CompareWithBench | None = None,
) -> tuple[str, ...]:
    """Return the reasons against the start of steps: limits of methods and bench, and the disk.

    Args:
        steps: expanded steps in order.
        methods: their methods by name.
        free_bytes: free space for logs [byte]; None if it is not known.
        compare: compares a method with a bench; None if the bench is not known.

    Raises:
        CampaignError: a method does not fit its use.
        MethodError: a method cannot be compiled within its limits.
    """
    log_bytes = sum(step.log_bytes for step in _plan_steps(steps, methods))
    return tuple(_find_problems(plan_methods(steps, methods, None, compare), log_bytes, free_bytes))


def describe_step(step: Step, methods: Methods) -> str:
    """Describe a step for a person, with units; ``methods`` has the method of each run by name."""
    if isinstance(step, NextStrokeStep):
        return f"at most {step.next_stroke.at_most} proposed strokes"
    run = find_run(step)
    if run is not None:
        name = get_method_name(run)
        drive = "" if run.drive is None else f" at {run.drive:g} {methods[name].drive_unit}"
        version = "" if run.method_version is None else f" version {run.method_version}"
        text = f"{name}{version}{drive} on {run.specimen}"
        return f"{text}, at most {step.repeat.at_most} times" if isinstance(step, RepeatStep) else text
    if isinstance(step, RestStep):
        seconds, target = step.rest.seconds, step.rest.until_temperature_c
        return f"rest {seconds:g} s" if seconds is not None else f"rest until {target:g} °C"
    if isinstance(step, WarmUpStep):
        cycles, target = step.warm_up.cycles, step.warm_up.until_temperature_c
        return f"warm-up, {cycles} cycles" if cycles is not None else f"warm-up until {target:g} °C"
    if isinstance(step, BenchSetupStep):
        return describe_setup(step.setup)
    return step.prompt.text if get_step_kind(step) == "prompt" else ""  # type: ignore[union-attr]


def estimate_durations(steps: Iterable[Step], methods: Methods) -> list[float]:
    """Return the expected duration [s] of each step; 0 if it is not known."""
    return [step.duration_s for step in _plan_steps(tuple(steps), methods)]


def find_next_run(steps: Iterable[Step]) -> RunSpec | None:
    """Return the first run among steps, or None."""
    return next((run for step in steps if (run := find_run(step)) is not None), None)


class _StepPlanner:
    """Expected values of steps; each method is compiled once."""

    def __init__(self, methods: Methods) -> None:
        self._methods = methods
        self._known: dict[str, tuple[float, float, int]] = {}

    def measure(self, method: Method) -> tuple[float, float, int]:
        """Return duration [s], heat [J] and size of the log [byte] of a run."""
        key = method.to_json()
        if key not in self._known:
            programme = compile_method(method)
            size = estimate_log_size(programme.duration, (programme.rate,) * CHANNELS)
            self._known[key] = programme.duration, compute_heat(programme), size
        return self._known[key]

    def plan(self, step: Step, following: tuple[Step, ...], preceding: RunSpec | None) -> tuple[float, ...]:
        """Return expected and longest duration [s], heat [J] and size of logs [byte]."""
        if isinstance(step, RestStep):
            seconds = step.rest.seconds
            return (seconds or 0.0, seconds or step.rest.timeout_s, 0.0, 0)
        if isinstance(step, BenchSetupStep):
            seconds = estimate_setup_duration(step.setup)
            return (seconds, seconds, 0.0, 0)
        if isinstance(step, WarmUpStep):
            return self._plan_warm_up(step, find_next_run(following) or preceding)
        run = find_run(step) or (preceding if isinstance(step, NextStrokeStep) else None)
        if run is None:
            return (0.0, 0.0, 0.0, 0)
        duration, heat, size = self.measure(make_run_method(self._methods, run))
        times = count_runs(step)
        return (duration, duration * times, heat * times, size * times)

    def _plan_warm_up(self, step: WarmUpStep, run: RunSpec | None) -> tuple[float, ...]:
        if run is None:
            return (0.0, step.warm_up.timeout_s, 0.0, 0)
        method = make_warm_up(make_run_method(self._methods, run), step.warm_up.cycles)
        duration, heat, size = self.measure(method)
        return (duration, duration if step.warm_up.cycles else step.warm_up.timeout_s, heat, size)


def _plan_steps(steps: tuple[Step, ...], methods: Methods) -> tuple[PlannedStep, ...]:
    planner, preceding, planned = _StepPlanner(methods), None, []
    for index, step in enumerate(steps):
        expected, longest, heat, size = planner.plan(step, steps[index + 1 :], preceding)
        kind = get_step_kind(step)
        planned.append(
            PlannedStep(
                number=index + 1,
                kind=kind,
                label=describe_step(step, methods),
                duration_s=expected,
                longest_s=None if kind == "prompt" else longest,
                heat_j=heat,
                log_bytes=int(size),
            )
        )
        preceding = find_run(step) or preceding
    return tuple(planned)


def _find_problems(methods: Iterable[PlannedMethod], log_bytes: int, free_bytes: int | None) -> Iterable[str]:
    for method in methods:
        if method.verdict != "within limits":
            yield f"method {method.method}: {method.verdict} (expected {method.force_n:.0f} N)"
        drive = "" if method.drive is None else f" at {method.drive:g} {method.drive_unit}"
        yield from (f"method {method.method}{drive}: {obstacle}" for obstacle in method.obstacles)
    if free_bytes is not None and log_bytes > free_bytes:
        yield (
            f"the logs need up to {log_bytes / 1e9:.3f} GB, {free_bytes / 1e9:.3f} GB are free; "
            "free space, or divide the campaign"
        )


def format_plan(plan: CampaignPlan) -> list[str]:
    """Format the dry run as lines of text."""
    rows = [
        f"{step.number:4d}  {step.kind:11s} {step.duration_s:8.1f} s {step.heat_j:9.0f} J  {step.label}"
        for step in plan.steps
    ]
    methods = [line for method in plan.methods for line in _format_method(method)]
    free = "" if plan.free_bytes is None else f" of {plan.free_bytes / 1e9:.3f} GB free"
    total = (
        f"{plan.campaign}: {len(plan.steps)} steps, {plan.duration_s / 3600:.2f} h expected, at most"
        f" {plan.longest_s / 3600:.2f} h and the time of persons; {plan.stroking_s / 3600:.2f} h in motion,"
        f" at most {plan.heat_j / 1000:.1f} kJ, logs up to {plan.log_bytes / 1e9:.3f} GB{free}"
    )
    return [*rows, *methods, total, *(f"problem: {problem}" for problem in plan.problems)]


def _format_method(method: PlannedMethod) -> list[str]:
    drive = "" if method.drive is None else f" at {method.drive:g} {method.drive_unit}"
    head = (
        f"method {method.method}{drive}: {method.runs} runs of {method.duration_s:.1f} s, expected"
        f" {method.force_n:.0f} N, {method.verdict}, {method.checkpoints} checkpoints"
    )
    return [head, *(f"    {line}" for line in method.identifiability)]
