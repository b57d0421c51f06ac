"""Arguments of `mrbench campaign`, and the choice of the action."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class Action(StrEnum):
    """Actions on a campaign."""

    PLAN = "plan"
    RUN = "run"
    STATUS = "status"
    PAUSE = "pause"
    RESUME = "resume"
    STOP = "stop"
    EDIT = "edit"
    TEST_MESSAGE = "test-message"
    REPORT = "report"


def campaign(
    action: Annotated[
        Action,
        typer.Argument(
            help="plan: time, heat, disk, limits and identifiability. run: start or continue it. "
            "status, pause (at the next checkpoint), resume, stop (after the run in progress), "
            "edit (the queue), test-message (to all recipients), report (as .html or .pdf)."
        ),
    ],
    target: Annotated[
        str,
        typer.Argument(
            help="File of the campaign for plan and run, its file or id for test-message, else its id.",
            metavar="FILE|ID",
        ),
    ] = "",
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With run: on this bench.toml, by the service that uses --data."),
    ] = None,
    bench: Annotated[
        str, typer.Option(metavar="NAME", help="With run: on this bench of the service that uses --data.")
    ] = "",
    scenario: Annotated[
        str | None,
        typer.Option(metavar="NAME|FILE", help="With run: on the simulated plant, faster than real time."),
    ] = None,
    out: Annotated[
        str, typer.Option(metavar="FILE", help="- prints JSON; with report: file to write, .html or .pdf.")
    ] = "",
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder for logs and catalogue.")] = Path("runs"),
    operator: Annotated[str, typer.Option(metavar="NAME", help="Person, for the record.")] = "",
    quick: Annotated[
        bool, typer.Option("--quick", help="With plan: leave out what the strokes can identify.")
    ] = False,
    identify: Annotated[
        bool, typer.Option("--identify", help="With run --scenario: identify and diagnose every run.")
    ] = False,
    answer: Annotated[
        str | None, typer.Option(metavar="NOTE", help="With resume: answer the prompt with this note.")
    ] = None,
    photo: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With resume: photo that the prompt needs, JPEG or PNG."),
    ] = None,
    choice: Annotated[
        str | None, typer.Option(metavar="retry|skip|stop", help="With resume: decide on a failed step.")
    ] = None,
    edit: Annotated[
        str, typer.Option(metavar="JSON", help='With edit: such as {"edit": "delete", "item": "s0004"}.')
    ] = "",
    new: Annotated[
        bool, typer.Option("--new", help="With run: start again, also if the campaign is not finished.")
    ] = False,
) -> None:
    """Plan, run, control and report campaigns.

    A campaign is a list of runs with rests and conditions between them. One that was interrupted continues with
    the same command: no finished run is repeated.
    """
    as_json = out == "-"
    if action in (Action.PLAN, Action.RUN) and not target:
        raise typer.BadParameter("give the file of the campaign")
    if action is Action.REPORT and out in ("", "-"):
        raise typer.BadParameter("a report cannot be printed; give a file: --out report.html or report.pdf")
    if (action is Action.EDIT) != bool(edit):
        raise typer.BadParameter("edit needs --edit JSON, and no other action takes it")
    if photo is not None and action is not Action.RESUME:
        raise typer.BadParameter("--photo answers a prompt; use it with resume")
    if action is Action.PLAN:
        from bench.commands.campaign.plan import plan

        plan(Path(target), data, quick=quick, as_json=as_json)
    elif action is Action.RUN:
        if sum((scenario is not None, config is not None, bool(bench))) != 1:
            raise typer.BadParameter("give one of --config bench.toml, --bench NAME and --scenario NAME or FILE")
        _run(Path(target), config, bench, scenario, data, operator, identify=identify, is_new=new, as_json=as_json)
    elif action is Action.REPORT:
        from bench.commands.campaign.report import report

        report(target, data, out)
    elif action is Action.TEST_MESSAGE and (target.endswith(".json") or Path(target).is_file()):
        from bench.commands.campaign.control import send_test_of_file

        send_test_of_file(Path(target))
    else:
        from bench.commands.campaign.control import control

        control(
            action.value,
            target,
            data,
            operator,
            note=answer,
            choice=choice,
            edit=edit,
            as_json=as_json,
            photo=photo,
        )


def _run(
    path: Path,
    config: Path | None,
    bench: str,
    scenario: str | None,
    data: Path,
    operator: str,
    *,
    identify: bool,
    is_new: bool,
    as_json: bool,
) -> None:
    if scenario is None:
        from bench.commands.campaign.bench import run_on_bench

        run_on_bench(path, config, bench, data, operator, as_json=as_json)
    else:
        from bench.commands.campaign.run import run_on_plant

        run_on_plant(path, scenario, data, operator, identify=identify, is_new=is_new, as_json=as_json)
