"""Conditions of a campaign: goal of a repetition, reasons to stop, and needs that a bench must meet."""

from collections.abc import Iterable
from math import inf, sqrt

from bench.campaigns.document import (
    Campaign,
    IntervalGoal,
    NextStrokeStep,
    RepeatStep,
    RestStep,
    Step,
    StopOnDrift,
    StopOnVerdict,
    WarmUpStep,
)
from bench.campaigns.engine.state import CampaignState, ParameterResult, RunFact, RunResult

RESULT_TIMEOUT = 3 * 3600.0
"""[s] Time limit for the results of a run."""
MIN_DRIFT_RUNS = 2
"""Smallest number of runs of one kind for which a drift can be computed."""


def needs_thermometer(steps: Iterable[Step]) -> bool:
    """Return whether a step has a condition on the temperature."""
    return any(
        (isinstance(step, RestStep) and step.rest.until_temperature_c is not None)
        or (isinstance(step, WarmUpStep) and step.warm_up.until_temperature_c is not None)
        for step in steps
    )


def needs_results(campaign: Campaign, steps: Iterable[Step]) -> bool:
    """Return whether a condition needs the identification or diagnosis of runs."""
    stops = any(isinstance(condition, StopOnDrift | StopOnVerdict) for condition in campaign.stop_on)
    return stops or any(isinstance(step, RepeatStep | NextStrokeStep) for step in steps)


def needs_diagnosis(campaign: Campaign, steps: Iterable[Step]) -> bool:
    """Return whether a condition needs the diagnosis of runs."""
    stops = any(isinstance(condition, StopOnVerdict) for condition in campaign.stop_on)
    repeats = (step.repeat.until for step in steps if isinstance(step, RepeatStep))
    strokes = any(isinstance(step, NextStrokeStep) for step in steps)
    return stops or strokes or any(not isinstance(goal, IntervalGoal) for goal in repeats)


def compute_interval(results: Iterable[RunResult], parameter: str) -> tuple[float, float] | None:
    """Return value and half of the 95 % interval of a parameter from all results together.

    The runs are independent, so each value has the weight of its inverse variance. None without any interval.
    """
    weights, total = 0.0, 0.0
    for result in results:
        found = result.parameters.get(parameter)
        half = inf if found is None else get_half_width(found)
        if found is not None and 0 < half < inf:
            weights += half**-2
            total += found.value * half**-2
    return (total / weights, 1 / sqrt(weights)) if weights else None


def get_half_width(parameter: ParameterResult) -> float:
    """Return half of the 95 % interval of a parameter; infinite without one."""
    if parameter.low is None or parameter.high is None:
        return inf
    return (parameter.high - parameter.low) / 2


def describe_interval(results: Iterable[RunResult], goal: IntervalGoal) -> tuple[bool, str]:
    """Return whether an interval is narrow enough, and the present one as text."""
    found = compute_interval(results, goal.parameter)
    if found is None or found[0] == 0:
        return False, f"{goal.parameter} has no 95 % interval yet"
    percent = 100 * found[1] / abs(found[0])
    text = f"{goal.parameter} is known to ±{percent:.2g} % (95 %), the goal is {goal.ci_percent:g} %"
    return percent <= goal.ci_percent, text


def find_stop_reason(state: CampaignState) -> str:
    """Return the reason why the results so far stop a campaign; empty if they do not."""
    for condition in state.campaign.stop_on:
        if isinstance(condition, StopOnDrift):
            reason = _find_drift(state, condition.drift.parameter, condition.drift.percent)
        elif isinstance(condition, StopOnVerdict):
            reason = _find_verdict(state, condition.verdict)
        else:
            reason = ""
        if reason:
            return reason
    return ""


def find_awaited_run(state: CampaignState, now: float) -> str:
    """Return the oldest run whose results a condition of ``stop_on`` still awaits; empty without one."""
    awaited = (
        fact.run
        for fact in _list_unchecked(state)
        if not state.results.get(fact.run, RunResult()).failure and now - fact.ended < RESULT_TIMEOUT
    )
    return next(awaited, "")


def describe_unchecked(state: CampaignState) -> str:
    """Return that ``stop_on`` could not be checked for some runs, as a text; empty if it could for all."""
    runs = [fact.run for fact in _list_unchecked(state)]
    return f"stop_on was not checked for runs without results: {', '.join(runs)}" if runs else ""


def _list_unchecked(state: CampaignState) -> list[RunFact]:
    """Return the complete runs without the results that ``stop_on`` needs, oldest first."""
    if not needs_results(state.campaign, ()):
        return []
    is_diagnosis_needed = needs_diagnosis(state.campaign, ())
    return [
        fact
        for fact in state.facts
        if (result := state.results.get(fact.run)) is None
        or result.failure
        or (is_diagnosis_needed and not result.is_diagnosed)
    ]


def _find_verdict(state: CampaignState, verdict: str) -> str:
    found = [run for run, result in state.results.items() if result.verdict == verdict]
    return f"the diagnosis of run {found[0]} is {verdict}" if found else ""


def _find_drift(state: CampaignState, parameter: str, percent: float) -> str:
    for facts in group_runs(state).values():
        values = [
            (fact, found.value)
            for fact in facts
            if (found := state.results.get(fact.run, RunResult()).parameters.get(parameter)) is not None
        ]
        if len(values) < MIN_DRIFT_RUNS or values[0][1] == 0:
            continue
        first = values[0][1]
        fact, value = max(values, key=lambda one: abs(one[1] - first))
        drift = 100 * abs(value - first) / abs(first)
        if drift > percent:
            return (
                f"{parameter} of {fact.specimen} with {fact.method} has drifted by {drift:.3g} % in run"
                f" {fact.run}, the limit is {percent:g} %"
            )
    return ""


def group_runs(state: CampaignState) -> dict[tuple[str, str, float | None], list[RunFact]]:
    """Return the complete runs by specimen, method and drive, oldest first."""
    groups: dict[tuple[str, str, float | None], list[RunFact]] = {}
    for fact in state.facts:
        groups.setdefault((fact.specimen, fact.method, fact.drive), []).append(fact)
    return groups
