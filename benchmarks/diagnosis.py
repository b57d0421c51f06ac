"""How long a diagnosis takes: a two-minute log at 1 kHz with each effect, and with none.

Processor time of one process, machine code warm, and its ratio to one fit of the plain law to the same log.
``--keep FOLDER`` keeps logs and figures and takes up where an earlier call stopped; ``--only gas_spring,nothing``
takes some.
"""

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.effect_logs import NOTHING, USUAL, record, stretched
from benchmarks.timing import cpu_seconds
from identification.assemble import HoldOut
from identification.gap.diagnose import diagnose
from identification.identify import Request, identify
from identification.recordings import Recording, load

_TIMES = 6
"""[1] by which the strokes of `quick` are longer here: some two minutes with its rests."""
_BARS = {NOTHING: 3.0}
_BAR = 30.0
"""[s] of one core that a diagnosis may take: of nothing, and of an effect."""


def measured(effect: str, folder: Path) -> dict[str, Any]:
    """The figures of one effect, measured once."""
    out = folder / f"{effect}.json"
    if not out.exists():
        log = folder / f"{effect}.mcap"
        record(stretched("quick", _TIMES), effect, 1.0, 1, log)
        recording = load(log)
        answer: list[Any] = []
        seconds = cpu_seconds(lambda: answer.append(diagnose([recording]).diagnosis), 1)
        found = answer[0]
        named = [e.name for e in found.effects]
        figures = {"seconds": seconds, "fit": _fit(recording), "verdict": found.verdict, "named": named}
        out.write_text(json.dumps(figures), encoding="utf-8")
    figures_: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return figures_


def _fit(recording: Recording) -> float:
    return cpu_seconds(lambda: identify([recording], Request(HoldOut())), 1)


def _row(effect: str, found: dict[str, Any]) -> str:
    within = "yes" if found["seconds"] <= _BARS.get(effect, _BAR) else "no"
    cells = [effect, f"{found['seconds']:.1f}", f"{found['fit']:.1f}", f"{found['seconds'] / found['fit']:.1f}"]
    return f"| {' | '.join([*cells, within, found['verdict'], ', '.join(found['named']) or '–'])} |"


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--only", default="", help="effects by comma")
    options.add_argument("--keep", type=Path, default=None, help="folder for logs and figures")
    asked = options.parse_args()
    effects = [name for name in asked.only.split(",") if name] or [NOTHING, *USUAL]
    print("| effect | diagnosis, CPU s | one fit, CPU s | ratio | within the bar | verdict | named |")
    print("| --- | ---: | ---: | ---: | --- | --- | --- |")
    with TemporaryDirectory() as scratch:
        folder = asked.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        _warm(folder)
        for effect in effects:
            print(_row(effect, measured(effect, folder)), flush=True)


def _warm(folder: Path) -> None:
    """Compile everything on a short log with a play, which needs the most."""
    log = folder / "warm.mcap"
    record(stretched("quick", 1), "fixture_compliance", 1.0, 2, log)
    diagnose([load(log)])
    _fit(load(log))


if __name__ == "__main__":
    main()
