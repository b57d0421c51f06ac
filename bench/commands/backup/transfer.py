"""``mrbench transfer``: the catalogue of a data folder in another database."""

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from bench.catalogue import Transferred


def transfer(
    catalogue: Annotated[
        str,
        typer.Option(
            metavar="URL|sqlite",
            envvar="MRBENCH_CATALOGUE",
            help="Empty PostgreSQL database, postgresql://USER@HOST/DATABASE; sqlite: the file catalogue.db in "
            "--data.",
        ),
    ],
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    out: Annotated[str, typer.Option(metavar="-", help="- prints the number of rows by table as JSON.")] = "",
) -> None:
    """Move the catalogue of a data folder to another database.

    Copies all runs, jobs, notes, events, methods, campaigns, users, certificates and checks, and compares each
    row. Only then does the data folder use the new database. If anything fails, nothing is changed. The service
    must not run meanwhile. The former database keeps its rows, and is no longer used.
    """
    if out not in ("", "-"):
        raise typer.BadParameter(f"--out {out}: give - for JSON, or leave it out")
    from bench.catalogue import transfer_catalogue
    from bench.commands.audit import record
    from bench.progress import show_progress

    began = time.monotonic()
    with show_progress("transfer of the catalogue") as progress:
        done = transfer_catalogue(data.resolve(), catalogue, progress)
    result = _summarise(done, time.monotonic() - began)
    record(
        data,
        "transfer",
        "catalogue",
        {"catalogue": done.source},
        {"catalogue": done.target, "rows": result["rows"]},
    )
    typer.echo(json.dumps(result, indent=2) if out == "-" else _describe(result))


def _summarise(done: "Transferred", seconds: float) -> dict[str, Any]:
    return {
        "source": done.source,
        "target": done.target,
        "tables": done.tables,
        "rows": sum(done.tables.values()),
        "replaced_texts": done.replaced,
        "duration_s": round(seconds, 3),
    }


def _describe(result: dict[str, Any]) -> str:
    """Return the result in lines for a person."""
    lines = [f"{rows:>10} rows  {table}" for table, rows in result["tables"].items() if rows]
    if empty := [table for table, rows in result["tables"].items() if not rows]:
        lines.append(f"{'0 rows':>15}  {', '.join(empty)}")
    lines.append(
        f"{result['rows']:>10} rows  in all, each compared with its copy, in {result['duration_s']:.1f} s"
    )
    if result["replaced_texts"]:
        lines.append(
            f"{result['replaced_texts']} texts contained the character NUL, which PostgreSQL cannot store; it is "
            "replaced by \ufffd"
        )
    lines.append(f"used from now on: {result['target']}")
    lines.append(f"no longer used, and unchanged: {result['source']}")
    return "\n".join(lines)
