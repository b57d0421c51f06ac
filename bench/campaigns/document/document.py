"""Campaign document `mrbench.campaign/1`: runs, conditions between them, and what to do after a failure."""

import json
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import (
    Discriminator,
    Field,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    Tag,
    ValidationError,
    model_validator,
)

from bench.campaigns.document.errors import CampaignDocumentError
from bench.campaigns.document.steps import (
    STEP_KINDS,
    BenchSetupStep,
    CellRepeatStep,
    DiagnosisGoal,
    IntervalGoal,
    NextStrokeStep,
    PromptStep,
    RepeatStep,
    RestStep,
    RunStep,
    WarmUpStep,
    find_unfounded_step,
    get_step_kind,
)
from bench.validation import FrozenModel, format_position, get_first_error

OnFailure: TypeAlias = Literal["retry", "skip", "stop", "ask"]
_BY_KIND = Discriminator(
    get_step_kind,
    custom_error_type="step_kind",
    custom_error_message=f"a step has exactly one of the keys {', '.join(STEP_KINDS)}",
)
_OtherStep: TypeAlias = (
    Annotated[RunStep, Tag("run")]
    | Annotated[RestStep, Tag("rest")]
    | Annotated[WarmUpStep, Tag("warm_up")]
    | Annotated[NextStrokeStep, Tag("next_stroke")]
    | Annotated[PromptStep, Tag("prompt")]
    | Annotated[BenchSetupStep, Tag("setup")]
)
"""A step that is no repetition."""
AnyStep: TypeAlias = Annotated[_OtherStep | Annotated[RepeatStep, Tag("repeat")], _BY_KIND]
"""A step, recognised by its only key."""
CellStep: TypeAlias = Annotated[_OtherStep | Annotated[CellRepeatStep, Tag("repeat")], _BY_KIND]
"""A step after the run of a cell, which can repeat that run."""


class Matrix(FrozenModel):
    """Every specimen with every method and drive, some times each."""

    specimens: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = Field(
        min_length=1, description="Serial numbers of the dampers."
    )
    methods: tuple[str | dict[str, Any], ...] = Field(
        min_length=1, description="Names of methods, or documents mrbench.method/1."
    )
    drives: tuple[Annotated[float, Field(ge=0)] | None, ...] = Field(
        default=(None,), min_length=1, description="[V or A] constant drives; null for the method's own."
    )
    repeats: PositiveInt = Field(default=1, le=1000, description="[1] number of runs of each combination.")
    order: Literal["listed", "random"] = Field(
        default="listed", description="Order of the runs of each specimen; random is drawn by the seed."
    )
    before_specimen: tuple[AnyStep, ...] = Field(
        default=(), description="Steps before the first run of each specimen, such as a prompt to mount it."
    )
    before_run: tuple[AnyStep, ...] = Field(default=(), description="Steps before each run, such as a rest.")
    after_run: tuple[CellStep, ...] = Field(
        default=(),
        description="Steps after each run, such as next_stroke, or first a repeat without step of the run itself.",
    )

    @model_validator(mode="after")
    def _check_repeats(self) -> Self:
        if any(isinstance(step, CellRepeatStep) and step.repeat.step is None for step in self.after_run[1:]):
            raise ValueError(
                "a repeat without step must be the first of after_run, because the run of the cell begins it"
            )
        return self


class MatrixSteps(FrozenModel):
    """Steps that are made from a matrix."""

    matrix: Matrix = Field(description="Matrix of runs.")


StepsOrMatrix: TypeAlias = Annotated[
    Annotated[tuple[AnyStep, ...], Tag("list")] | Annotated[MatrixSteps, Tag("of_matrix")],
    Discriminator(lambda steps: "list" if isinstance(steps, list | tuple) else "of_matrix"),
]


class Drift(FrozenModel):
    """Change of a parameter over the runs of one specimen with one method and drive."""

    parameter: str = Field(min_length=1, description="Parameter of the fit, such as k0.")
    percent: PositiveFloat = Field(description="[%] largest change from the first of these runs.")


class StopOnDrift(FrozenModel):
    """Stop after a drift."""

    drift: Drift = Field(description="Stop if a parameter has changed too much.")


class StopOnVerdict(FrozenModel):
    """Stop after a verdict."""

    verdict: Literal["no_gap", "explained", "partly_explained", "unexplained"] = Field(
        description="Stop if the diagnosis of a run has this verdict."
    )


class StopOnTrip(FrozenModel):
    """Stop after a trip."""

    trip: Literal[True] = Field(description="Stop if an interlock has ended a run.")


class Webhook(FrozenModel):
    """Notification by HTTP."""

    webhook: str = Field(pattern=r"^https?://\S+$", description="Address that receives a POST with JSON.")


class Mail(FrozenModel):
    """Notification by e-mail."""

    mailto: str = Field(pattern=r"^[^@\s]+@[^@\s]+$", description="E-mail address.")


StopCondition: TypeAlias = StopOnDrift | StopOnVerdict | StopOnTrip
Recipient: TypeAlias = Webhook | Mail


class Campaign(FrozenModel):
    """Ordered list of runs with rests and conditions between them."""

    schema_name: Literal["mrbench.campaign/1"] = Field(
        default="mrbench.campaign/1", alias="schema", description="Name and version of this document type."
    )
    name: str = Field(pattern=r"^[A-Za-z0-9_-]{1,80}$", description="Short name: letters, digits, - and _.")
    seed: NonNegativeInt = Field(default=0, description="Seed of the random order and of the simulated rig.")
    steps: StepsOrMatrix = Field(description="List of steps, or a matrix.")
    stop_on: tuple[StopCondition, ...] = Field(default=(), description="Conditions that stop the campaign.")
    on_failure: OnFailure = Field(default="ask", description="Action after a step has failed.")
    retries: NonNegativeInt = Field(
        default=1, le=10, description="[1] repetitions of a failed step with on_failure retry; then it stops."
    )
    methods: Literal["any", "approved"] = Field(default="any", description="Methods that may be run.")
    notify: tuple[Recipient, ...] = Field(
        default=(), description="Recipients of a message on stop, end, or when a person is needed."
    )

    @model_validator(mode="after")
    def _check_steps(self) -> Self:
        if isinstance(self.steps, MatrixSteps):
            return self
        if not self.steps:
            raise ValueError("a campaign needs at least one step")
        if (number := find_unfounded_step(self.steps)) is not None:
            raise ValueError(f"step {number} is a next_stroke, but no run precedes it; put a run before it")
        return self

    def to_document(self) -> dict[str, Any]:
        """Return the document, without default values."""
        return self.model_dump(mode="json", by_alias=True, exclude_defaults=True) | {"schema": self.schema_name}


def parse_campaign(content: Any, origin: str) -> Campaign:
    """Return the campaign of a parsed document; ``origin`` names the document in messages.

    Raises:
        CampaignDocumentError: the document is invalid; the message names the position.
    """
    try:
        return Campaign.model_validate(content)
    except ValidationError as error:
        first, message = get_first_error(error)
        place = _format_place(first["loc"])
        raise CampaignDocumentError(f"{origin} is not a campaign: {place}: {message}") from None


_VARIANTS = ("list", "of_matrix", *(kind.__name__ for kind in (IntervalGoal, DiagnosisGoal)))
"""Names that pydantic adds to the position of a fault."""


def _format_place(position: tuple[int | str, ...]) -> str:
    """Return a position as the author wrote it, without the names of the variants that pydantic adds."""
    kept = [
        part
        for before, part in pairwise((None, *position))
        if part not in _VARIANTS and not (isinstance(before, int) and part in STEP_KINDS)
    ]
    return format_position([part for part in kept if part is not None])


def load_campaign(path: Path) -> Campaign:
    """Load a campaign from its file.

    Raises:
        CampaignDocumentError: the file cannot be read, or the document is invalid.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise CampaignDocumentError(f"campaign {path} cannot be read: {error}") from None
    except ValueError as error:
        raise CampaignDocumentError(f"{path} is not a campaign: not JSON, {error}") from None
    return parse_campaign(content, str(path))
