"""How long a diagnosis takes: a two-minute log at 1 kHz with each effect, and with none.

Processor time of one process, machine code warm, and its ratio to one fit of the plain law to the same log.
``--keep FOLDER`` keeps logs and figures and takes up where an earlier call stopped; ``--only gas_spring,nothing``
takes some.
"""

import argparse
from pathlib import Path
from typing import Any

from benchmarks.effect_logs import NOTHING, USUAL, record, stretched
from benchmarks.kept import chosen, figures, folder, options
from benchmarks.timing import timed
from identification.assemble import HoldOut
from identification.gap.diagnose import diagnose
from identification.identify import Request, identify
from identification.recordings import Recording, load

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
_TIMES = 6
"""[1] by which the strokes of `quick` are longer here: some two minutes with its rests."""
_BARS = {NOTHING: 3.0}
_BAR = 30.0
"""[s] of one core that a diagnosis may take: of nothing, and of an effect."""
_PAGE = """# How long a diagnosis takes

Two minutes at 1 kHz (`quick`, six times as long), processor seconds of one process on a machine that others used,
machine code warm; asked for are {bar:g} s, and {none:g} s where there is nothing. Made by

```
python -m benchmarks.diagnosis --keep FOLDER --page
```

| effect | diagnosis, CPU s | one fit, CPU s | ratio | within the bar | verdict | named |
| --- | ---: | ---: | ---: | --- | --- | --- |
{rows}

{within} of {count} within the bar{missing}.
"""


def measured(effect: str, kept: Path) -> dict[str, Any]:
    """The figures of one effect, measured once."""
    found: dict[str, Any] = figures(kept / f"{effect}.json", lambda: _measured(effect, kept))
    return found


def _measured(effect: str, kept: Path) -> dict[str, Any]:
    log = kept / f"{effect}.mcap"
    record(stretched("quick", _TIMES), effect, 1.0, 1, log)
    recording = load(log)
    answer, seconds = timed(lambda: diagnose([recording]).diagnosis)
    named = [e.name for e in answer.effects]
    return {"seconds": seconds, "fit": _fit(recording), "verdict": answer.verdict, "named": named}


def _fit(recording: Recording) -> float:
    return timed(lambda: identify([recording], Request(HoldOut())))[1]


def _within(effect: str, found: dict[str, Any]) -> bool:
    return float(found["seconds"]) <= _BARS.get(effect, _BAR)


def _row(effect: str, found: dict[str, Any]) -> str:
    within = "yes" if _within(effect, found) else "no"
    cells = [effect, f"{found['seconds']:.1f}", f"{found['fit']:.1f}", f"{found['seconds'] / found['fit']:.1f}"]
    return f"| {' | '.join([*cells, within, found['verdict'], ', '.join(found['named']) or '–'])} |"


def page(found: dict[str, dict[str, Any]]) -> str:
    """The page of what has been measured."""
    missing = [name for name in (NOTHING, *USUAL) if name not in found]
    return _PAGE.format(
        bar=_BAR,
        none=_BARS[NOTHING],
        rows="\n".join(_row(effect, one) for effect, one in found.items()),
        within=sum(_within(effect, one) for effect, one in found.items()),
        count=len(found),
        missing=f"; not measured: {', '.join(missing)}" if missing else "",
    )


def main() -> None:
    """Measure, print the table, and write the page if asked."""
    asked = _options().parse_args()
    found = {}
    with folder(asked.keep) as kept:
        _warm(kept)
        for effect in chosen(asked.only, (NOTHING, *USUAL)):
            found[effect] = measured(effect, kept)
            print(_row(effect, found[effect]), flush=True)
    if asked.page:
        (EVIDENCE / "speed-of-diagnosis.md").write_text(page(found), encoding="utf-8")


def _options() -> argparse.ArgumentParser:
    made = options(__doc__, "logs and figures")
    made.add_argument("--page", action="store_true", help="write the page")
    return made


def _warm(kept: Path) -> None:
    """Compile everything on a short log with a play, which needs the most."""
    log = kept / "warm.mcap"
    record(stretched("quick", 1), "fixture_compliance", 1.0, 2, log)
    diagnose([load(log)])
    _fit(load(log))


if __name__ == "__main__":
    main()
