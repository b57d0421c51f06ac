"""Comparison of a method with a bench, before anything moves."""

from collections.abc import Mapping

from bench.agent_protocol import BenchDescription
from bench.campaigns import BenchComparison
from bench.methods import Envelope, Method

_DRIVE_WORDS = {"coil_v": "coil voltage", "coil_a": "coil current", "driver_command_v": "command of a driver"}
_MOTION = {"displacement": ("displacement_m", 1e3, "mm"), "actuator_velocity": ("velocity_mps", 1e3, "mm/s")}
"""Peak of the motion that each limit of the bench is compared with: its field, and factor and unit for people."""
_FORCE = {"force": ("force_n", 1.0, "N")}
"""The same for the force, which is that of a typical damper."""
_ACTIONS = ("hold", "controlled_stop", "trip")
"""Actions of the bench that end a motion."""


def describe_drive_obstacle(method: Method, drive_kind: str) -> str:
    """Return why a bench with a drive cannot run a method; empty if it can, or if the drive is not known."""
    if not drive_kind or drive_kind == method.drive_kind:
        return ""
    own, other = _DRIVE_WORDS[method.drive_kind], _DRIVE_WORDS.get(drive_kind, drive_kind)
    return f"the method sets the {own}, this bench the {other}"


def compare_with_bench(bench: BenchDescription, method: Method, envelope: Envelope) -> BenchComparison:
    """Compare a method with a bench.

    Args:
        bench: drive and limits of the bench.
        method: the method.
        envelope: its peaks; the force is that of a typical damper, so that it is only remarked on.
    """
    drive = filter(None, [describe_drive_obstacle(method, bench.drive_kind)])
    obstacles = (*drive, *_find_excesses(bench, envelope, _MOTION))
    return BenchComparison(obstacles, tuple(_find_excesses(bench, envelope, _FORCE)))


def _find_excesses(
    bench: BenchDescription, envelope: Envelope, peaks: Mapping[str, tuple[str, float, str]]
) -> list[str]:
    """Return a sentence for each peak beyond a limit of the bench that ends a motion."""
    found = []
    for name, (field, factor, unit) in peaks.items():
        peak, limit = getattr(envelope.total, field), bench.limits.get(name)
        values = [] if limit is None else [value for action in _ACTIONS if (value := getattr(limit, action))]
        if values and peak > min(values):
            words = name.replace("_", " ")
            found.append(
                f"{words} {peak * factor:.4g} {unit} exceeds the bench's {min(values) * factor:.4g} {unit}"
            )
    return found
