"""Evidence page of two real dampers, whose recordings are imported, identified and predicted by the commands.

`MRBENCH_SHARED` names the folder with `data/utfsm_sine` and `data/nees_dyke`. The page
`docs/evidence/real-damper.md` contains results and plots, and none of the recordings. ``--keep FOLDER`` keeps
logs, fits and predictions, and continues an interrupted call.
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
"""Options of fits of few strokes: a wide prior of the delays, and no network."""
_CHANNELS = {"": "", "-as-recorded": " --delay-prior 0"}
"""Treatments of the channel delays: suffix of the fit's file name, and options of the fit."""
_DRIVE_END = 21.2
"""Time after which the random recording has neither stroke nor voltage [s]."""


def fit_both(workspace: Workspace, log: str, options: str) -> dict[str, SimulatedFit]:
    """Fit a log with fitted delays, and with the channels as recorded."""
    return {key: workspace.identify(log, f"{log}{key}", options + extra) for key, extra in _CHANNELS.items()}


def fit_each_current(workspace: Workspace) -> dict[str, SimulatedFit]:
    """Fit the law to each current separately, on the same strokes as the common fit."""
    return {
        current: workspace.identify(
            "utfsm",
            f"utfsm-{current}A",
            f"{make_hold_out_option([*TEST_STROKES, *list_other_currents(current)])} {_WIDE_PRIOR}",
        )
        for current in CURRENTS
    }


def estimate_leads(workspace: Workspace) -> dict[str, dict[str, Any]]:
    """Estimate the lag of the force for each current separately, in the files of each sampling rate."""
    found: dict[str, dict[str, Any]] = {}
    for rate, others in (("1000", SLOW_STROKES), ("200", FAST_STROKES)):
        found[rate] = {}
        for current in CURRENTS:
            name = f"lead-{rate}-{current}A"
            held = make_hold_out_option([*others, *list_other_currents(current)])
            workspace.run(f"mrbench identify utfsm.mcap {held} {_WIDE_PRIOR} --out {name}.json")
            found[rate][current] = workspace.read_document(name)["nuisances"]["force_delay"]
    return found


def make_hold_out_option(strokes: Sequence[str]) -> str:
    """Return the option that holds out these strokes."""
    return f"--hold-out '{','.join(f'{stroke}*' for stroke in strokes)}'"


def list_other_currents(current: str) -> list[str]:
    """Return file patterns of all currents except one."""
    return [f"*_{other}A" for other in CURRENTS if other != current]


def evaluate_utfsm(workspace: Workspace) -> dict[str, Any]:
    """Evaluate thirty sinusoidal strokes at five constant currents."""
    workspace.run('mrbench import "$MRBENCH_SHARED"/data/utfsm_sine/*.csv.gz --out utfsm.mcap')
    fits, alone = fit_both(workspace, "utfsm", make_hold_out_option(TEST_STROKES)), fit_each_current(workspace)
    offset = workspace.simulate_fit("utfsm", "utfsm", "utfsm-offset", " --free offset").series
    return {
        "fits": fits,
        "by_current": tabulate_by_current(fits, alone),
        "alone_together": compute_pooled_nrmse(alone),
        "by_file": tabulate_by_file(fits[""]),
        "one_amp": {key: compute_stretch_error(found.series, ["5mm_4Hz_1A"])[1] for key, found in fits.items()},
        "leads": estimate_leads(workspace),
        "offset_freed": offset.compute_error(offset.held_out)[1],
        "at_rest": compute_rest_start_nrmse(workspace, "utfsm", TEST_STROKES),
        "shared": decompose_residual(
            [find_cycles(fits[""].series, name) for name in make_stretch_names(TEST_STROKES, CURRENTS)]
        ),
    }


def evaluate_nees(workspace: Workspace) -> dict[str, Any]:
    """Evaluate a random stroke at a voltage that switches at random times."""
    workspace.run('mrbench import "$MRBENCH_SHARED"/data/nees_dyke/ranran_50.csv.gz --out nees.mcap')
    fits = fit_both(workspace, "nees", "--hold-out-after 0.6")
    series = fits[""].series
    driven = series.held_out & (series.time < _DRIVE_END)
    return {
        "fits": fits,
        "by_voltage": tabulate_by_voltage(fits),
        "driven": {key: found.series.compute_error(driven) for key, found in fits.items()},
        "at_rest": series.compute_error(series.held_out & ~driven),
        "by_speed": tabulate_by_speed(series, driven),
        "high_frequency": compute_high_frequency_share(series, driven),
        "inertia": {key: estimate_inertia(found.series, series.held_out) for key, found in fits.items()},
    }


def collect_results(found: dict[str, dict[str, Any]], commands: Sequence[str]) -> dict[str, Any]:
    """Return the tables of both recordings, with the commands and versions that produced them."""
    rows, networks = [], []
    for log, made in found.items():
        for key, label in (("", "delays fitted"), ("-as-recorded", "as recorded")):
            rows.append(summarise_fit(log, label, made["fits"][key]))
            networks.append(compare_network(rows[-1], made["fits"][key]))
    versions = {name: version(name) for name in ("mrbench", "numpy", "scipy", "numba")} | {
        "Python": python_version()
    }
    difference = max(abs(n["ratio"] - 1.0) for n in networks)
    origin = {"commands": commands, "versions": versions, "kernel": 1e3 * measure_reference_time()}
    return {"results": rows, "networks": networks, "difference": difference, **origin}


def render_page(context: dict[str, Any]) -> str:
    """Return the page in Markdown."""
    folder = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(
        loader=folder, trim_blocks=True, lstrip_blocks=True, undefined=jinja2.StrictUndefined, autoescape=False
    )
    environment.filters["d"] = lambda value, digits: f"{value:.{digits}f}"
    environment.filters["g"] = lambda value: f"{value:.4g}"
    return environment.get_template("damper.md.j2").render(**context)


def main() -> None:
    """Evaluate both recordings and write the page and its plots."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", type=Path, default=None, help="folder for logs, fits and predictions")
    options = parser.parse_args()
    shared = os.environ.get("MRBENCH_SHARED")
    if shared is None or not (Path(shared) / "data" / "utfsm_sine").is_dir():
        sys.exit("MRBENCH_SHARED: not a folder with data/utfsm_sine and data/nees_dyke; set it to that folder")
    os.environ["MRBENCH_SHARED"] = str(Path(shared).resolve())
    with open_folder(options.keep) as folder:
        workspace = Workspace(folder)
        found = {"utfsm": evaluate_utfsm(workspace), "nees": evaluate_nees(workspace)}
    draw_all(found["utfsm"]["fits"][""].series, found["nees"]["fits"][""].series, EVIDENCE / "real-damper")
    (EVIDENCE / "real-damper.md").write_text(
        render_page(collect_results(found, workspace.commands) | found), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
