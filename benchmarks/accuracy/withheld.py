"""Diagnoses of recordings whose effects are withheld, imported by `mrbench import` and diagnosed in one process.

    python -m benchmarks.accuracy.withheld [--recordings blind2] [--jobs 2] [--keep FOLDER] [--only case00,case01]

`MRBENCH_SHARED` names the folder with `blind/caseNN.csv.gz` and `blind2/caseNN.csv.gz`. The results are
`docs/evidence/blind-predictions.json` (case -> diagnosis) and `docs/evidence/blind.md`, with the name of the
recordings. `--keep FOLDER` keeps logs, diagnoses and twins, and continues an interrupted call.
"""

import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.common import make_parser, open_folder, run_mrbench, select_names, time_call
from identification.documents import write_document
from identification.gap import diagnose
from identification.gap.outcome import summarise_diagnosis
from identification.logs import load

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
_HEAD = """# Recordings with withheld effects: {folder}

{count} recordings, each with one effect or several, none, or a cause outside the library. The true effects were
unknown when the diagnoses in `{folder}-predictions.json` were made. Errors are on held-out strokes; "after" and
shrinkage are the values expected of another run. Command:

```
{command}
```

| case | verdict | effects (probability of each) | unknown | before N | after N | floor N | shrinkage | CPU s |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
"""


def diagnose_recording(source: Path, kept: Path) -> dict[str, Any]:
    """Return the diagnosis of one recording; diagnose it if no result is stored."""
    name = source.name.removesuffix(".csv.gz")
    out = kept / f"{name}.json"
    if not out.exists():
        log = kept / f"{name}.mcap"
        if not log.exists():
            run_mrbench("import", source, "--out", log)
        found, seconds = time_call(lambda: diagnose([load(log)]))
        write_document(kept / f"{name}.twin.json", found.twin)
        write_document(out, found.diagnosis)
        (kept / f"{name}.seconds").write_text(f"{seconds:.1f}", encoding="utf-8")
        print(f"{name}: {summarise_diagnosis(found.diagnosis)}", flush=True)
    document: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return document


def render_row(name: str, diagnosis: dict[str, Any], seconds: str) -> str:
    """Return one line of the table."""
    gap = diagnosis["gap"]
    effects = ", ".join(f"{e['name']} ({e['probability']:.2f})" for e in diagnosis["effects"]) or "–"
    shrinkage = "–" if gap["shrinkage"] is None else f"{gap['shrinkage']:.3f}"
    figures = [f"{gap[key]:.3g}" for key in ("before_n", "after_n", "noise_floor_n")]
    cells = [name, diagnosis["verdict"], effects, f"{diagnosis['unknown_probability']:.2f}", *figures, shrinkage]
    return f"| {' | '.join([*cells, seconds])} |"


def main() -> None:
    """Diagnose every case and write the evidence."""
    parser = make_parser(__doc__, "logs, diagnoses and twins")
    parser.add_argument("--recordings", choices=("blind", "blind2"), default="blind", help="folder of the cases")
    parser.add_argument("--jobs", type=int, default=1, help="cases that are diagnosed at the same time")
    asked = parser.parse_args()
    shared = Path(os.environ.get("MRBENCH_SHARED", "."))
    sources = {s.name.removesuffix(".csv.gz"): s for s in sorted(shared.glob(f"{asked.recordings}/case*.csv.gz"))}
    if not sources:
        sys.exit(
            f"MRBENCH_SHARED: not a folder with {asked.recordings}/caseNN.csv.gz; "
            "set it to the folder of the recordings"
        )
    names = select_names(asked.only, list(sources))
    with open_folder(asked.keep) as kept, ProcessPoolExecutor(asked.jobs) as pool:
        results = pool.map(partial(diagnose_recording, kept=kept), [sources[name] for name in names])
        found = dict(zip(names, results, strict=True))
        seconds = {name: (kept / f"{name}.seconds").read_text(encoding="utf-8") for name in found}
    if len(found) == len(sources):
        _write_evidence(asked.recordings, found, seconds)


def _write_evidence(folder: str, found: dict[str, dict[str, Any]], seconds: dict[str, str]) -> None:
    EVIDENCE.mkdir(parents=True, exist_ok=True)
    text = json.dumps(found, separators=(",", ":"), ensure_ascii=False)
    (EVIDENCE / f"{folder}-predictions.json").write_text(text + "\n", encoding="utf-8")
    command = f"MRBENCH_SHARED=... python -m benchmarks.accuracy.withheld --recordings {folder}"
    rows = [render_row(name, diagnosis, seconds[name]) for name, diagnosis in found.items()]
    page = _HEAD.format(count=len(found), folder=folder, command=command) + "\n".join(rows) + "\n"
    (EVIDENCE / f"{folder}.md").write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
