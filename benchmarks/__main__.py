"""Run benchmarks by name: ``python -m benchmarks [NAME...]``."""

import argparse
import importlib

from benchmarks.common import measure_reference_time

MODULES = {
    "simulation": "speed.simulation",
    "fitting": "speed.fitting",
    "logs": "speed.logs",
    "commands": "speed.commands",
    "catalogue": "speed.catalogue",
    "rest_load": "speed.rest_load",
    "rig_load": "speed.rig_load",
    "benches": "speed.benches",
    "workers": "speed.workers",
    "live_page": "live.page",
    "scripted_page": "live.scripted_page",
    "dead_bench": "live.dead_bench",
    "campaign": "live.campaign",
    "overlay": "speed.overlay",
    "interval_coverage": "accuracy.interval_coverage",
    "soak": "speed.soak",
    "choices": "accuracy.design_choices",
    "reduced_models": "accuracy.reduced_models",
    "pinn": "pinn.networks",
    "ablation": "pinn.ablation",
    "deepxde": "pinn.deepxde",
}
"""Module of each benchmark that runs without arguments."""
DEFAULTS = ("simulation", "fitting", "logs", "interval_coverage", "soak")


def main() -> None:
    """Run the named benchmarks, or the default ones, and print their results next to the requirements."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Run benchmarks.")
    names = f"{', '.join(MODULES)}; default: {', '.join(DEFAULTS)}"
    parser.add_argument("names", nargs="*", metavar="NAME", help=names)
    chosen = parser.parse_args().names or DEFAULTS
    unknown = [name for name in chosen if name not in MODULES]
    if unknown:
        parser.error(f"unknown benchmark: {', '.join(unknown)}; give one of {', '.join(MODULES)}")
    print(f"reference kernel (a million additions in plain Python): {measure_reference_time() * 1e3:.1f} ms")
    for name in chosen:
        importlib.import_module(f"benchmarks.{MODULES[name]}").run()


if __name__ == "__main__":
    main()
