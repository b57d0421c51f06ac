"""``mrbench report``: a run as one self-contained page, as PDF, or as a workbook."""

from pathlib import Path
from typing import Annotated

import typer


def report(
    log: Annotated[Path, typer.Argument(help="Recording to report on.", metavar="LOG")],
    out: Annotated[Path, typer.Option(metavar="FILE", help="File to write: .html, .pdf or .xlsx.")],
    fit: Annotated[
        Path | None,
        typer.Option(metavar="FIT", help="Fit written by `identify`; without it only the recording is shown."),
    ] = None,
    diagnosis: Annotated[
        Path | None,
        typer.Option(metavar="DIAGNOSIS", help="Diagnosis of the sim-to-real gap, written by `diagnose`."),
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option(metavar="TRUTH", help="Truth file of `sim --draw`, to be compared with the diagnosis."),
    ] = None,
    unseen: Annotated[
        Path | None,
        typer.Option(metavar="PREDICTION", help="With --truth: prediction of another recording by the twin."),
    ] = None,
    series: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With --fit: also write recorded and simulated force (.npz)."),
    ] = None,
    plots: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Also write the plots to this folder, as SVG and PNG.")
    ] = None,
) -> None:
    """Write a report on a recording as page, PDF or workbook.

    The ending of --out chooses the format. Page (.html) and PDF show recorded over simulated force, errors, and
    parameters with intervals, and name deficiencies. The workbook (.xlsx) has the samples, values of each stroke,
    parameters and definitions.
    """
    import shlex
    from datetime import UTC, datetime

    from bench.log import write_atomically
    from bench.report import gather, make_figures, save_figures
    from bench.report.formats import REPORT_FORMATS, ReportWriter

    if str(out) == "-":
        raise typer.BadParameter("a report cannot be printed; give a file: --out report.html")
    report_format = next((known for known in REPORT_FORMATS if out.suffix.lower() == f".{known}"), None)
    if report_format is None:
        raise typer.BadParameter(f"--out {out.name} does not end with one of .{', .'.join(REPORT_FORMATS)}")
    if truth is not None and diagnosis is None:
        raise typer.BadParameter("--truth is compared with a diagnosis; add --diagnosis FILE")
    if unseen is not None and truth is None:
        raise typer.BadParameter("--unseen is shown next to the truth; add --truth FILE")
    if series is not None and (fit is None or series.suffix != ".npz"):
        raise typer.BadParameter("--series is that of a fit, as .npz; add --fit FILE, or give another suffix")
    documents = {"--fit": fit, "--diagnosis": diagnosis, "--truth": truth, "--unseen": unseen}
    command = ["mrbench", "report", str(log)]
    for option, path in {**documents, "--out": out, "--series": series, "--plots": plots}.items():
        command += [option, str(path)] if path else []
    content = gather(log, fit, diagnosis, truth, unseen, series)
    figures = make_figures(content)
    if plots is not None:
        save_figures(figures, plots)
    with write_atomically(out) as partial:
        ReportWriter(content, figures, shlex.join(command), datetime.now(UTC)).write(report_format, partial)
    typer.echo(f"{out}: {out.stat().st_size / 1e6:.1f} MB, {len(figures)} plots", err=True)
