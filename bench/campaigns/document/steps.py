"""Steps of a campaign: each is an object with one key, the kind of the step."""

from collections.abc import Iterable
from typing import Any, Literal, Self, TypeAlias

from pydantic import Field, PositiveFloat, PositiveInt, model_validator

from bench.setup_steps import MOVING_STEPS, SetupStep
from bench.validation import FrozenModel

DEFAULT_TIMEOUT = 3600.0
"""[s] Time limit of a condition without its own."""
SETUP_MOTION_TIME, SETUP_TIME = 20.0, 1.0
"""[s] Expected duration of a setup step with and without a motion of the rod."""


class RunSpec(FrozenModel):
    """One run of a method on a specimen."""

    specimen: str = Field(min_length=1, max_length=200, description="Serial number of the damper.")
    method: str | dict[str, Any] = Field(description="Name of a method, or a document mrbench.method/1.")
    method_version: PositiveInt | None = Field(
        default=None, description="[1] version of a named method; null for its newest at the start."
    )
    drive: float | None = Field(
        default=None, ge=0, description="[V or A] constant drive of all segments, instead of the method's own."
    )

    @model_validator(mode="after")
    def _check_version(self) -> Self:
        if self.method_version is not None and not isinstance(self.method, str):
            raise ValueError("method_version is that of a named method; leave it out with a document")
        return self


class RunStep(FrozenModel):
    """Run of a method."""

    run: RunSpec = Field(description="Run of a method on a specimen.")


class RestSpec(FrozenModel):
    """Rest for a time, or until the damper has cooled down."""

    seconds: PositiveFloat | None = Field(default=None, description="[s] duration of the rest.")
    until_temperature_c: float | None = Field(
        default=None, description="[°C] the rest ends when the thermometer shows this or less."
    )
    timeout_s: PositiveFloat = Field(default=DEFAULT_TIMEOUT, description="[s] time limit of the condition.")

    @model_validator(mode="after")
    def _check_condition(self) -> Self:
        if (self.seconds is None) == (self.until_temperature_c is None):
            raise ValueError("a rest needs either seconds or until_temperature_c")
        return self


class RestStep(FrozenModel):
    """Rest with the bench at standstill."""

    rest: RestSpec = Field(description="Rest with zero drive.")


class WarmUpSpec(FrozenModel):
    """Strokes that warm the damper: some cycles, or until a temperature."""

    cycles: PositiveInt | None = Field(default=None, description="[1] number of cycles.")
    until_temperature_c: float | None = Field(
        default=None, description="[°C] the warm-up ends when the thermometer shows this or more."
    )
    timeout_s: PositiveFloat = Field(default=DEFAULT_TIMEOUT, description="[s] time limit of the condition.")

    @model_validator(mode="after")
    def _check_condition(self) -> Self:
        if (self.cycles is None) == (self.until_temperature_c is None):
            raise ValueError("a warm-up needs either cycles or until_temperature_c")
        return self


class WarmUpStep(FrozenModel):
    """Warm-up with the first sine strokes of the next run."""

    warm_up: WarmUpSpec = Field(description="Warm-up with the first sine strokes of the next run.")


class IntervalGoal(FrozenModel):
    """Goal of a repetition: the 95 % interval of a parameter is narrow enough."""

    parameter: str = Field(min_length=1, description="Parameter of the fit, such as k0.")
    ci_percent: PositiveFloat = Field(
        description="[%] half of the 95 % interval of all repetitions together, relative to the value."
    )


class DiagnosisGoal(FrozenModel):
    """Goal of a repetition: the diagnosis proposes no further stroke."""

    diagnosis: Literal["settled"] = Field(description="The diagnosis of the latest run proposes no stroke.")


class RepeatSpec(FrozenModel):
    """Repetition of a run until a goal is reached."""

    step: RunStep = Field(description="Run to repeat.")
    until: IntervalGoal | DiagnosisGoal = Field(description="Goal at which the repetition ends.")
    at_most: PositiveInt = Field(le=100, description="[1] largest number of runs.")


class RepeatStep(FrozenModel):
    """Repetition of a run."""

    repeat: RepeatSpec = Field(description="Repetition of a run until a goal is reached.")


class CellRepeatSpec(FrozenModel):
    """Repetition after the run of a cell of a matrix, by default of that run itself."""

    step: RunStep | None = Field(
        default=None, description="Run to repeat; null for the run of the cell, which is then the first of these."
    )
    until: IntervalGoal | DiagnosisGoal = Field(description="Goal at which the repetition ends.")
    at_most: PositiveInt = Field(le=100, description="[1] largest number of runs.")


class CellRepeatStep(FrozenModel):
    """Repetition after the run of a cell."""

    repeat: CellRepeatSpec = Field(description="Repetition of a run, by default that of the cell, until a goal.")

    def make_step(self, run: RunStep) -> RepeatStep:
        """Return the step of a cell with a run."""
        spec = self.repeat
        return RepeatStep(repeat=RepeatSpec(step=spec.step or run, until=spec.until, at_most=spec.at_most))


class NextStrokeSpec(FrozenModel):
    """Runs with the strokes that the diagnosis proposes."""

    at_most: PositiveInt = Field(le=20, description="[1] largest number of proposed strokes.")


class NextStrokeStep(FrozenModel):
    """Repetition of the preceding run with the proposed strokes, until its diagnosis is settled."""

    next_stroke: NextStrokeSpec = Field(
        description="Repeat the preceding run with the proposed strokes added, until its diagnosis is settled."
    )


class PromptSpec(FrozenModel):
    """Question to the operator."""

    text: str = Field(min_length=1, max_length=1000, description="Request to the operator.")
    photo: bool = Field(default=False, description="Whether the answer needs a photo.")
    note: bool = Field(default=False, description="Whether the answer needs a note.")


class PromptStep(FrozenModel):
    """Wait for a person, such as for the next specimen."""

    prompt: PromptSpec = Field(description="Wait until a person answers.")


class SetupSpec(FrozenModel):
    """Setup step of the bench."""

    step: SetupStep = Field(
        description="home, move, tare, clear-tare, centre, mount or unmount, as before a single run."
    )
    position_m: float | None = Field(
        default=None,
        allow_inf_nan=False,
        description="[m] target of move, from the specimen's middle, or from home before one is centred.",
    )

    @model_validator(mode="after")
    def _check_position(self) -> Self:
        if (self.step == "move") != (self.position_m is not None):
            raise ValueError("move needs position_m, and no other setup step takes it")
        return self


class BenchSetupStep(FrozenModel):
    """Setup step of the bench between two runs, such as a tare or a move."""

    setup: SetupSpec = Field(description="Setup step of the bench; on the simulated plant it only takes its time.")


Step: TypeAlias = RunStep | RestStep | WarmUpStep | RepeatStep | NextStrokeStep | PromptStep | BenchSetupStep
STEP_KINDS = ("run", "rest", "warm_up", "repeat", "next_stroke", "prompt", "setup")
"""Keys of the kinds of steps."""


def get_step_kind(step: Any) -> str:
    """Return the kind of a step, or of the document of one; empty if it is neither."""
    names = list(step) if isinstance(step, dict) else list(getattr(type(step), "model_fields", ()))
    return names[0] if len(names) == 1 and names[0] in STEP_KINDS else ""


def describe_setup(spec: SetupSpec) -> str:
    """Describe a setup step for a person, with the unit of its position."""
    target = "" if spec.position_m is None else f" to {1e3 * spec.position_m:g} mm"
    return f"setup step {spec.step}{target}"


def estimate_setup_duration(spec: SetupSpec) -> float:
    """Return the expected duration of a setup step [s]; that of a motion depends on the bench."""
    return SETUP_MOTION_TIME if spec.step in MOVING_STEPS else SETUP_TIME


def find_unfounded_step(steps: Iterable[Step]) -> int | None:
    """Return the number, from 1, of the first next_stroke that no run precedes; None without one."""
    has_run = False
    for number, step in enumerate(steps, 1):
        if isinstance(step, NextStrokeStep) and not has_run:
            return number
        has_run = has_run or find_run(step) is not None
    return None


def find_run(step: Step) -> RunSpec | None:
    """Return the run of a step that runs a method of its own, or None."""
    if isinstance(step, RepeatStep):
        return step.repeat.step.run
    return step.run if isinstance(step, RunStep) else None
