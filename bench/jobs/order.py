"""What a worker is asked to do, under a key that is made of its content."""

import hashlib
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field


class IdentifySettings(BaseModel):
    """How a run is identified."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    stages: tuple[Literal["pinn", "refine"], ...] = Field(
        default=("pinn", "refine"), min_length=1, description="stages of the fit"
    )
    hold_out: tuple[str, ...] = Field(default=(), description="stretches or segments kept out, such as `5mm_4Hz*`")
    hold_out_after: float | None = Field(
        default=None, ge=0.05, le=0.95, description="fraction of each stretch after which it is held out"
    )
    budget_s: float | None = Field(default=None, ge=0.1, description="[s] after which no further start is tried")
    time_limit_s: float = Field(default=3600.0, gt=0, description="[s] after which the job is ended as failed")

    def words(self) -> list[str]:
        """The options of `mrbench identify`."""
        words = [f"--stages={','.join(self.stages)}"]
        if self.hold_out:
            words.append(f"--hold-out={','.join(self.hold_out)}")
        if self.hold_out_after is not None:
            words.append(f"--hold-out-after={self.hold_out_after}")
        if self.budget_s is not None:
            words.append(f"--budget={self.budget_s}")
        return words


@dataclass(frozen=True)
class Order:
    """One job as a worker gets it."""

    job_id: str
    key: str
    log: str
    """Path; a worker on another machine needs the data folder at the same place."""
    result: str
    """Folder that appears, whole, when all is done."""
    settings: IdentifySettings


def content_key(log_sha256: str, settings: IdentifySettings) -> str:
    """The same for the same log, settings and version of the product."""
    content = f"identify {log_sha256} {settings.model_dump_json()} {version('mrbench')}"
    return hashlib.sha256(content.encode()).hexdigest()


def result_folder(log: Path, key: str) -> Path:
    """Where fit and report of a log go: beside it, a folder of their own for each key."""
    return log.with_name(f"{log.stem}.fit-{key[:12]}")


FIT, REPORT = "fit.json", "report.html"
"""Files in a result folder."""

Summary = dict[str, Any]
"""What a catalogue keeps of a fit: result, force error and noise floor."""
