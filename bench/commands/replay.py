"""``mrbench replay``: check of the decoders against a log, and playback to live views."""

from pathlib import Path
from typing import Annotated

import typer


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log to replay.")],
    speed: Annotated[
        str,
        typer.Option(help="Speed of --publish as a multiple of real time, or max.", metavar="N|max"),
    ] = "max",
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
    """Check that decoding the raw frames of a log gives its recorded readings.

    The drivers decode the frames again, and the readings are compared bit for bit; exit 1 if one differs. With
    --publish the samples are then played to live views.
    """
    from bench.log import read_log
    from bench.replay import parse_speed, play_log, replay_frames

    pace = parse_speed(speed)
    samples = len(read_log(log).samples["time"])
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
        play_log(log, pace, publish, key)
    if not equal:
        raise typer.Exit(1)


def _write_document(out: str, document: dict[str, object]) -> None:
    import orjson

    from bench.log import write_atomically

    text = orjson.dumps(document, option=orjson.OPT_INDENT_2)
    if out == "-":
        typer.echo(text.decode())
        return
    with write_atomically(Path(out)) as partial:
        partial.write_bytes(text + b"\n")
