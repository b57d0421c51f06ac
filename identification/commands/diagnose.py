"""`mrbench diagnose` and `mrbench trend`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from identification.documents import Diagnosis
    from identification.gap.outcome import DiagnosisResult

Seed = Annotated[int, typer.Option(help="Seed of all random numbers.")]
Out = Annotated[Path, typer.Option("--out", help="Document to write; `-` prints it.")]


def diagnose(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG...", help="Logs of one specimen, recorded or imported.")
    ],
    out: Out,
    model: Annotated[
        Path | None,
        typer.Option(metavar="FIT|TWIN|SCENARIO", help="A simulation of this damper whose gap is reported too."),
    ] = None,
    twin: Annotated[
        Path | None, typer.Option(help="Scenario to write: the damper with the effects that were found.")
    ] = None,
    cross_check: Annotated[
        bool,
        typer.Option(
            "--cross-check",
            help="Also estimate the named effects with a network that has them in its residual, and compare.",
        ),
    ] = False,
    hold_out: Annotated[
        str,
        typer.Option(
            metavar="PATTERN,...",
            help="Stretches or segments that no fit and no choice reads, such as `5mm_4Hz*`; the error on them is "
            "reported.",
        ),
    ] = "",
    hold_out_after: Annotated[
        float | None,
        typer.Option(min=0.05, max=0.95, help="Fraction of each stretch after which it is held out likewise."),
    ] = None,
    discover: Annotated[
        bool,
        typer.Option(
            "--discover",
            help="Also search for a cause outside the library, where known effects do not explain the gap.",
        ),
    ] = False,
    keep: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Search likewise, and write the cause as an effect file of this name for later diagnoses.",
        ),
    ] = None,
    residual: Annotated[
        bool,
        typer.Option(
            "--residual",
            help="Also learn the residual of law and effects; predictions with the twin add it, with both errors.",
        ),
    ] = False,
    each: Annotated[
        bool,
        typer.Option(
            "--each",
            help="Diagnose every log by itself and print one table: documents named as the log, in the folder "
            "`--out`, and twins in the folder `--twin`.",
        ),
    ] = False,
    witness: Annotated[bool, typer.Option("--witness", hidden=True, help="Former name of --cross-check.")] = False,
    seed: Seed = 1,
) -> None:
    """Find the effects that the simulation of a recording lacks.

    States where simulation and recording differ, which effects explain it, and how far they close the gap.
    """
    from identification.damper.definitions import check_new_name, load_effects
    from identification.documents import check_output_path, describe_output_path, write_document
    from identification.fitting import HoldOut, read_damper_model
    from identification.gap import diagnose as diagnose_recordings
    from identification.gap.outcome import summarise_diagnosis
    from identification.logs import load
    from identification.progress import show_progress

    library = load_effects()
    if keep is not None:
        check_new_name(keep)
    for path in (out, twin):
        if path is not None:
            check_output_path(path)
    simulation = None if model is None else read_damper_model(model)

    def diagnose_logs(logs: "Sequence[Path]") -> "DiagnosisResult":
        with show_progress("diagnose") as progress:
            return diagnose_recordings(
                [load(log) for log in logs],
                simulation,
                seed=seed,
                cross_check=cross_check or witness,
                hold_out=HoldOut.from_text(hold_out, hold_out_after),
                progress=progress,
                library=library,
                discover=discover or keep is not None,
                learn_residual=residual,
            )

    if each:
        _diagnose_each(logs, out, twin, keep, diagnose_logs)
        return
    result = diagnose_logs(logs)
    if keep is not None:
        result = result.rename_discovery(keep)
    write_document(out, result.diagnosis)
    if twin is not None:
        write_document(twin, result.twin)
    typer.echo(f"{describe_output_path(out)}: {summarise_diagnosis(result.diagnosis)}", err=True)
    if keep is not None:
        typer.echo(_keep_discovery(result.diagnosis, keep), err=True)


def _diagnose_each(
    logs: "Sequence[Path]",
    out: Path,
    twin: Path | None,
    keep: str | None,
    diagnose_logs: "Callable[[Sequence[Path]], DiagnosisResult]",
) -> None:
    """Diagnose every log by itself, print a table, and name the logs that cannot be diagnosed."""
    from identification.documents import write_document
    from identification.errors import IdentificationError
    from identification.gap.outcome import tabulate_diagnoses
    from identification.pipeline import make_output_paths

    if keep is not None:
        raise IdentificationError(f"--keep {keep}: several causes cannot have one name; diagnose that log alone")
    if "-" in (str(out), str(twin)):
        raise IdentificationError("--out and --twin: --each writes several documents; name folders instead of `-`")
    folders = [folder for folder in (out, twin) if folder is not None]
    paths = [make_output_paths(logs, folder) for folder in folders]
    for folder in folders:
        folder.mkdir(exist_ok=True)
    rows, failed = [], []
    for log, *targets in zip(logs, *paths, strict=True):
        try:
            result = diagnose_logs([log])
        except IdentificationError as error:
            failed.append(f"{log.name}: {error}")
            continue
        for target, document in zip(targets, (result.diagnosis, result.twin), strict=False):
            write_document(target, document)
        rows.append((log.stem, result.diagnosis))
    typer.echo(tabulate_diagnoses(rows))
    if failed:
        raise IdentificationError(f"{len(failed)} of {len(logs)} logs could not be diagnosed: {'; '.join(failed)}")


def _keep_discovery(diagnosis: "Diagnosis", name: str) -> str:
    """Write the discovered effect as an effect file, and return a line for a person."""
    from identification.damper.definitions import write_effect_file

    if diagnosis.discovery is None:
        return f"{name} was not written, because no cause outside the library was found"
    path = write_effect_file(diagnosis.discovery.definition)
    return f"{path}: written; diagnoses, twins and scenarios know {name} from now on"


def trend(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="Logs of one specimen, one per run, in the order of time."),
    ],
    out: Out,
    seed: Seed = 1,
) -> None:
    """Find quantities that change over the runs of one specimen.

    States by how much per run, and since which run.
    """
    from identification.documents import check_output_path, describe_output_path, write_document
    from identification.gap import analyse_trend
    from identification.logs import load
    from identification.progress import show_progress

    check_output_path(out)
    with show_progress("trend") as progress:
        document = analyse_trend([load(log) for log in logs], seed=seed, progress=progress)
    write_document(out, document)
    typer.echo(f"{describe_output_path(out)}: {document.explanation}", err=True)
