"""Recordings of two real dampers through the commands of the product: import, identify, predict.

`MRBENCH_SHARED` names the folder that holds `data/utfsm_sine` and `data/nees_dyke`; nothing of the recordings is
kept, only figures and pictures. Writes `docs/evidence/real-damper.md`. ``--keep FOLDER`` keeps logs, fits and
predictions there, and a later call takes up where this one stopped.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from platform import python_version
from typing import Any

import jinja2

from benchmarks.desk import Desk, Found
from benchmarks.kept import folder
from benchmarks.laid_over import cycles_of
from benchmarks.real_damper_plots import draw_all
from benchmarks.real_damper_tables import (
    CURRENTS,
    FAST,
    SLOW,
    TEST,
    at_rest,
    by_current,
    by_file,
    by_speed,
    by_voltage,
    error_of,
    inertia,
    names_of,
    shared_parts,
    summary,
    swift,
    together,
    witness,
)
from benchmarks.timing import reference_seconds

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
_WIDE_PRIOR = "--delay-prior 0.01 --stages refine"
"""Lets a fit find the lag of a few strokes by itself; the network is asked about all strokes together."""
_CHANNELS = {"": "", "-as-recorded": " --delay-prior 0"}
"""What the file of a fit is called, and how its channels are taken."""
_DRIVEN_UNTIL = 21.2
"""[s] after which the random recording holds neither stroke nor voltage."""


def both_fits(desk: Desk, log: str, options: str) -> dict[str, Found]:
    """With the channels' delays fitted, and with the channels taken as recorded."""
    return {key: desk.fit(log, f"{log}{key}", options + extra) for key, extra in _CHANNELS.items()}


def one_current(desk: Desk) -> dict[str, Found]:
    """A law for each current alone, from the same strokes as the common one."""
    return {
        current: desk.fit(
            "utfsm", f"utfsm-{current}A", f"{without([*TEST, *other_currents(current)])} {_WIDE_PRIOR}"
        )
        for current in CURRENTS
    }


def leads(desk: Desk) -> dict[str, dict[str, Any]]:
    """The lag of the force that each current wants by itself, in the files of either sampling rate."""
    found: dict[str, dict[str, Any]] = {}
    for rate, others in (("1000", SLOW), ("200", FAST)):
        found[rate] = {}
        for current in CURRENTS:
            name = f"lead-{rate}-{current}A"
            held = without([*others, *other_currents(current)])
            desk.type(f"mrbench identify utfsm.mcap {held} {_WIDE_PRIOR} --out {name}.json")
            found[rate][current] = desk.document(name)["nuisances"]["force_delay"]
    return found


def without(strokes: Sequence[str]) -> str:
    """The option that holds these strokes out."""
    return f"--hold-out '{','.join(f'{stroke}*' for stroke in strokes)}'"


def other_currents(current: str) -> list[str]:
    """Patterns of all currents but one."""
    return [f"*_{other}A" for other in CURRENTS if other != current]


def utfsm(desk: Desk) -> dict[str, Any]:
    """Thirty sinusoidal strokes at five constant currents."""
    desk.type('mrbench import "$MRBENCH_SHARED"/data/utfsm_sine/*.csv.gz --out utfsm.mcap')
    fits, alone = both_fits(desk, "utfsm", without(TEST)), one_current(desk)
    offset = desk.simulated("utfsm", "utfsm", "utfsm-offset", " --free offset").series
    return {
        "fits": fits,
        "by_current": by_current(fits, alone),
        "alone_together": together(alone),
        "by_file": by_file(fits[""]),
        "one_amp": {key: error_of(found.series, ["5mm_4Hz_1A"])[1] for key, found in fits.items()},
        "leads": leads(desk),
        "offset_freed": offset.error(offset.held_out)[1],
        "at_rest": at_rest(desk, "utfsm", TEST),
        "shared": shared_parts([cycles_of(fits[""].series, name) for name in names_of(TEST, CURRENTS)]),
    }


def nees(desk: Desk) -> dict[str, Any]:
    """A random stroke at a voltage that switches at random."""
    desk.type('mrbench import "$MRBENCH_SHARED"/data/nees_dyke/ranran_50.csv.gz --out nees.mcap')
    fits = both_fits(desk, "nees", "--hold-out-after 0.6")
    series = fits[""].series
    driven = series.held_out & (series.time < _DRIVEN_UNTIL)
    return {
        "fits": fits,
        "by_voltage": by_voltage(fits),
        "driven": {key: found.series.error(driven) for key, found in fits.items()},
        "at_rest": series.error(series.held_out & ~driven),
        "by_speed": by_speed(series, driven),
        "swift": swift(series, driven),
        "inertia": {key: inertia(found.series, series.held_out) for key, found in fits.items()},
    }


def results(found: dict[str, dict[str, Any]], typed: Sequence[str]) -> dict[str, Any]:
    """The tables that hold both recordings, and what they were made with."""
    rows, witnesses = [], []
    for log, made in found.items():
        for key, label in (("", "delays fitted"), ("-as-recorded", "as recorded")):
            rows.append(summary(log, label, made["fits"][key]))
            witnesses.append(witness(rows[-1], made["fits"][key]))
    versions = {name: version(name) for name in ("mrbench", "numpy", "scipy", "numba")} | {
        "Python": python_version()
    }
    apart = max(abs(w["ratio"] - 1.0) for w in witnesses)
    made = {"typed": typed, "versions": versions, "kernel": 1e3 * reference_seconds()}
    return {"results": rows, "witnesses": witnesses, "apart": apart, **made}


def page(context: dict[str, Any]) -> str:
    """The page in Markdown."""
    folder = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(
        loader=folder, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, autoescape=False
    )
    environment.filters["d"] = lambda value, digits: f"{value:.{digits}f}"
    environment.filters["g"] = lambda value: f"{value:.4g}"
    return environment.get_template("real_damper.md.j2").render(**context)


def main() -> None:
    """Run everything and write the page and its pictures."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--keep", type=Path, default=None, help="folder for logs, fits and predictions")
    asked = options.parse_args()
    shared = os.environ.get("MRBENCH_SHARED")
    if shared is None or not (Path(shared) / "data" / "utfsm_sine").is_dir():
        sys.exit(
            "MRBENCH_SHARED: names no folder with data/utfsm_sine and data/nees_dyke; point it at the recordings"
        )
    os.environ["MRBENCH_SHARED"] = str(Path(shared).resolve())
    with folder(asked.keep) as place:
        desk = Desk(place)
        found = {"utfsm": utfsm(desk), "nees": nees(desk)}
    draw_all(found["utfsm"]["fits"][""].series, found["nees"]["fits"][""].series, EVIDENCE / "real-damper")
    (EVIDENCE / "real-damper.md").write_text(page(results(found, desk.typed) | found), encoding="utf-8")


if __name__ == "__main__":
    main()
