"""`mrbench identify` and `mrbench predict`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from identification.documents import Fit
    from identification.pipeline import FitRequest

Logs = Annotated[
    list[Path],
    typer.Argument(metavar="LOG...", help="Logs of one specimen, recorded or imported; see `--each`."),
]
Out = Annotated[Path, typer.Option("--out", help="Document to write; `-` prints it.")]
_MAX_NOTES = 8
"""Largest number of notes that are printed; the document contains all."""


def identify(
    logs: Logs,
    out: Out,
    stages: Annotated[
        str,
        typer.Option(
            help="Stages of the fit, separated by commas: `pinn` trains a network, `refine` fits the simulated "
            "force."
        ),
    ] = "pinn,refine",
    preset: Annotated[
        str,
        typer.Option(help="The network: `elements`, `tuned`, `dense`, `paper`, or a settings file."),
    ] = "elements",
    hold_out: Annotated[
        str,
        typer.Option(metavar="PATTERN,...", help="Stretches or segments to hold out, such as `5mm_4Hz*`."),
    ] = "",
    hold_out_after: Annotated[
        float | None, typer.Option(min=0.05, max=0.95, help="Fraction of each stretch after which it is held out.")
    ] = None,
    delay_prior: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS",
            min=0.0,
            help="Standard deviation of the channel delays, which are limited to three times this value; 0 takes "
            "the reported delays. By default from the log's clocks, without a limit.",
        ),
    ] = None,
    budget: Annotated[
        str,
        typer.Option(
            metavar="STEPS|SECONDSs",
            help="Limit on the effort: steps of each stage such as `500`, or processor time of all such as `60s`, "
            "which makes the result depend on the machine.",
        ),
    ] = "",
    seed: Annotated[int, typer.Option(help="Seed of all random numbers.")] = 1,
    free: Annotated[
        str,
        typer.Option(
            metavar="NAME,...", help="Parameters that each further log has individually: `offset`, `viscosity`."
        ),
    ] = "",
    profile: Annotated[
        bool,
        typer.Option(
            "--profile", help="Also compute intervals by profile likelihood; takes several times as long."
        ),
    ] = False,
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Treat every log as another specimen: one document each, named as the log, in the folder "
            "`--out`. On an accelerator the network `dense` is trained on many of them at once.",
        ),
    ] = False,
) -> None:
    """Estimate the damper's parameters from recordings.

    Each has an interval, and a note where these strokes do not determine it.
    """
    # Imported inside the command, as in all commands: `--help` must not wait for numba and scipy (decision 0006).
    from identification.documents import check_output_path, write_document
    from identification.errors import IdentificationError
    from identification.fitting import Budget, HoldOut, OptimiserSettings
    from identification.logs import load
    from identification.pipeline import FitRequest
    from identification.pipeline import identify as identify_damper
    from identification.progress import show_progress

    names = _split_names(stages)
    if unknown := set(names) - {"pinn", "refine"}:
        raise IdentificationError(f"unknown stage {', '.join(sorted(unknown))}; the stages are pinn and refine")
    if not names:
        raise IdentificationError("--stages is empty; the stages are pinn and refine")
    request = FitRequest(
        HoldOut.from_text(hold_out, hold_out_after),
        delay_prior,
        OptimiserSettings(seed=seed, budget=Budget.from_text(budget)),
        names,
        preset,
        _parse_free(free),
        profile,
    )
    if each:
        _identify_batch(logs, out, request)
        return
    check_output_path(out)
    with show_progress("identify") as progress:
        fit = identify_damper([load(log) for log in logs], request, progress)
    write_document(out, fit)
    report_fit(out, fit)


def _identify_batch(logs: "Sequence[Path]", folder: Path, request: "FitRequest") -> None:
    """Fit every log separately, and name those that cannot be fitted."""
    from identification.documents import check_output_path, write_document
    from identification.errors import IdentificationError
    from identification.pipeline import identify_batch, make_output_paths
    from identification.progress import show_progress

    if request.per_log:
        raise IdentificationError(
            "--free is for several logs of one specimen, --each for one log of each specimen; give one of the two"
        )
    if str(folder) == "-":
        raise IdentificationError("--out -: --each writes several documents; name a folder")
    check_output_path(folder)
    paths = dict(zip(logs, make_output_paths(logs, folder), strict=True))
    folder.mkdir(exist_ok=True)
    failed: list[str] = []
    with show_progress("identify") as progress:
        for entry in identify_batch(logs, request, progress):
            if entry.fit is None:
                failed.append(f"{entry.log.name}: {entry.failure}")
            else:
                write_document(paths[entry.log], entry.fit)
                report_fit(paths[entry.log], entry.fit)
    if failed:
        raise IdentificationError(f"{len(failed)} of {len(logs)} logs could not be fitted: {'; '.join(failed)}")


def report_fit(out: Path, fit: "Fit") -> None:
    """Print the result of a fit and its notes, one line each, on standard error."""
    result = "; ".join(text for text in (fit.result, fit.agreement) if text)
    _report(out, fit.rmse_n.train, fit.nrmse.train, fit.noise_floor_n, result)
    for note in fit.notes[:_MAX_NOTES]:
        typer.echo(f"  note: {note}", err=True)
    if len(fit.notes) > _MAX_NOTES:
        typer.echo(f"  and {len(fit.notes) - _MAX_NOTES} more notes: see `notes` in the document", err=True)


def predict(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="Fit, twin or scenario.")],
    log: Annotated[
        str,
        typer.Argument(
            metavar="LOG",
            help="Log that was not fitted, or a method or file of planned strokes (.npz) without any log.",
        ),
    ],
    out: Out,
    series: Annotated[
        Path | None,
        typer.Option(help="Series to write: recorded and simulated force with its 95 % band, as .npz or .csv."),
    ] = None,
    free: Annotated[
        str, typer.Option(metavar="offset", help="Further quantity to estimate on this log: `offset`.")
    ] = "",
) -> None:
    """Simulate a fit or twin on a log or on planned strokes.

    Only the inner displacement at the start of each stretch is estimated.
    """
    from identification.documents import check_output_path, write_document, write_force_series
    from identification.errors import IdentificationError
    from identification.fitting import read_fit_or_model
    from identification.logs import load
    from identification.predict import predict_log

    if free not in ("", "offset"):
        raise IdentificationError(f"--free {free}: only a force offset can be estimated; give `--free offset`")
    check_output_path(out)
    if not _is_recording(log):
        return _forecast(model, log, out, series, free)
    prediction, force_series = predict_log(read_fit_or_model(model), load(Path(log)), free_offset=free == "offset")
    if series is not None:
        write_force_series(series, force_series)
    write_document(out, prediction)
    result = f"freed: {', '.join(prediction.freed)}"
    if prediction.band is not None and prediction.band.coverage is not None:
        result += (
            f"; {100 * prediction.band.coverage:.1f} % inside the 95 % band of "
            f"{prediction.band.half_width_n:.3g} N"
        )
    if prediction.physics is not None:
        result += f"; without the learned residual {prediction.physics.rmse_n:.3g} N"
    _report(out, prediction.rmse_n, prediction.nrmse, prediction.noise_floor_n, result)
    return None


def _is_recording(name: str) -> bool:
    """Return whether a name is that of a log; all others are planned strokes."""
    return name.endswith(".mcap") or (Path(name).is_file() and Path(name).suffix not in (".json", ".npz"))


def _forecast(model: Path, planned: str, out: Path, series: Path | None, free: str) -> None:
    """Predict the force of planned strokes."""
    from identification.documents import describe_output_path, read_fit, write_document, write_force_series
    from identification.errors import IdentificationError
    from identification.experiment_design import read_planned_strokes
    from identification.predict import forecast_force

    if not planned.endswith(".npz"):
        raise IdentificationError(
            f"{planned}: neither a log nor a file of planned strokes; write that file with "
            "`mrbench run METHOD --dry-run --planned FILE.npz`, then `mrbench predict MODEL FILE.npz`"
        )
    strokes = read_planned_strokes(Path(planned))
    if free:
        raise IdentificationError(
            f"--free {free}: {strokes.method} is not recorded yet; give a log to estimate it on"
        )
    document, force_series = forecast_force(read_fit(model), strokes)
    if series is not None:
        write_force_series(series, force_series)
    write_document(out, document)
    note = f"; {document.band.note}" if document.band.note else ""
    typer.echo(
        f"{describe_output_path(out)}: force up to {document.largest_force_n:.4g} N, 95 % of the samples within "
        f"{document.band.half_width_n:.3g} N of it{note}",
        err=True,
    )


def _parse_free(free: str) -> tuple[str, ...]:
    """Return the per-log parameters; the gauge and shared parameters are refused."""
    from identification.errors import IdentificationError
    from identification.fitting import PER_LOG_PARAMETERS
    from identification.uncertainty import GAUGE_NOTE

    names = _split_names(free)
    if "A" in names:
        raise IdentificationError(f"--free A: A is {GAUGE_NOTE}; leave it out")
    if unknown := set(names) - set(PER_LOG_PARAMETERS):
        raise IdentificationError(
            f"--free {', '.join(sorted(unknown))}: every parameter of the damper is free already and shared by "
            f"all logs; parameters per log are {' and '.join(PER_LOG_PARAMETERS)}"
        )
    return names


def _split_names(text: str) -> tuple[str, ...]:
    return tuple(name for name in text.split(",") if name)


def _report(out: Path, rmse: float, nrmse: float, floor: float, result: str) -> None:
    """Print force error and noise floor [N] with a result, one line on standard error."""
    from identification.documents import describe_output_path

    share = f"{100 * nrmse:.2g} % of the force's deviation"
    typer.echo(
        f"{describe_output_path(out)}: force error {rmse:.3g} N ({share}), noise floor {floor:.3g} N; {result}",
        err=True,
    )
