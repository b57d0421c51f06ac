"""Settings of the kinds of jobs, and the options of the commands that they stand for."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias

from pydantic import Field

from bench.validation import FrozenModel

AnalysisKind: TypeAlias = Literal["identify", "diagnose", "predict"]
"""Kinds of jobs on a single run."""
JobKind: TypeAlias = Literal["identify", "diagnose", "predict", "trend"]


class IdentifySettings(FrozenModel):
    """Settings of an identification. The order of the fields is part of the content key of existing fits."""

    stages: tuple[Literal["pinn", "refine"], ...] = Field(
        default=("pinn", "refine"), min_length=1, description="stages of the fit"
    )
    hold_out: tuple[str, ...] = Field(default=(), description="stretches or segments to hold out: `5mm_4Hz*`")
    hold_out_after: float | None = Field(
        default=None, ge=0.05, le=0.95, description="fraction of each stretch after which samples are held out"
    )
    budget_s: float | None = Field(default=None, ge=0.1, description="[s] after which no further start is tried")
    time_limit_s: float = Field(default=3600.0, gt=0, description="[s] after which the job fails")

    def make_cli_arguments(self) -> list[str]:
        """Return the options of `mrbench identify`."""
        arguments = [f"--stages={','.join(self.stages)}"]
        arguments += _make_hold_out_arguments(self.hold_out, self.hold_out_after)
        return arguments if self.budget_s is None else [*arguments, f"--budget={self.budget_s}s"]


class DiagnoseSettings(FrozenModel):
    """Settings of a diagnosis."""

    hold_out: tuple[str, ...] = Field(
        default=(), description="stretches or segments that no fit and no choice reads: `5mm_4Hz*`"
    )
    hold_out_after: float | None = Field(
        default=None, ge=0.05, le=0.95, description="fraction of each stretch after which it is held out likewise"
    )
    discover: bool = Field(default=False, description="also search for a cause outside the library of effects")
    residual: bool = Field(default=False, description="also learn what law and effects leave, for the twin")
    model: str | None = Field(
        default=None,
        max_length=64,
        description="id of a fit, or of a diagnosis for its twin, whose gap on this run is reported too",
    )
    time_limit_s: float = Field(default=7200.0, gt=0, description="[s] after which the job fails")

    def make_cli_arguments(self) -> list[str]:
        """Return the options of `mrbench diagnose`, without `--model`, whose path only the worker knows."""
        switches = {"--discover": self.discover, "--residual": self.residual}
        chosen = [name for name, is_set in switches.items() if is_set]
        return [*_make_hold_out_arguments(self.hold_out, self.hold_out_after), *chosen]


class TrendSettings(FrozenModel):
    """Settings of the trend of a specimen."""

    runs: tuple[str, ...] = Field(min_length=3, max_length=200, description="ids of its runs, the oldest first")
    time_limit_s: float = Field(default=14400.0, gt=0, description="[s] after which the job fails")

    def make_cli_arguments(self) -> list[str]:
        """Return the options of `mrbench trend`; it has none."""
        return []


class PredictSettings(FrozenModel):
    """Settings of a prediction: the simulation of a fit or twin on a run that it need not have read."""

    model: str = Field(
        min_length=1, max_length=64, description="id of a fit, or of a diagnosis for its twin; of any run"
    )
    free_offset: bool = Field(default=False, description="adapt a constant offset of the force to this run")
    time_limit_s: float = Field(default=1800.0, gt=0, description="[s] after which the job fails")

    def make_cli_arguments(self) -> list[str]:
        """Return the options of `mrbench predict`."""
        return ["--free", "offset"] if self.free_offset else []


JobSettings: TypeAlias = IdentifySettings | DiagnoseSettings | PredictSettings | TrendSettings
_KINDS: dict[JobKind, type[JobSettings]] = {
    "identify": IdentifySettings,
    "diagnose": DiagnoseSettings,
    "predict": PredictSettings,
    "trend": TrendSettings,
}


def get_kind(settings: JobSettings) -> JobKind:
    """Return the kind of job that settings belong to."""
    return next(kind for kind, model in _KINDS.items() if isinstance(settings, model))


def parse_settings(kind: JobKind, document: Mapping[str, Any]) -> JobSettings:
    """Return the settings of a job of a kind.

    Raises:
        ValidationError: the document is not one of this kind.
    """
    return _KINDS[kind].model_validate(document)


def _make_hold_out_arguments(patterns: Sequence[str], after: float | None) -> list[str]:
    arguments = [f"--hold-out={','.join(patterns)}"] if patterns else []
    return arguments if after is None else [*arguments, f"--hold-out-after={after}"]
