"""Checkpoints of a method: segments after which a run can be paused, and a later run can continue."""

from bench.errors import RunError
from bench.methods.compile import Programme
from bench.methods.document import Conditioning, ConditioningStage, Method
from bench.methods.plan import plan


def list_checkpoints(programme: Programme) -> tuple[str, ...]:
    """Return the names of the segments after which a run can be paused; never the last one."""
    return tuple(segment.name for segment in programme.segments[:-1] if segment.checkpoint)


def make_remaining_method(method: Method, checkpoint: str) -> Method:
    """Return a method with the segments after a checkpoint, conditioned as at its begin.

    The damper has cooled down and settled since the first part, so the warm-up of the method is repeated.

    Args:
        method: the whole method.
        checkpoint: name of the checkpoint's segment, in the log or in the method.

    Raises:
        RunError: there is no such checkpoint, or nothing follows it.
        MethodError: a segment cannot be sampled.
    """
    parts = [part.segments for part in plan(method) if part.segments]
    last_names = {
        segments[-1].name: index for index, segments in enumerate(parts) if method.segments[index].checkpoint
    }
    own_names = {one.name: index for index, one in enumerate(method.segments) if one.checkpoint}
    index = last_names.get(checkpoint, own_names.get(checkpoint))
    if index is None:
        names = ", ".join(last_names) or "none"
        raise RunError(f"method {method.name} has no checkpoint after {checkpoint}; its checkpoints: {names}")
    if index == len(method.segments) - 1:
        raise RunError(
            f"method {method.name} has no segment after {checkpoint}; the run was complete, start a new one"
        )
    conditioning = Conditioning(before=_find_stage(method.conditioning), between=method.conditioning.between)
    return method.model_copy(update={"segments": method.segments[index + 1 :], "conditioning": conditioning})


def _find_stage(conditioning: Conditioning) -> ConditioningStage | None:
    """Return the stage before the first remaining segment, one with a warm-up if there is any."""
    before, between = conditioning.before, conditioning.between
    if before is not None and before.warm_up is not None:
        return before
    return between or before
