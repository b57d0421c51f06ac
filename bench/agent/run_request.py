"""Run request: a run command that was checked and compiled and can be executed."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from bench.agent_protocol import RunCommand
from bench.errors import RunError
from bench.log import Identity
from bench.methods import Method, Programme, compile_method, make_remaining_method, parse_method
from bench.rig import Rig
from bench.sequencer import split_into_sections


@dataclass(frozen=True)
class RunRequest:
    """Run that passed all checks that are possible before anything moves."""

    method: Method
    """Whole method, also if the run continues another one."""
    programme: Programme
    """Programme to play; of a continued run, that of the part after its checkpoint."""
    identity: Identity
    path: Path
    """File of the log."""
    resumed_after: str = ""
    """Checkpoint after which the run begins; empty for a whole run."""
    continues: str = ""
    """Identifier of the run that it continues; empty without one."""
    overdue: tuple[str, ...] = ()
    """Channels whose calibration is overdue, in words."""
    failed_checks: tuple[str, ...] = ()
    """Channels whose latest check has failed, in words."""


def validate_request(command: RunCommand, rig: Rig, specimen: str, folder: Path) -> RunRequest:
    """Check and compile a run command.

    Args:
        command: as received.
        rig: instruments of the bench.
        specimen: used if the command does not name one.
        folder: folder of the logs.

    Raises:
        MethodError: the method is not valid, or cannot be compiled within its limits.
        RunError: this bench cannot execute it, or the log has no folder.
    """
    method = parse_method(command.method, "the method of the command")
    after = command.resume_after
    programme = compile_method(make_remaining_method(method, after) if after else method)
    if method.drive_kind != rig.drive_kind:
        raise RunError(
            f"method {method.name} drives by {method.drive_kind}, this bench by {rig.drive_kind}; use another "
            "method, or set the mode of the coil amplifier in bench.toml"
        )
    split_into_sections(programme, rig.amplifier.table_capacity)
    identity = Identity(command.specimen or specimen, command.operator, datetime.now(UTC))
    path = Path(command.log) if command.log else folder / f"{identity.make_run_id(method.name)}.mcap"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(
            f"{path.parent}: the folder of the log cannot be created ({error.strerror}); choose another folder"
        ) from None
    return RunRequest(method, programme, identity, path, after, command.continues)
