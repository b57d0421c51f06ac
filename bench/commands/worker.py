"""``mrbench worker``: carries out identification jobs, on this or another machine."""

from pathlib import Path
from typing import Annotated

import typer


def worker(
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="The scheduler; by default that of the service on --data."),
    ] = None,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    nice: Annotated[
        int,
        typer.Option(
            min=0, max=19, envvar="MRBENCH_NICE", help="How far it stands back; less than 19 only where no rig is."
        ),
    ] = 19,
) -> None:
    """Carry out identification jobs, one at a time.

    At the lowest priority, until the scheduler goes.
    """
    from bench.jobs.worker import run_worker, scheduler_of
    from bench.service.log_lines import log_to_stderr

    log_to_stderr()
    run_worker(scheduler or scheduler_of(data), nice)
