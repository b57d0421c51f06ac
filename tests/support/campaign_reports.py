"""Campaigns in a catalogue with results of the test's choice."""

from collections.abc import Iterable, Sequence
from typing import Any

from bench.campaigns import (
    CampaignState,
    CampaignStore,
    ParameterResult,
    RunFact,
    RunResult,
    StoredCampaign,
    collect_methods,
    parse_campaign,
)
from bench.campaigns.engine import Message

STARTED = 1_790_000_000.0
"""UTC [s] at which the campaigns begin."""
RUN_TIME = 23.0
"""[s] Duration of each run."""
STEP_TIME = 360.0
"""[s] Time from the end of one step to that of the next."""


def run_step(specimen: str = "MR-1", method: str = "quick", drive: float | None = None) -> dict[str, Any]:
    """Return a step that runs a method."""
    return {"run": {"specimen": specimen, "method": method} | ({} if drive is None else {"drive": drive})}


def prompt_step(text: str = "Remount the damper") -> dict[str, Any]:
    """Return a step that asks for a person."""
    return {"prompt": {"text": text, "note": True}}


def make_result(value: float, half: float | None = 4.0, effects: Sequence[str] = (), **more: Any) -> RunResult:
    """Return a fit with the stiffness k0 [N/m] and half of its 95 % interval."""
    low, high = (None, None) if half is None else (value - half, value + half)
    parameters = {"k0": ParameterResult(value=value, low=low, high=high, unit="N/m")}
    given = {"rmse_n": 2.7, "noise_floor_n": 2.5, "verdict": "explained" if effects else "no_gap"}
    return RunResult(parameters=parameters, effects=tuple(effects), is_diagnosed=True, **(given | more))


def store_campaign(
    store: CampaignStore,
    steps: Sequence[dict[str, Any]],
    results: Iterable[RunResult],
    states: dict[int, tuple[str, str]] | None = None,
    status: str = "done",
    started: float = STARTED,
    **more: Any,
) -> StoredCampaign:
    """Store a campaign whose steps have ended, with a result for each run.

    Args:
        store: campaigns of a catalogue.
        steps: steps of the document.
        results: results of the runs in order; runs beyond them have none.
        states: state and reason of steps that are not done, by their index.
        status: status of the campaign.
        started: UTC [s] at which the campaign is created.
        more: further keys of the document.
    """
    document = parse_campaign({"name": "night", "seed": 7, "steps": list(steps)} | more, "the test")
    made = store.create(document, collect_methods(document), "agent", started, "M. <Curie> & Co")
    given = iter(results)

    def end(state: CampaignState) -> CampaignState:
        return end_steps(state, given, states or {}, status)

    return store.update(made.id, end)


def end_steps(
    state: CampaignState, results: Iterable[RunResult], states: dict[int, tuple[str, str]], status: str
) -> CampaignState:
    """Return the state after all steps."""
    items, facts, found = [], [], {}
    given = iter(results)
    for index, item in enumerate(state.items):
        name, reason = states.get(index, ("done", ""))
        ended = STARTED + STEP_TIME * (index + 1)
        note = "torque <b>12</b> N m" if hasattr(item.step, "prompt") and name == "done" else ""
        times = {} if name == "pending" else {"started": ended - 60, "ended": ended}
        items.append(item.model_copy(update={"state": name, "reason": reason, "note": note} | times))
        if name == "done" and hasattr(item.step, "run"):
            facts.append(make_fact(item, len(facts), ended))
            if (result := next(given, None)) is not None:
                found[facts[-1].run] = result
    text = "answered: Remount (torque)"
    answers = [Message(at=STARTED + 500, kind="edit", text=text, who="A. Meyer", item=one.id)
               for one in items if one.note]  # fmt: skip
    values = {"items": tuple(items), "facts": tuple(facts), "results": found, "status": status, "reason": "ended"}
    return state.model_copy(update=values | {"updated": STARTED + 9000, "outbox": tuple(answers)})


def make_fact(item: Any, number: int, ended: float) -> RunFact:
    """Return the complete run of a step."""
    run = item.step.run
    return RunFact(run=f"fact-{number}", item=item.id, specimen=run.specimen, method=run.method, drive=run.drive,
                   ended=ended, duration_s=RUN_TIME, outcome="clean", temperature_c=23.46)  # fmt: skip
