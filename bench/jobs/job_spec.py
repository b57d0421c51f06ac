"""Job specification: settings, content key and result folder."""

import hashlib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from bench.validation import FrozenModel

FIT_FILE, REPORT_FILE = "fit.json", "report.html"
"""Files in a result folder."""

FitSummary = dict[str, Any]
"""Result, force error and noise floor of a fit, as kept in the catalogue."""


class IdentifySettings(FrozenModel):
    """Settings of an identification."""

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
        if self.hold_out:
            arguments.append(f"--hold-out={','.join(self.hold_out)}")
        if self.hold_out_after is not None:
            arguments.append(f"--hold-out-after={self.hold_out_after}")
        if self.budget_s is not None:
            arguments.append(f"--budget={self.budget_s}s")
        return arguments


@dataclass(frozen=True)
class JobSpec:
    """One job as it is sent to a worker."""

    job_id: str
    key: str
    log: str
    """Path of the log; a worker on another machine needs the data folder at the same path."""
    result: str
    """Result folder; it appears complete when the job is done."""
    settings: IdentifySettings


def compute_content_key(log_sha256: str, settings: IdentifySettings) -> str:
    """Return the key of a job: equal for equal log, settings and version of mrbench."""
    content = f"identify {log_sha256} {settings.model_dump_json()} {version('mrbench')}"
    return hashlib.sha256(content.encode()).hexdigest()


def get_result_folder(log: Path, key: str) -> Path:
    """Return the folder for fit and report: next to the log, one for each key."""
    return log.with_name(f"{log.stem}.fit-{key[:12]}")
