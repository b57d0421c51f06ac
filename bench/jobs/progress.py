"""Progress of a job, and the lines by which the commands of a job report it."""

import json
from dataclasses import asdict, dataclass
from typing import Any

PROGRESS_ENVIRONMENT = {"MRBENCH_PROGRESS": "json"}
"""Environment in which a command reports its progress on standard error, as one JSON object in a line."""


@dataclass(frozen=True)
class JobProgress:
    """Stage of a job and completed share of it."""

    stage: str
    """Name of the present stage, such as `refine`."""
    fraction: float
    """Completed share of the job, 0 to 1; stages take different time."""
    activity: str
    """Present activity, for a person."""

    def to_document(self) -> dict[str, Any]:
        """Return the progress as JSON values."""
        return asdict(self)


@dataclass(frozen=True)
class CommandStep:
    """One command of a job and its part of the whole job."""

    name: str
    """Name of the command."""
    first: float
    """Share of the job that is complete when it starts."""
    last: float
    """Share of the job that is complete when it ends."""

    def begin(self) -> JobProgress:
        """Return the progress at the start of the command."""
        return JobProgress(self.name, self.first, self.name)

    def read_line(self, line: str, latest: JobProgress) -> JobProgress:
        """Return the progress after a line of output: a report, or text that becomes the activity."""
        report = _parse_report(line)
        if report is None:
            return JobProgress(latest.stage, latest.fraction, f"{self.name}: {line}")
        stage, share, message = report
        fraction = self.first + (self.last - self.first) * min(max(share, 0.0), 1.0)
        activity = ", ".join(text for text in (stage, message) if text)
        return JobProgress(stage, max(fraction, latest.fraction), f"{self.name}: {activity}")


def is_report(line: str) -> bool:
    """Return whether a line of output is a report of progress."""
    return _parse_report(line) is not None


def _parse_report(line: str) -> tuple[str, float, str] | None:
    """Return stage, completed share of the command and message of a report; None for any other line."""
    if not line.startswith("{"):
        return None
    try:
        report = json.loads(line)
        return str(report["stage"]), float(report["fraction"]), str(report["message"])
    except (ValueError, KeyError, TypeError):
        return None
