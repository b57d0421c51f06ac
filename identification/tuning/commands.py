"""`mrbench tune`: Bayesian optimisation of how a network is trained."""

from pathlib import Path
from typing import Annotated

import typer


def tune(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs to train on, each a damper of its own.")
    ],
    out: Annotated[
        Path, typer.Option("--out", metavar="PRESET.json", help="The tuned preset; a summary stands beside it.")
    ],
    preset: Annotated[
        str, typer.Option(help="Where it starts from: `local`, `tuned`, `global`, `paper`, or a settings file.")
    ] = "local",
    trials: Annotated[int, typer.Option(min=1, help="Trials in all, earlier calls included.")] = 30,
    budget: Annotated[
        float, typer.Option(metavar="SECONDS", min=1.0, help="Processor time of one training.")
    ] = 60.0,
    price: Annotated[
        float, typer.Option(metavar="SHARE", min=0.0, help="What a second adds to the value.")
    ] = 0.001,
    workers: Annotated[int, typer.Option(min=1, help="Processes that work on the study.")] = 1,
    study: Annotated[
        Path | None,
        typer.Option(metavar="FILE.db", help="The study, to go on with; beside the preset by default."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything that chance decides.")] = 1,
) -> None:
    """Find better settings of a network by Bayesian optimisation; a study goes on where it stopped."""
    from identification.document_file import check_place
    from identification.errors import IdentificationError
    from identification.tuning.study import Order, best_settings, run
    from identification.tuning.summary import importances, page, write_picture

    if str(out) == "-" or out.suffix != ".json":
        raise IdentificationError(f"{out}: a preset goes to a file that ends in .json")
    check_place(out)
    order = Order(tuple(logs), preset, study or out.with_suffix(".db"), trials, budget, price, seed)
    found = run(order, workers, lambda words: typer.echo(words, err=True))
    settings = best_settings(found, preset).model_dump_json(indent=2)
    shares = importances(found)
    picture = out.with_suffix(".png")
    if shares:
        write_picture(picture, shares)
    try:
        out.write_text(settings + "\n", encoding="utf-8")
        text = page(found, settings, shares, picture.name if shares else None)
        out.with_suffix(".md").write_text(text, encoding="utf-8")
    except OSError as error:
        raise IdentificationError(f"{out}: cannot be written ({error.strerror}); choose another place") from error
    typer.echo(f"{out}: best of {len(found.trials)} trials, value {found.best_value:.4f}", err=True)
