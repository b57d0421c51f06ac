"""``mrbench audit``: verification and export of the audit trail, also without a service."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bench.audit import Head


class Action(StrEnum):
    """Actions on an audit trail."""

    VERIFY = "verify"
    HEAD = "head"
    EXPORT = "export"


def audit(
    action: Annotated[
        Action,
        typer.Argument(
            help="verify: check every hash. head: print number and hash of the last entry, to be kept elsewhere. "
            "export: write all entries with the head."
        ),
    ],
    data: Annotated[Path, typer.Option(metavar="DIR", help="Data folder of the service.")] = Path("runs"),
    head: Annotated[
        str, typer.Option(metavar="FILE|SEQ:SHA", help="With verify: head that was kept; finds a missing end.")
    ] = "",
    config: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="With verify: also the own trail of the rig agent of this bench.toml."),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            help="With verify: report whose signatures are listed; exits with status 1 if it has none.",
        ),
    ] = None,
    out: Annotated[
        str, typer.Option(metavar="FILE", help="With export: file to write, .json or .csv; - prints JSON.")
    ] = "",
) -> None:
    """Verify or export the record of who did what.

    The service may run meanwhile. Exits with status 1 if an entry was changed, inserted, removed or exchanged, and
    names the first one.
    """
    if (action is Action.EXPORT) != bool(out):
        raise typer.BadParameter("export needs --out FILE, and no other action takes it")
    if action is not Action.VERIFY and (head or config or report):
        raise typer.BadParameter("--head, --config and --report belong to verify")
    from bench.audit import AUDIT_FILE, AuditChain

    path = data / AUDIT_FILE
    if action is Action.VERIFY:
        _verify(path, head, config)
        if report is not None:
            _list_signatures(path, report)
    elif action is Action.HEAD:
        typer.echo(str(AuditChain(path).get_head()))
    else:
        _export(path, out)


def _verify(path: Path, head: str, config: Path | None) -> None:
    from bench.audit import compare_imports, find_agent_trail, verify_chain
    from bench.errors import AuditError

    result = verify_chain(path, _read_head(head) if head else None)
    fault, place = result.fault, path
    if not fault and config is not None:
        place = find_agent_trail(config)
        own = verify_chain(place)
        fault = own.fault or compare_imports(result, place)
        typer.echo(f"{place}: {own.entries} entries, head {own.head}")
    typer.echo(f"{path}: {result.entries} entries, head {result.head}, {len(result.imported)} of the rig agent")
    if result.kept:
        typer.echo(f"{result.kept} incomplete lines of killed processes are kept in entries of their own")
    if fault:
        raise AuditError(f"{place}: the audit trail was altered: {fault}; compare it with a backup or an export")
    typer.echo("nothing was altered" + ("" if head else "; a missing end is found only with --head"))


def _list_signatures(path: Path, report: Path) -> None:
    """Print who has signed a file, from a trail that was verified."""
    from bench.audit import find_signatures
    from bench.catalogue import compute_sha256
    from bench.errors import AuditError

    sha256 = compute_sha256(report)
    found = find_signatures(path, sha256)
    if not found:
        raise AuditError(
            f"{report}: nobody has signed this file (SHA-256 {sha256}); give the file that was signed, not a "
            "report that was made again"
        )
    for entry in found:
        values = entry.new
        person = f"{values['full_name']} ({entry.actor}, {values['role']})"
        typer.echo(f"signed as {values['meaning']} by {person} at {entry.utc}, entry {entry.seq}")
    typer.echo(f"{report}: SHA-256 {sha256}, report on {found[-1].new['report']} {found[-1].target}")


def _read_head(text: str) -> "Head":
    from bench.audit import parse_head

    path = Path(text)
    return parse_head(path.read_text("utf-8") if path.is_file() else text)


def _export(path: Path, out: str) -> None:
    from bench.audit import EXPORT_FORMATS, AuditChain, export_entries
    from bench.log import write_atomically

    head = AuditChain(path).get_head()
    if out == "-":
        typer.echo("".join(export_entries(path, head, "json")), nl=False)
        return
    form = next((one for one in EXPORT_FORMATS if Path(out).suffix.lower() == f".{one}"), None)
    if form is None:
        raise typer.BadParameter(f"--out {out} does not end with one of .{', .'.join(EXPORT_FORMATS)}")
    with write_atomically(Path(out)) as partial, partial.open("w", encoding="utf-8") as file:
        file.writelines(export_entries(path, head, form))
    typer.echo(f"{out}: {head.seq} entries, head {head}", err=True)
