"""``mrbench report``: one self-contained page of a run."""

from pathlib import Path
from typing import Annotated

import typer


def report(
    log: Annotated[Path, typer.Argument(help="The recording.", metavar="LOG")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="The page to write.")],
    fit: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="A fit made by `identify`; without it the recording alone is shown."),
    ] = None,
    diagnosis: Annotated[
        Path | None,
        typer.Option(
            metavar="DIAGNOSIS", help="A diagnosis made by `diagnose`: what is missing in the simulation."
        ),
    ] = None,
    plots: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write the plots there, as SVG and PNG.")
    ] = None,
) -> None:
    """Write one self-contained page of a recording.

    It shows recorded over simulated force, errors, parameters with intervals, and says in words what falls short.
    """
    import shlex
    from datetime import UTC, datetime

    from bench.recorder.replacement import replacing
    from bench.report.page import figures, gather, render
    from bench.report.plots import save

    if str(out) == "-":
        raise typer.BadParameter("a page goes to a file: --out report.html")
    words = ["mrbench", "report", str(log), *(["--fit", str(fit)] if fit else [])]
    words += [*(["--diagnosis", str(diagnosis)] if diagnosis else []), "--out", str(out)]
    words += ["--plots", str(plots)] if plots else []
    found = gather(log, fit, diagnosis)
    drawn = figures(found)
    page = render(found, drawn, shlex.join(words), datetime.now(UTC))
    if plots is not None:
        save(drawn, plots)
    with replacing(out) as partial:
        partial.write_text(page, encoding="utf-8")
    typer.echo(f"{out}: {len(page) / 1e6:.1f} MB, {len(drawn)} plots", err=True)
