"""``mrbench replay``: a log back through the decoders that made it, and to a live view."""

from pathlib import Path
from typing import Annotated

import typer


def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A recording.")],
    speed: Annotated[
        str, typer.Option(help="Times as fast as recorded, for --publish; or max.", metavar="N|max")
    ] = "max",
    out: Annotated[
        str | None, typer.Option(metavar="FILE", help="Write what was found as JSON; - prints it.")
    ] = None,
    publish: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Address where live views hear the samples, such as tcp://127.0.0.1:5571."
        ),
    ] = None,
) -> None:
    """Check that the raw frames of a log still give its readings.

    They are decoded anew by the drivers, and compared bit for bit; exits with 1 where a reading differs. With
    --publish the samples are then played to live views.
    """
    from bench.recorder.reader import read_log
    from bench.replay.compare import replay_frames
    from bench.replay.play import parse_speed, play

    pace = parse_speed(speed)
    samples = len(read_log(log).samples["time"])
    found = replay_frames(log)
    typer.echo(f"{log}: {samples} bench samples", err=True)
    for one in found:
        typer.echo(str(one), err=True)
    if not found:
        typer.echo("the log holds no frames of wires: it was imported, or made without wires", err=True)
    equal = all(one.equal for one in found)
    if out is not None:
        instruments = [one._asdict() for one in found]
        _write(out, {"log": str(log), "samples": samples, "equal": equal, "instruments": instruments})
    if publish is not None:
        play(log, pace, publish)
    if not equal:
        raise typer.Exit(1)


def _write(out: str, document: dict[str, object]) -> None:
    import orjson

    from bench.recorder.replacement import replacing

    text = orjson.dumps(document, option=orjson.OPT_INDENT_2)
    if out == "-":
        typer.echo(text.decode())
        return
    with replacing(Path(out)) as beside:
        beside.write_bytes(text + b"\n")
