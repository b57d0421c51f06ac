"""Simulated plant as the bench of a campaign: faster than real time, on a simulated clock.

Runs and rests are played by the rig as a process of its own. The damper keeps its temperature from one to the
next, as the thermometer shows it.
"""

import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime

import numpy as np
import numpy.typing as npt

from bench.campaigns.benches.agent_setup import find_setup
from bench.campaigns.benches.local_jobs import evaluate_run
from bench.campaigns.benches.recovery import make_end_report, recover_execution
from bench.campaigns.benches.results import read_result
from bench.campaigns.document import Campaign, CampaignError, RestStep, Step, estimate_setup_duration
from bench.campaigns.engine import (
    ExecutionReport,
    Observation,
    RunResult,
    find_spec,
    make_method,
    needs_diagnosis,
    needs_results,
    needs_thermometer,
)
from bench.campaigns.store import StoredCampaign
from bench.catalogue import Catalogue, catalogue_log
from bench.log import Identity, read_log
from bench.methods import make_remaining_method
from bench.runs import RIG_COMMAND, play_scenario, run_from_plant

HOLD_RATE = 50.0
"""[Hz] Sampling rate of a rest on the plant."""
HOLD_TIME = 120.0
"""[s] Longest part of a rest that is played at once."""
SETUP_RESULT = "the simulated plant only lets the time of a setup step pass"
"""Result of a setup step, for a person."""
Array = npt.NDArray[np.float64]
_POLL_PERIOD = 0.3
"""[s] Real time between two looks for an answer or a command."""


class PlantBench:
    """Simulated plant of one scenario."""

    def __init__(
        self,
        catalogue: Catalogue,
        scenario: str,
        now: float,
        *,
        identify: bool = False,
        rig: Sequence[str] = RIG_COMMAND,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Use a scenario.

        Args:
            catalogue: catalogue of the data folder.
            scenario: name or file of the scenario.
            now: UTC at which the simulated clock starts [s].
            identify: identify and diagnose every run, also if no condition needs it.
            rig: command that starts the rig.
            sleep: waits for real time [s].
        """
        self._catalogue, self._scenario, self._rig = catalogue, scenario, tuple(rig)
        self._now, self._identify, self._sleep = now, identify, sleep
        self._temperature: float | None = None
        self._report: ExecutionReport | None = None

    def check_needs(self, campaign: Campaign, steps: Sequence[Step]) -> None:
        """Check that the rig has a thermometer if one is needed.

        Raises:
            CampaignError: it has none.
        """
        if needs_thermometer(steps):
            self._hold(1.0)
            if self._temperature is None:
                raise CampaignError(
                    f"the campaign has a condition on the temperature, but the rig {self._scenario} has no"
                    " thermometer; use rests of a fixed time"
                )

    def now(self) -> float:
        """Return the UTC of the simulated clock [s]."""
        return self._now

    def recover(self, campaign: StoredCampaign) -> ExecutionReport | None:
        """Return what became of the run that a killed process was playing."""
        self._temperature = campaign.state.temperature_c
        active = campaign.state.active
        if active is None or active.execution is None:
            return None
        self._report = None
        return recover_execution(self._catalogue, active.execution.log)

    def observe(self, campaign: StoredCampaign) -> Observation:
        """Return the end of the run, the temperature and new results."""
        report, self._report = self._report, None
        return Observation(report=report, temperature_c=self._temperature, results=self._evaluate(campaign))

    def start(self, campaign: StoredCampaign) -> None:
        """Play the active run to its end, and let its time pass; a setup step only takes its time.

        Raises:
            BenchError: the method or the rig fails.
        """
        state = campaign.state
        if (setup := find_setup(campaign)) is not None:
            self._stand(estimate_setup_duration(setup), campaign)
            self._report = ExecutionReport(kind="ended", reason=SETUP_RESULT)
        if state.active is None or state.active.execution is None:
            return
        item, execution = state.get_item(state.active.item), state.active.execution
        method = make_method(state, item, campaign.methods)
        if execution.resume_after:
            method = make_remaining_method(method, execution.resume_after)
        path = self._catalogue.folder / execution.log
        identity = Identity(
            find_spec(state, item).specimen, state.operator, datetime.fromtimestamp(self._now, UTC)
        )
        seed = (state.campaign.seed * 10_007 + int(item.id[1:]) * 101 + item.executions) % 2**31
        run = run_from_plant(
            method,
            self._scenario,
            path,
            identity,
            seed=seed,
            rig=self._make_rig_command(),
            continues=execution.continues,
            resumed_after=execution.resume_after,
        )
        self._now += run.duration
        if needs_thermometer(one.step for one in state.items):
            self._temperature = _find_last(np.asarray(read_log(path).samples["temperature"], np.float64))
        self._report = make_end_report(self._catalogue, catalogue_log(self._catalogue, path), path)

    def request_pause(self, campaign: StoredCampaign) -> None:
        """Do nothing: a run on the plant has ended before a person can ask."""

    def keep_lease(self, campaign: StoredCampaign) -> None:
        """Do nothing: nobody else can use the simulated plant."""

    def wait(self, campaign: StoredCampaign) -> None:
        """Let a rest pass on the simulated clock; else wait in real time for an answer or a command."""
        state = campaign.state
        if state.active is not None and state.active.phase == "resting" and not state.is_held:
            step = state.get_item(state.active.item).step
            target = step.rest.until_temperature_c if isinstance(step, RestStep) else None
            self._stand(max(0.0, (state.active.deadline or self._now) - self._now), campaign, target)
        elif state.is_held or state.needs_person or state.awaited_run:
            self._sleep(_POLL_PERIOD)
            self._now += _POLL_PERIOD

    def _stand(self, remaining: float, campaign: StoredCampaign, target: float | None = None) -> None:
        """Let a time at standstill [s] pass, but no further than the temperature [°C] that a rest waits for."""
        if not needs_thermometer(item.step for item in campaign.state.items):
            self._now += remaining
            return
        while remaining > 0:
            part = min(remaining, HOLD_TIME)
            shown = self._hold(part)
            if target is not None and (cold := np.flatnonzero(shown <= target)).size:
                self._now += part * (cold[0] + 1) / len(shown)
                self._temperature = float(shown[cold[0]])
                return
            self._now += part
            remaining -= part

    def _hold(self, duration: float) -> Array:
        """Play a standstill [s]; return the readings of the thermometer [°C], and keep the last."""
        count = max(10, round(duration * HOLD_RATE))
        still = {"displacement": np.zeros(count), "drive": np.zeros(count)}
        commands = {"time": np.arange(count) / HOLD_RATE, **still}
        played = play_scenario(self._scenario, commands, rig=self._make_rig_command())
        shown = played.channels.get("temperature", np.empty(0))
        if shown.size:
            self._temperature = _find_last(shown)
        return shown

    def _make_rig_command(self) -> tuple[str, ...]:
        warm = () if self._temperature is None else ("--temperature", f"{self._temperature:.4f}")
        return (*self._rig, *warm)

    def _evaluate(self, campaign: StoredCampaign) -> dict[str, RunResult]:
        """Identify the complete runs that have no result yet, if a condition needs it."""
        state = campaign.state
        steps = [item.step for item in state.items]
        if not self._identify and not needs_results(state.campaign, steps):
            return {}
        diagnose = self._identify or needs_diagnosis(state.campaign, steps)
        results = {}
        for fact in state.facts:
            if fact.run not in state.results and (row := self._catalogue.get_run(fact.run)) is not None:
                evaluate_run(self._catalogue, row, diagnose=diagnose)
                if (result := read_result(self._catalogue, fact.run)) is not None:
                    results[fact.run] = result
        return results


def _find_last(values: Array) -> float | None:
    valid = values[np.isfinite(values)]
    return float(valid[-1]) if valid.size else None
