"""The commands of this room: `mrbench identify` and `mrbench predict`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from identification.identify import Request
    from identification.results import Fit

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG...", help="Logs of one specimen, as recorded or imported; see `--each`."),
]
Out = Annotated[Path, typer.Option("--out", help="Where the document goes; `-` prints it.")]


def identify(
    logs: Logs,
    out: Out,
    stages: Annotated[
        str,
        typer.Option(
            help="Stages of the fit, by comma: `pinn` trains a network, `refine` fits the simulated force."
        ),
    ] = "pinn,refine",
    preset: Annotated[
        str,
        typer.Option(help="The network: `local`, `tuned`, `global`, `paper`, or a settings file."),
    ] = "local",
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
        float | None, typer.Option(metavar="SECONDS", min=0.1, help="Processor time, shared by the stages.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Of everything that chance decides.")] = 1,
    free: Annotated[
        str,
        typer.Option(metavar="NAME,...", help="What each further log has of its own: `offset`, `viscosity`."),
    ] = "",
    profile: Annotated[
        bool, typer.Option("--profile", help="Also intervals by profile likelihood; takes several times as long.")
    ] = False,
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Every log is of a specimen of its own: a document each, named as the log, in the folder "
            "`--out`. On an accelerator the network `global` is trained on many of them at once.",
        ),
    ] = False,
) -> None:
    """Find the damper's parameters in recordings, each with an interval and what it means."""
    # Inside the command, as everywhere here: `--help` must not wait for numba and scipy (decision 0006).
    from identification.assemble import HoldOut
    from identification.document_file import check_place, write_document
    from identification.errors import IdentificationError
    from identification.identify import Request
    from identification.identify import identify as fit
    from identification.progress import progress_on_terminal
    from identification.recordings import load
    from identification.refine import Settings

    asked = _words(stages)
    if unknown := set(asked) - {"pinn", "refine"}:
        raise IdentificationError(f"no stage {', '.join(sorted(unknown))}; there are pinn and refine")
    if not asked:
        raise IdentificationError("no stage was asked for; there are pinn and refine")
    own = _own(free)
    held = HoldOut(_words(hold_out), hold_out_after)
    request = Request(held, delay_prior, Settings(seed=seed, budget=budget), asked, preset, own, profile)
    if each:
        _each(logs, out, request)
        return
    check_place(out)
    with progress_on_terminal("identify") as progress:
        found = fit([load(log) for log in logs], request, progress)
    write_document(out, found)
    _say_fit(out, found)


def _each(logs: "Sequence[Path]", folder: Path, request: "Request") -> None:
    """A fit of every log by itself; those that cannot be fitted are named in the end."""
    from identification.campaign import identify_each, places
    from identification.document_file import check_place, write_document
    from identification.errors import IdentificationError
    from identification.progress import progress_on_terminal

    if request.own:
        raise IdentificationError("--free says what logs of one specimen differ in; with --each none are of one")
    if str(folder) == "-":
        raise IdentificationError("--out -: with --each there are several documents; name a folder for them")
    check_place(folder)
    outs = dict(zip(logs, places(logs, folder), strict=True))
    folder.mkdir(exist_ok=True)
    failed: list[str] = []
    with progress_on_terminal("identify") as progress:
        for one in identify_each(logs, request, progress):
            if one.fit is None:
                failed.append(f"{one.log.name}: {one.why_not}")
            else:
                write_document(outs[one.log], one.fit)
                _say_fit(outs[one.log], one.fit)
    if failed:
        raise IdentificationError(f"{len(failed)} of {len(logs)} logs have no fit: {'; '.join(failed)}")


def _say_fit(out: Path, fit: "Fit") -> None:
    said = "; ".join(words for words in (fit.result, fit.agreement, *fit.notes) if words)
    _say(out, fit.rmse_n.train, fit.nrmse.train, fit.noise_floor_n, said)


def predict(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="A fit, a twin or a scenario.")],
    log: Annotated[
        str,
        typer.Argument(metavar="LOG", help="A log that the model never saw, or a method that is only planned."),
    ],
    out: Out,
    series: Annotated[
        Path | None,
        typer.Option(help="Also write recorded and simulated force and its 95 % band, as .npz or .csv."),
    ] = None,
    free: Annotated[str, typer.Option(metavar="offset", help="What else to estimate on this log: `offset`.")] = "",
) -> None:
    """Simulate a fit or a twin on a log; only the inner displacement at the start of each stretch is freed."""
    from identification.document_file import check_place, write_document
    from identification.errors import IdentificationError
    from identification.gap.model import read_fit_or_model
    from identification.predict import predict_log
    from identification.recordings import load
    from identification.series import write_series

    if free not in ("", "offset"):
        raise IdentificationError(f"--free {free}: only a force offset can be freed; say `--free offset`")
    check_place(out)
    if not _is_log(log):
        return _forecast(model, log, out, series, free)
    prediction, found = predict_log(read_fit_or_model(model), load(Path(log)), free_offset=free == "offset")
    if series is not None:
        write_series(series, found)
    write_document(out, prediction)
    said = f"freed: {', '.join(prediction.freed)}"
    if prediction.band is not None and prediction.band.inside is not None:
        said += (
            f"; {100 * prediction.band.inside:.1f} % inside the 95 % band of {prediction.band.half_width_n:.3g} N"
        )
    _say(out, prediction.rmse_n, prediction.nrmse, prediction.noise_floor_n, said)
    return None


def _is_log(name: str) -> bool:
    """Whether a name stands for a recording; any other file, and no file, is a method to plan."""
    return name.endswith(".mcap") or (Path(name).is_file() and Path(name).suffix not in (".json", ".npz"))


def _forecast(model: Path, method: str, out: Path, series: Path | None, free: str) -> None:
    """Predict strokes that are only planned."""
    from identification.document_file import place_in_words, write_document
    from identification.errors import IdentificationError
    from identification.forecast import forecast, planned_strokes
    from identification.results import read_fit
    from identification.series import write_series

    if free:
        raise IdentificationError(f"--free {free}: nothing is recorded of {method} yet that could tell it")
    document, found = forecast(read_fit(model), planned_strokes(method))
    if series is not None:
        write_series(series, found)
    write_document(out, document)
    more = f"; {document.band.note}" if document.band.note else ""
    typer.echo(
        f"{place_in_words(out)}: force up to {document.largest_force_n:.4g} N, 95 % of the samples within "
        f"{document.band.half_width_n:.3g} N of it{more}",
        err=True,
    )


def _own(free: str) -> tuple[str, ...]:
    """What each further log shall have of its own; the gauge, and what all logs share, are refused."""
    from identification.condition import OWN
    from identification.errors import IdentificationError
    from identification.uncertainty import GAUGE_WORDS

    names = _words(free)
    if "A" in names:
        raise IdentificationError(f"--free A: A is {GAUGE_WORDS}; it stays as it is")
    if unknown := set(names) - set(OWN):
        raise IdentificationError(
            f"--free {', '.join(sorted(unknown))}: every parameter is free already, and all logs share it; each "
            f"further log can have an {' or a '.join(OWN)} of its own"
        )
    return names


def _words(text: str) -> tuple[str, ...]:
    return tuple(word for word in text.split(",") if word)


def _say(out: Path, error: float, relative: float, floor: float, more: str) -> None:
    """One line of result for a person, on standard error: force error and noise floor [N]."""
    from identification.document_file import place_in_words

    share = f"{100 * relative:.2g} % of the force's deviation"
    typer.echo(
        f"{place_in_words(out)}: force error {error:.3g} N ({share}), noise floor {floor:.3g} N; {more}", err=True
    )
