"""Speed of a diagnosis: processor time for a two-minute log at 1 kHz, with each effect and without effects.

The time is that of one process with compiled code, and its ratio to one fit of the law to the same log.
``--keep FOLDER`` keeps logs and results and continues an interrupted call; ``--only gas_spring,nothing`` selects
cases.
"""

import argparse
from pathlib import Path
from typing import Any

from benchmarks.common import (
    COMMON_EFFECTS,
    NO_EFFECT,
    lengthen_method,
    load_results,
    make_parser,
    open_folder,
    record_effect,
    select_names,
    time_call,
)
from identification.fitting import HoldOut
from identification.gap import diagnose
from identification.logs import Recording, load
from identification.pipeline import FitRequest, identify

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
_LENGTHENING = 6
"""Factor on the cycles of `quick` [1], which give about two minutes with its rests."""
_TIME_LIMITS = {NO_EFFECT: 3.0}
"""Time limit of a diagnosis for cases that differ from `_TIME_LIMIT` [s]."""
_TIME_LIMIT = 30.0
"""Time limit of a diagnosis with an effect [s]."""
_PAGE = """# Speed of a diagnosis

Two minutes at 1 kHz (`quick`, six times as long). Times are processor seconds of one process on a shared machine,
with compiled code. The requirement is {limit:g} s, and {none:g} s without an effect. Command:

```
python -m benchmarks.speed.diagnosis --keep FOLDER --page
```

| effect | diagnosis, CPU s | one fit, CPU s | ratio | within limit | verdict | named effects |
| --- | ---: | ---: | ---: | --- | --- | --- |
{rows}

{within} of {count} within the limit{missing}.
"""


def load_measurement(effect: str, kept: Path) -> dict[str, Any]:
    """Return the measurement of one effect; measure it if it is not stored."""
    found: dict[str, Any] = load_results(kept / f"{effect}.json", lambda: _measure_effect(effect, kept))
    return found


def _measure_effect(effect: str, kept: Path) -> dict[str, Any]:
    log = kept / f"{effect}.mcap"
    record_effect(lengthen_method("quick", _LENGTHENING), effect, 1.0, 1, log)
    recording = load(log)
    diagnosis, seconds = time_call(lambda: diagnose([recording]).diagnosis)
    named = [e.name for e in diagnosis.effects]
    return {"seconds": seconds, "fit": _time_fit(recording), "verdict": diagnosis.verdict, "named": named}


def _time_fit(recording: Recording) -> float:
    return time_call(lambda: identify([recording], FitRequest(HoldOut())))[1]


def _is_within_limit(effect: str, found: dict[str, Any]) -> bool:
    return float(found["seconds"]) <= _TIME_LIMITS.get(effect, _TIME_LIMIT)


def _render_row(effect: str, found: dict[str, Any]) -> str:
    within = "yes" if _is_within_limit(effect, found) else "no"
    cells = [effect, f"{found['seconds']:.1f}", f"{found['fit']:.1f}", f"{found['seconds'] / found['fit']:.1f}"]
    return f"| {' | '.join([*cells, within, found['verdict'], ', '.join(found['named']) or '–'])} |"


def render_page(found: dict[str, dict[str, Any]]) -> str:
    """Return the page of all measurements."""
    missing = [name for name in (NO_EFFECT, *COMMON_EFFECTS) if name not in found]
    return _PAGE.format(
        limit=_TIME_LIMIT,
        none=_TIME_LIMITS[NO_EFFECT],
        rows="\n".join(_render_row(effect, one) for effect, one in found.items()),
        within=sum(_is_within_limit(effect, one) for effect, one in found.items()),
        count=len(found),
        missing=f"; not measured: {', '.join(missing)}" if missing else "",
    )


def main() -> None:
    """Measure, print the table, and write the page on request."""
    asked = _make_parser().parse_args()
    found = {}
    with open_folder(asked.keep) as kept:
        _warm_up(kept)
        for effect in select_names(asked.only, (NO_EFFECT, *COMMON_EFFECTS)):
            found[effect] = load_measurement(effect, kept)
            print(_render_row(effect, found[effect]), flush=True)
    if asked.page:
        (EVIDENCE / "speed-of-diagnosis.md").write_text(render_page(found), encoding="utf-8")


def _make_parser() -> argparse.ArgumentParser:
    parser = make_parser(__doc__, "logs and results")
    parser.add_argument("--page", action="store_true", help="write the page")
    return parser


def _warm_up(kept: Path) -> None:
    """Compile all functions on a short log with a compliant mount, which uses most of them."""
    log = kept / "warm.mcap"
    record_effect(lengthen_method("quick", 1), "fixture_compliance", 1.0, 2, log)
    diagnose([load(log)])
    _time_fit(load(log))


if __name__ == "__main__":
    main()
