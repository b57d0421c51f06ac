"""The commands of this room: `mrbench identify` and `mrbench predict`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from identification.results import Document

Logs = Annotated[
    list[Path], typer.Argument(metavar="LOG...", help="Logs of one specimen, as recorded or imported.")
]
Out = Annotated[Path, typer.Option("--out", help="Where the document goes; `-` prints it.")]


def identify(
    logs: Logs,
    out: Out,
    stages: Annotated[str, typer.Option(help="Stages of the fit, by comma; so far there is `refine`.")] = "refine",
    hold_out: Annotated[
        str,
        typer.Option(metavar="PATTERN,...", help="Stretches or segments kept out of the fit, such as `5mm_4Hz*`."),
    ] = "",
    hold_out_after: Annotated[
        float | None, typer.Option(min=0.05, max=0.95, help="Fraction of each stretch after which it is held out.")
    ] = None,
    delay_prior: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="How well the channels' clocks agree; 0 takes them as recorded. By default as the log says.",
        ),
    ] = None,
    budget: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0.1, help="Stop trying further starts after this long.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the scattered starts.")] = 1,
) -> None:
    """Find the damper's parameters in recordings, each with an interval and what it means."""
    from identification.assemble import HoldOut
    from identification.errors import IdentificationError
    from identification.identify import Request
    from identification.identify import identify as fit
    from identification.progress import progress_on_terminal
    from identification.recordings import load
    from identification.refine import Settings

    if unknown := set(stages.split(",")) - {"refine"}:
        raise IdentificationError(f"no stage {', '.join(sorted(unknown))}; there is refine")
    _check_place(out)
    held = HoldOut(_words(hold_out), hold_out_after)
    with progress_on_terminal("identify") as progress:
        found = fit(
            [load(log) for log in logs],
            Request(held, delay_prior, Settings(seed=seed, budget=budget)),
            progress,
        )
    _write(out, found)
    _say(out, found.rmse_n.train, found.nrmse.train, found.noise_floor_n, found.result)


def predict(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="A fit, a twin or a scenario.")],
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log that the model never saw.")],
    out: Out,
    series: Annotated[
        Path | None, typer.Option(help="Also write recorded and simulated force, as .npz or .csv.")
    ] = None,
    free: Annotated[str, typer.Option(metavar="offset", help="What else to estimate on this log: `offset`.")] = "",
) -> None:
    """Simulate a fit or a twin on a log; only the inner displacement at the start of each stretch is freed."""
    from identification.errors import IdentificationError
    from identification.gap.model import read_fit_or_model
    from identification.predict import predict_log
    from identification.recordings import load
    from identification.series import write_series

    if free not in ("", "offset"):
        raise IdentificationError(f"--free {free}: only a force offset can be freed; say `--free offset`")
    _check_place(out)
    prediction, found = predict_log(read_fit_or_model(model), load(log), free_offset=free == "offset")
    if series is not None:
        write_series(series, found)
    _write(out, prediction)
    _say(
        out, prediction.rmse_n, prediction.nrmse, prediction.noise_floor_n, f"freed: {', '.join(prediction.freed)}"
    )


def _words(text: str) -> tuple[str, ...]:
    return tuple(word for word in text.split(",") if word)


def _say(out: Path, error: float, relative: float, floor: float, more: str) -> None:
    """One line of result for a person, on standard error: force error and noise floor [N]."""
    where = "printed" if str(out) == "-" else out
    share = f"{100 * relative:.2g} % of the force's deviation"
    typer.echo(f"{where}: force error {error:.3g} N ({share}), noise floor {floor:.3g} N; {more}", err=True)


def _check_place(out: Path) -> None:
    """Refuse before the work what could not be written after it."""
    from identification.errors import IdentificationError

    if str(out) != "-" and not out.parent.is_dir():
        raise IdentificationError(f"{out}: there is no folder {out.parent}; choose another place")


def _write(out: Path, document: "Document") -> None:
    """The document to a file, whole or not at all, or to standard output for `-`."""
    from identification.errors import IdentificationError

    text = document.model_dump_json(by_alias=True, indent=2) + "\n"
    if str(out) == "-":
        typer.echo(text, nl=False)
        return
    partial = out.with_name(out.name + ".partial")
    try:
        partial.write_text(text, encoding="utf-8")
        partial.replace(out)
    except OSError as error:
        raise IdentificationError(f"{out}: cannot be written ({error.strerror}); choose another place") from error
