"""Command `mrbench tune`: Bayesian optimisation of a network's settings."""

from pathlib import Path
from typing import Annotated

import typer


def tune(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs to train on, each of another damper.")
    ],
    out: Annotated[
        Path,
        typer.Option("--out", metavar="PRESET.json", help="The tuned preset; a summary is written next to it."),
    ],
    preset: Annotated[
        str,
        typer.Option(help="The preset to vary: `elements`, `tuned`, `dense`, `paper`, or a settings file."),
    ] = "elements",
    trials: Annotated[int, typer.Option(min=1, help="Trials in total, earlier calls included.")] = 30,
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", min=1.0, help="Processor time of one training.")
    ] = 60.0,
    time_weight: Annotated[
        float,
        typer.Option("--time-weight", metavar="SHARE", min=0.0, help="Weight of one second in the objective."),
    ] = 0.001,
    price: Annotated[
        float | None, typer.Option("--price", min=0.0, hidden=True, help="Former name of --time-weight.")
    ] = None,
    workers: Annotated[int, typer.Option(min=1, help="Processes that work on the study.")] = 1,
    study: Annotated[
        Path | None,
        typer.Option(metavar="FILE.db", help="The study to begin or continue; next to the preset by default."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.")] = 1,
) -> None:
    """Find better settings of a network by Bayesian optimisation.

    An interrupted study can be continued.
    """
    from identification.documents import check_output_path
    from identification.errors import IdentificationError
    from identification.tuning import (
        StudyRequest,
        compute_importances,
        format_summary,
        get_best_settings,
        run_study,
        write_plot,
    )

    if str(out) == "-" or out.suffix != ".json":
        raise IdentificationError(f"{out}: the preset needs a file whose name ends in .json")
    check_output_path(out)
    weight = time_weight if price is None else price
    request = StudyRequest(tuple(logs), preset, study or out.with_suffix(".db"), trials, budget, weight, seed)
    finished = run_study(request, workers, lambda message: typer.echo(message, err=True))
    settings = get_best_settings(finished, preset).model_dump_json(indent=2)
    importances = compute_importances(finished)
    plot = out.with_suffix(".png")
    if importances:
        write_plot(plot, importances)
    summary = format_summary(finished, settings, importances, plot.name if importances else None)
    _write_files(out, settings + "\n", summary)
    typer.echo(f"{out}: best of {len(finished.trials)} trials, value {finished.best_value:.4f}", err=True)


def _write_files(out: Path, settings: str, summary: str) -> None:
    from identification.errors import IdentificationError

    try:
        out.write_text(settings, encoding="utf-8")
        out.with_suffix(".md").write_text(summary, encoding="utf-8")
    except OSError as error:
        raise IdentificationError(f"{out}: cannot be written ({error.strerror}); choose another place") from error
