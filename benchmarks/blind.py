"""Recordings whose effect is withheld: `mrbench import`, then what `mrbench diagnose` does, in one process.

`MRBENCH_SHARED` names the folder that holds `blind/caseNN.csv.gz`. Writes `docs/evidence/blind-predictions.json`
(case -> diagnosis) and `docs/evidence/blind.md`. `--only case00,case01` takes some, `--keep FOLDER` keeps logs,
diagnoses and twins there and takes up where an earlier call stopped.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from identification.document_file import write_document
from identification.gap.diagnose import diagnose
from identification.gap.words import summary
from identification.recordings import load

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
_HEAD = """# Recordings whose effect is withheld

{count} recordings, one or two effects in each, or none, or something that no library knows. Nobody of this project
has seen the answers; the diagnoses stand in `blind-predictions.json`. Errors are on strokes kept out of every fit.
Made by

```
{command}
```

| case | verdict | effects (probability of each) | unknown | before N | after N | floor N | shrinkage | CPU s |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
"""


def diagnosed(source: Path, folder: Path) -> dict[str, Any]:
    """The diagnosis of one recording, made once."""
    name = source.name.removesuffix(".csv.gz")
    out = folder / f"{name}.json"
    if not out.exists():
        log = folder / f"{name}.mcap"
        if not log.exists():
            _type("import", source, "--out", log)
        began = time.process_time()
        found = diagnose([load(log)])
        write_document(folder / f"{name}.twin.json", found.twin)
        write_document(out, found.diagnosis)
        (folder / f"{name}.seconds").write_text(f"{time.process_time() - began:.1f}", encoding="utf-8")
        print(f"{name}: {summary(found.diagnosis)}", flush=True)
    document: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return document


def _type(*words: object) -> None:
    command = Path(sys.executable).with_name("mrbench")
    subprocess.run([str(command), *map(str, words)], check=True)


def row(name: str, diagnosis: dict[str, Any], seconds: str) -> str:
    """One line of the table."""
    gap = diagnosis["gap"]
    effects = ", ".join(f"{e['name']} ({e['probability']:.2f})" for e in diagnosis["effects"]) or "–"
    shrinkage = "–" if gap["shrinkage"] is None else f"{gap['shrinkage']:.3f}"
    figures = [f"{gap[key]:.3g}" for key in ("before_n", "after_n", "noise_floor_n")]
    cells = [name, diagnosis["verdict"], effects, f"{diagnosis['unknown_probability']:.2f}", *figures, shrinkage]
    return f"| {' | '.join([*cells, seconds])} |"


def main() -> None:
    """Diagnose every case and write the evidence."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--only", default="", help="cases by comma")
    options.add_argument("--keep", type=Path, default=None, help="folder for logs, diagnoses and twins")
    asked = options.parse_args()
    shared = Path(os.environ.get("MRBENCH_SHARED", "."))
    sources = sorted(shared.glob("blind/case*.csv.gz"))
    if not sources:
        sys.exit("MRBENCH_SHARED: names no folder with blind/caseNN.csv.gz; point it at the recordings")
    wanted = [name for name in asked.only.split(",") if name]
    chosen = [s for s in sources if not wanted or s.name.removesuffix(".csv.gz") in wanted]
    with TemporaryDirectory() as scratch:
        folder = asked.keep or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        found = {s.name.removesuffix(".csv.gz"): diagnosed(s, folder) for s in chosen}
        seconds = {name: (folder / f"{name}.seconds").read_text(encoding="utf-8") for name in found}
    if len(chosen) < len(sources):
        return
    EVIDENCE.mkdir(parents=True, exist_ok=True)
    text = json.dumps(found, separators=(",", ":"), ensure_ascii=False)
    (EVIDENCE / "blind-predictions.json").write_text(text + "\n", encoding="utf-8")
    head = _HEAD.format(count=len(found), command="MRBENCH_SHARED=... python -m benchmarks.blind")
    rows = [row(name, diagnosis, seconds[name]) for name, diagnosis in found.items()]
    (EVIDENCE / "blind.md").write_text(head + "\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
