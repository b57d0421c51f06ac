"""``mrbench replay``: check of the decoders against a log, and playback to live views."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bench.log import Log
    from bench.replay import Selection


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log to replay.")],
    speed: Annotated[
        str,
        typer.Option(help="Speed of --publish as a multiple of real time, or max.", metavar="N|max"),
    ] = "max",
    begin: Annotated[
        float, typer.Option("--from", metavar="S", min=0.0, help="First time that --publish plays [s].")
    ] = 0.0,
    end: Annotated[
        float | None, typer.Option("--to", metavar="S", min=0.0, help="Last time that --publish plays [s].")
    ] = None,
    segment: Annotated[
        str,
        typer.Option(metavar="PATTERN", help="Segments or stretches that --publish plays, such as 5mm_4Hz*."),
    ] = "",
    out: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write the results as JSON; - prints them.")
    ] = None,
    publish: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address at which the samples are published, such as tcp://127.0.0.1:5571."
        ),
    ] = None,
    key: Annotated[
        Path, typer.Option(metavar="FILE", help="Key of a TCP --publish, created unless it exists.")
    ] = Path("agent.key"),
) -> None:
    """Check the raw frames of a log, and play its samples.

    The drivers decode the frames, and the readings are compared bit for bit; exit 1 if one differs. With
    --publish the samples are then played to live views. --from, --to and --segment choose them.
    """
    from bench.log import read_log
    from bench.replay import Selection, parse_speed, replay_frames

    pace = parse_speed(speed)
    recorded = read_log(log)
    samples = len(recorded.samples["time"])
    selection = Selection(begin, float("inf") if end is None else end, segment)
    selection.find_parts(recorded)  # refused before the frames are decoded
    results = replay_frames(log)
    typer.echo(f"{log}: {samples} bench samples", err=True)
    for result in results:
        typer.echo(str(result), err=True)
    if not results:
        typer.echo("the log contains no raw frames: it was imported, or recorded without wires", err=True)
    equal = all(result.is_equal for result in results)
    if out is not None:
        instruments = [result._asdict() for result in results]
        _write_document(out, {"log": str(log), "samples": samples, "equal": equal, "instruments": instruments})
    if publish is not None:
        _play(recorded, selection, pace, publish, key)
    if not equal:
        raise typer.Exit(1)


def _play(log: "Log", selection: "Selection", speed: float, address: str, key: Path) -> None:
    from bench.agent_protocol import Publisher
    from bench.replay import play_log

    with Publisher(address, key) as publisher:
        count = play_log(log, selection, speed, publisher.publish)
    typer.echo(f"{count} samples played from /bench/sample", err=True)


def _write_document(out: str, document: dict[str, object]) -> None:
    import orjson

    from bench.log import write_atomically

    text = orjson.dumps(document, option=orjson.OPT_INDENT_2)
    if out == "-":
        typer.echo(text.decode())
        return
    with write_atomically(Path(out)) as partial:
        partial.write_bytes(text + b"\n")
