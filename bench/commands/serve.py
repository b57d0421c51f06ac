"""``mrbench serve``: the service with its web page."""

import sys
from pathlib import Path
from typing import Annotated

import typer


def serve(
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="bench.toml of the rig; its agent is started, and started again when it dies."
        ),
    ] = None,
    bench: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=FILE",
            help="One of several benches: a name ([a-z0-9_-]) and its bench.toml, or "
            "NAME=tcp://HOST:PORT,KEYFILE for a running agent elsewhere. Repeat it for each bench, in place of "
            "--config and --agent.",
        ),
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to listen on; use TLS for other than loopback.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port to listen on; 0 chooses a free one.")] = 8600,
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder: logs, results and catalogue.")] = Path(
        "runs"
    ),
    agent: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="Command address of a running rig agent; its samples are published at the next port.",
        ),
    ] = None,
    start_agent: Annotated[
        bool, typer.Option(help="Whether an agent of --config is started here; without, another process does.")
    ] = True,
    agent_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Key of --agent, which its agent keeps beside bench.toml.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="tls://HOST:PORT", help="Job scheduler with workers, instead of starting one here."),
    ] = None,
    new_token: Annotated[
        bool, typer.Option("--new-token", help="Create a new token; the old one becomes invalid.")
    ] = False,
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
    tls_cert: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Certificate chain (PEM), to serve by HTTPS; needs --tls-key."),
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Private key (PEM) of --tls-cert, without a password.")
    ] = None,
    catalogue: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            envvar="MRBENCH_CATALOGUE",
            help="PostgreSQL database of the catalogue, postgresql://USER@HOST/DATABASE; the data folder keeps "
            "the address. By default an SQLite file in --data.",
        ),
    ] = None,
    log_store: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            envvar="MRBENCH_LOG_STORE",
            help="Store to which the logs of finished runs are copied, such as s3://BUCKET/PREFIX or "
            "file:///FOLDER; the data folder keeps the address.",
        ),
    ] = None,
    keep_local: Annotated[
        float | None,
        typer.Option(
            metavar="DAYS",
            min=0,
            help="Remove logs from --data when their verified copy in the log store is so old; they are fetched "
            "when needed. By default none is removed.",
        ),
    ] = None,
    oidc: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="oidc.toml of the provider (OpenID Connect) by which persons sign in."),
    ] = None,
) -> None:
    """Serve the REST interface, the live values and the web page.

    Serves one bench, or several by name. Starts a rig agent for each bench.toml and one worker, unless their
    addresses are given. Prints the page's address. A new token is printed on a terminal only; otherwise it is
    written to the file `token` in the data folder.
    """
    from bench.errors import ConfigError
    from bench.service import BenchPlace, ServeOptions, TlsFiles, parse_benches
    from bench.service import serve as run_service

    if (tls_cert is None) != (tls_key is None):
        raise typer.BadParameter("a certificate and its key belong together; give --tls-cert and --tls-key")
    if bench and (config or agent or agent_key):
        raise typer.BadParameter(
            "--bench names its file or its agent; leave out --config, --agent and --agent-key"
        )
    try:
        benches = parse_benches(bench) if bench else (BenchPlace(config=config, address=agent, key=agent_key),)
    except ConfigError as error:
        raise typer.BadParameter(f"--bench: {error}") from error
    options = ServeOptions(
        data=data,
        host=host,
        port=port,
        benches=benches,
        start_agent=start_agent,
        scheduler=scheduler,
        new_token=new_token,
        scheduler_tls=scheduler_tls,
        allow_plain_scheduler=plain_scheduler,
        tls=None if tls_cert is None or tls_key is None else TlsFiles(tls_cert, tls_key),
        catalogue=catalogue,
        log_store=log_store,
        keep_local=keep_local,
        oidc=oidc,
        is_terminal=sys.stdout.isatty(),
    )
    run_service(options, lambda line: typer.echo(line))
