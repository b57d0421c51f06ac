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

from benchmarks.common import SimulatedFit, Workspace, find_cycles, measure_reference_time, open_folder
from benchmarks.real.plots import draw_all
from benchmarks.real.tables import (
    CURRENTS,
    FAST_STROKES,
    SLOW_STROKES,
    TEST_STROKES,
    compare_network,
    compute_high_frequency_share,
    compute_pooled_nrmse,
    compute_rest_start_nrmse,
    compute_stretch_error,
    decompose_residual,
    estimate_inertia,
    make_stretch_names,
    summarise_fit,
    tabulate_by_current,
    tabulate_by_file,
    tabulate_by_speed,
    tabulate_by_voltage,
)

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
_WIDE_PRIOR = "--delay-prior 0.01 --stages refine"
"""Lets a fit find the lag of a few strokes by itself; the network is asked about all strokes together."""
_CHANNELS = {"": "", "-as-recorded": " --delay-prior 0"}
"""What the file of a fit is called, and how its channels are taken."""
_DRIVE_END = 21.2
"""[s] after which the random recording holds neither stroke nor voltage."""


def fit_both(desk: Workspace, log: str, options: str) -> dict[str, SimulatedFit]:
    """With the channels' delays fitted, and with the channels taken as recorded."""
    return {key: desk.identify(log, f"{log}{key}", options + extra) for key, extra in _CHANNELS.items()}


def fit_each_current(desk: Workspace) -> dict[str, SimulatedFit]:
    """A law for each current alone, from the same strokes as the common one."""
    return {
        current: desk.identify(
            "utfsm",
            f"utfsm-{current}A",
            f"{make_hold_out_option([*TEST_STROKES, *list_other_currents(current)])} {_WIDE_PRIOR}",
        )
        for current in CURRENTS
    }


def estimate_leads(desk: Workspace) -> dict[str, dict[str, Any]]:
    """The lag of the force that each current wants by itself, in the files of either sampling rate."""
    found: dict[str, dict[str, Any]] = {}
    for rate, others in (("1000", SLOW_STROKES), ("200", FAST_STROKES)):
        found[rate] = {}
        for current in CURRENTS:
            name = f"lead-{rate}-{current}A"
            held = make_hold_out_option([*others, *list_other_currents(current)])
            desk.run(f"mrbench identify utfsm.mcap {held} {_WIDE_PRIOR} --out {name}.json")
            found[rate][current] = desk.read_document(name)["nuisances"]["force_delay"]
    return found


def make_hold_out_option(strokes: Sequence[str]) -> str:
    """The option that holds these strokes out."""
    return f"--hold-out '{','.join(f'{stroke}*' for stroke in strokes)}'"


def list_other_currents(current: str) -> list[str]:
    """Patterns of all currents but one."""
    return [f"*_{other}A" for other in CURRENTS if other != current]


def evaluate_utfsm(desk: Workspace) -> dict[str, Any]:
    """Thirty sinusoidal strokes at five constant currents."""
    desk.run('mrbench import "$MRBENCH_SHARED"/data/utfsm_sine/*.csv.gz --out utfsm.mcap')
    fits, alone = fit_both(desk, "utfsm", make_hold_out_option(TEST_STROKES)), fit_each_current(desk)
    offset = desk.simulate_fit("utfsm", "utfsm", "utfsm-offset", " --free offset").series
    return {
        "fits": fits,
        "by_current": tabulate_by_current(fits, alone),
        "alone_together": compute_pooled_nrmse(alone),
        "by_file": tabulate_by_file(fits[""]),
        "one_amp": {key: compute_stretch_error(found.series, ["5mm_4Hz_1A"])[1] for key, found in fits.items()},
        "leads": estimate_leads(desk),
        "offset_freed": offset.compute_error(offset.held_out)[1],
        "at_rest": compute_rest_start_nrmse(desk, "utfsm", TEST_STROKES),
        "shared": decompose_residual(
            [find_cycles(fits[""].series, name) for name in make_stretch_names(TEST_STROKES, CURRENTS)]
        ),
    }


def evaluate_nees(desk: Workspace) -> dict[str, Any]:
    """A random stroke at a voltage that switches at random."""
    desk.run('mrbench import "$MRBENCH_SHARED"/data/nees_dyke/ranran_50.csv.gz --out nees.mcap')
    fits = fit_both(desk, "nees", "--hold-out-after 0.6")
    series = fits[""].series
    driven = series.held_out & (series.time < _DRIVE_END)
    return {
        "fits": fits,
        "by_voltage": tabulate_by_voltage(fits),
        "driven": {key: found.series.compute_error(driven) for key, found in fits.items()},
        "at_rest": series.compute_error(series.held_out & ~driven),
        "by_speed": tabulate_by_speed(series, driven),
        "swift": compute_high_frequency_share(series, driven),
        "inertia": {key: estimate_inertia(found.series, series.held_out) for key, found in fits.items()},
    }


def collect_results(found: dict[str, dict[str, Any]], typed: Sequence[str]) -> dict[str, Any]:
    """The tables that hold both recordings, and what they were made with."""
    rows, witnesses = [], []
    for log, made in found.items():
        for key, label in (("", "delays fitted"), ("-as-recorded", "as recorded")):
            rows.append(summarise_fit(log, label, made["fits"][key]))
            witnesses.append(compare_network(rows[-1], made["fits"][key]))
    versions = {name: version(name) for name in ("mrbench", "numpy", "scipy", "numba")} | {
        "Python": python_version()
    }
    apart = max(abs(w["ratio"] - 1.0) for w in witnesses)
    made = {"typed": typed, "versions": versions, "kernel": 1e3 * measure_reference_time()}
    return {"results": rows, "witnesses": witnesses, "apart": apart, **made}


def render_page(context: dict[str, Any]) -> str:
    """The page in Markdown."""
    folder = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(
        loader=folder, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, autoescape=False
    )
    environment.filters["d"] = lambda value, digits: f"{value:.{digits}f}"
    environment.filters["g"] = lambda value: f"{value:.4g}"
    return environment.get_template("damper.md.j2").render(**context)


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
    with open_folder(asked.keep) as place:
        desk = Workspace(place)
        found = {"utfsm": evaluate_utfsm(desk), "nees": evaluate_nees(desk)}
    draw_all(found["utfsm"]["fits"][""].series, found["nees"]["fits"][""].series, EVIDENCE / "real-damper")
    (EVIDENCE / "real-damper.md").write_text(
        render_page(collect_results(found, desk.commands) | found), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
