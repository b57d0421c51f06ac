"""Request and response models of recordings, with units in the descriptions."""

from datetime import datetime
from typing import Annotated

from pydantic import Field, StringConstraints

from bench.catalogue import NoteKind
from bench.samples import Channel, SegmentRange
from bench.service.views import View

Author = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Tag = Annotated[
    str, StringConstraints(strip_whitespace=True, min_length=1, max_length=60, pattern=r'^[^"\\\x00-\x1f]+$')
]
"""Tag of a run; without quotes, so that a search finds it exactly."""


class SampleSeries(View):
    """Samples of a run; with decimation, the real samples at which a channel has an extreme."""

    run: str = Field(description="id of the run")
    started_utc_s: float | None = Field(description="UTC of the first sample of the run [s since 1970]")
    samples: int = Field(description="number of recorded samples in the range")
    decimated: bool = Field(description="true if not all of them are returned")
    channels: tuple[Channel, ...]
    time: list[float] = Field(description="time since the first sample of the run [s]")
    values: dict[str, list[float | None]] = Field(description="by channel; null for a missing value")


class SegmentList(View):
    """Segments of a run."""

    drive_unit: str = Field(description="V or A")
    items: tuple[SegmentRange, ...] = Field(description="in order")


class EventView(View):
    """One event."""

    id: int = Field(description="number; greater for later events")
    run: str | None = Field(description="id of the run; null outside runs")
    bench: str | None = Field(description="name of the bench; null in events of older versions and of imports")
    at: datetime = Field(description="UTC")
    time_s: float | None = Field(
        description="time since the first sample of the run [s]; null until the run has ended"
    )
    kind: str = Field(description="state, command, alarm, trip, late, checkpoint, run_finished")
    text: str


class EventPage(View):
    """One page of events."""

    items: tuple[EventView, ...]
    next: int | None = Field(description="number for the next page; null on the last page")


class RunFile(View):
    """One file of a run."""

    name: str
    kind: str = Field(description="log, fit, diagnosis, twin, export or report")
    path: str = Field(description="address below the service that returns it")
    media_type: str
    size: int | None = Field(default=None, description="[bytes]; null for a file that is made at its request")
    sha256: str | None = Field(
        default=None, description="hash of its content, of a log as it was recorded; null if it is not known"
    )
    job: str | None = Field(default=None, description="id of the job that made it; null without one")
    made: datetime | None = Field(default=None, description="UTC at which the job ended; null without one")


class RunFileList(View):
    """Files of a run."""

    items: tuple[RunFile, ...] = Field(description="log, newest results, exports, reports")


class NoteRequest(View):
    """Note of a person."""

    author: Author = Field(description="name of the person")
    text: str = Field(min_length=1, max_length=10_000)


class NoteView(View):
    """One note on a run, which is never changed."""

    id: int = Field(description="number; greater for later notes")
    at: datetime = Field(description="UTC")
    author: str
    kind: NoteKind = Field(description="note: a text of a person; tags: the record of changed tags")
    text: str


class NotePage(View):
    """One page of notes, the oldest first."""

    items: tuple[NoteView, ...]
    next: int | None = Field(description="number for the next page; null on the last page")


class RunChange(View):
    """Change of what a person may change on a run."""

    author: Author = Field(description="name of the person")
    tags: tuple[Tag, ...] = Field(max_length=50, description="all tags that the run has afterwards")
