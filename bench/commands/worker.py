"""``mrbench worker`` and ``mrbench scheduler``: execution of identification jobs, on this or another machine."""

from pathlib import Path
from typing import Annotated

import typer


def worker(
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Scheduler; by default that of the service that uses --data."),
    ] = None,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    scheduler_tls: Annotated[
        Path | None, typer.Option(metavar="FILE", help="TLS file of --scheduler; by default jobs.pem in --data.")
    ] = None,
    plain_scheduler: Annotated[
        bool,
        typer.Option(
            "--plain-scheduler",
            help="Accept a scheduler without TLS on another machine: anybody who reaches it can execute code.",
        ),
    ] = False,
    nice: Annotated[
        int,
        typer.Option(
            min=0,
            max=19,
            envvar="MRBENCH_NICE",
            help="Niceness of the process; use less than 19 only on a machine without a rig.",
        ),
    ] = 19,
) -> None:
    """Execute identification jobs, one at a time.

    Runs at the lowest priority. Ends when the scheduler ends.
    """
    from bench.jobs import find_scheduler, get_tls_file, locate_scheduler, run_worker
    from bench.log_lines import log_to_stderr

    log_to_stderr()
    location = locate_scheduler(
        scheduler or find_scheduler(data), scheduler_tls or get_tls_file(data), allow_plain=plain_scheduler
    )
    run_worker(location, nice)


def scheduler(
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to listen on; 0.0.0.0 for workers on other machines.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 chooses a free one.")] = 8786,
) -> None:
    """Distribute the jobs of services to workers.

    Needed only where workers outlive the service or run on other machines: `mrbench serve` starts a scheduler. All
    connections are encrypted; jobs.pem in --data is created at the first start and admits services and workers.
    """
    from bench.jobs import run_scheduler
    from bench.log_lines import log_to_stderr

    log_to_stderr()
    run_scheduler(data, host, port, lambda line: typer.echo(line))
