"""Route that decodes the raw frames of a run again."""

from fastapi import APIRouter
from pydantic import Field

from bench.replay import ReplayResult, replay_frames
from bench.service.context import Context
from bench.service.views import View

router = APIRouter(prefix="/runs", tags=["recordings"])


class ReplayedInstrument(View):
    """Raw frames of one instrument, decoded again."""

    instrument: str
    frames: int = Field(description="number of frames")
    samples: int = Field(description="number of compared readings")
    differences: int = Field(description="number of readings that are missing, additional or different")
    message: str = Field(description="first difference, or why nothing was compared; empty if all are equal")


class ReplayView(View):
    """Result of decoding the raw frames of a run again."""

    equal: bool = Field(description="true if the frames give the recorded readings, or if there are none")
    instruments: tuple[ReplayedInstrument, ...] = Field(description="empty for a log without raw frames")
    text: str = Field(description="one sentence for a person")


@router.post("/{run_id}/replay")
def replay_run(run_id: str, context: Context) -> ReplayView:
    """Decode the raw frames of a run by the decoders of the drivers and compare the readings bit for bit.

    Nothing is changed. The samples themselves are at `/runs/{run_id}/samples`.
    """
    results = replay_frames(context.locate_log(context.get_run(run_id)))
    instruments = tuple(ReplayedInstrument.model_validate(one._asdict()) for one in results)
    return ReplayView(
        equal=all(one.is_equal for one in results), instruments=instruments, text=describe_replay(results)
    )


def describe_replay(results: list[ReplayResult]) -> str:
    """Return one sentence on the results, for a person."""
    if not results:
        return "The log has no raw frames: it was imported, or recorded without wires."
    different = [str(one) for one in results if not one.is_equal]
    if different:
        return f"The raw frames differ from the readings: {'; '.join(different)}."
    count = sum(one.samples for one in results)
    return f"The raw frames of {len(results)} instruments were decoded again: all {count} readings are equal."
