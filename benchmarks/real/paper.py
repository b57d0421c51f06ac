"""Evidence page with the tables and figures of the paper, for a damper with known parameters.

    python -m benchmarks.real.paper [FOLDER]

The paper's six voltages are recorded on the simulated rig. A short recording is identified, and another one with
100 s at each voltage is predicted. The output is docs/evidence/paper.md with its figures. FOLDER keeps the logs,
which later calls use again.
"""

import sys
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined

from benchmarks.common import PredictionSeries, Workspace, read_series
from benchmarks.real.paper_figures import draw
from identification.damper import (
    PARAMETER_SETS,
    PARAMETERS,
    Parameters,
    compute_hysteresis_rate,
    compute_inner_velocity,
    evaluate_coefficient,
)

PAGE = Path(__file__).parents[2] / "docs" / "evidence" / "paper.md"
TEMPLATE = Path(__file__).with_name("paper.md.j2")
TABLE_2 = {0.0: 18.7936, 0.1: 17.7621, 0.2: 13.8159, 0.3: 11.8298, 0.4: 16.8806, 0.5: 10.0988}
"""Force error in the paper [N] by voltage [V]."""
TABLE_1, TRUE = (PARAMETER_SETS[name].parameters for name in ("paper_table_1", "laboratory"))
AMPLITUDE, FREQUENCY, SECONDS, STEP = 0.010, 1.0, 3.0, 1e-4
COMMANDS = (
    ("train.mcap", "mrbench run six_voltages --scenario default --seed 1 --out train.mcap"),
    ("unseen.mcap", "mrbench run paper_sines --scenario default --seed 2 --out unseen.mcap"),
    ("fit.json", "mrbench identify train.mcap --stages refine --out fit.json"),
    (
        "unseen.npz",
        "mrbench predict fit.json unseen.mcap --free offset --out unseen.json --series unseen.npz",
    ),
)


def integrate_force(p: Parameters, drive: float, *, printed: bool = False) -> np.ndarray:
    """Integrate the force [N] in the last cycle of the paper's sine at a constant drive.

    The method is Runge-Kutta of order four with steps of 0.1 ms. It is slow and independent of `simulate`.

    Args:
        p: parameters of the damper.
        drive: drive [V].
        printed: use x' + y' as printed in eq. 13 instead of x' - y'.
    """
    w = 2 * np.pi * FREQUENCY
    alpha, c0, c1 = (
        evaluate_coefficient(p.alpha_a, p.alpha_b, drive),
        evaluate_coefficient(p.c0_a, p.c0_b, drive),
        evaluate_coefficient(p.c1_a, p.c1_b, drive),
    )

    def rates(t: float, y: float, z: float) -> tuple[float, float]:
        x, v = AMPLITUDE * np.sin(w * t), AMPLITUDE * w * np.cos(w * t)
        y_rate = compute_inner_velocity(x, v, y, z, alpha, c0, c1, p.k0)
        if not printed:
            return y_rate, compute_hysteresis_rate(v - y_rate, z, p.A, p.beta, p.gamma, p.n)
        size, summed = abs(z), v + y_rate
        reduction = p.gamma * abs(summed) * z * size ** (p.n - 1) + p.beta * summed * size**p.n
        return y_rate, p.A * (v - y_rate) - reduction

    y, z, forces = 0.0, 0.0, []
    for k in range(round(SECONDS / STEP)):
        t = k * STEP
        if t >= SECONDS - 1.0 / FREQUENCY and k % 10 == 0:
            forces.append(c1 * rates(t, y, z)[0] + p.k1 * (AMPLITUDE * np.sin(w * t) - p.x0))
        y, z = _advance(rates, t, y, z)
    return np.array(forces)


def _advance(
    rates: Callable[[float, float, float], tuple[float, float]], t: float, y: float, z: float
) -> tuple[float, float]:
    h = STEP
    a = rates(t, y, z)
    b = rates(t + h / 2, y + h / 2 * a[0], z + h / 2 * a[1])
    c = rates(t + h / 2, y + h / 2 * b[0], z + h / 2 * b[1])
    d = rates(t + h, y + h * c[0], z + h * c[1])
    both = [h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]) for i in range(2)]
    return y + both[0], z + both[1]


def render_table_1(fit: dict[str, Any]) -> str:
    """Return the table of the fourteen parameters in the paper's order, with intervals and true values."""
    head = (
        "| parameter | found | 95 % interval | unit | true | the paper's damper |\n"
        "| --- | ---: | --- | --- | ---: | ---: |\n"
    )
    rows = []
    for i, q in enumerate(PARAMETERS):
        e = fit["parameters"][q.symbol]
        ci = e["ci95"]
        interval = (
            "fixed: a gauge" if q.symbol == "A" else f"{ci[0]:.4g} to {ci[1]:.4g}" if ci else "not observable"
        )
        inside = "" if ci is None or ci[0] <= TRUE[i] <= ci[1] else " (outside)"
        rows.append(
            f"| `{q.symbol}` | {e['value']:.5g} | {interval}{inside} | {e['unit']} | {TRUE[i]:.5g} | "
            f"{TABLE_1[i]:.5g} |"
        )
    return head + "\n".join(rows)


def render_table_2(prediction: dict[str, Any]) -> str:
    """Return the table of force errors by voltage, next to those of the paper."""
    head = "| voltage V | RMSE N | NRMSE | samples | the paper's RMSE N |\n| ---: | ---: | ---: | ---: | ---: |\n"
    rows = [
        f"| {abs(e['drive']):.1f} | {e['rmse_n']:.3f} | {100 * e['nrmse']:.2f} % | {e['samples']} | "
        f"{TABLE_2[abs(round(e['drive'], 1))]:.4f} |"
        for e in prediction["per_drive"]
    ]
    return head + "\n".join(rows)


def render_table_1_forces() -> str:
    """Return the forces of the paper's Table 1 on its own stroke, and its Table 2 relative to them."""
    head = (
        "| voltage V | c0 N s/m | c1 N s/m | peak force N | deviation N | Table 2's error over that |\n"
        "| ---: | ---: | ---: | ---: | ---: | ---: |\n"
    )
    rows = []
    for drive, error in TABLE_2.items():
        force = integrate_force(TABLE_1, drive)
        c0, c1 = (
            evaluate_coefficient(TABLE_1.c0_a, TABLE_1.c0_b, drive),
            evaluate_coefficient(TABLE_1.c1_a, TABLE_1.c1_b, drive),
        )
        rows.append(
            f"| {drive:.1f} | {c0:.0f} | {c1:.0f} | {np.abs(force).max():.1f} | {force.std():.1f} | "
            f"{100 * error / force.std():.0f} % |"
        )
    return head + "\n".join(rows)


def render_sign_table() -> str:
    """Return the change of the force if x' + y' replaces x' - y'."""
    head = "| voltage V | laboratory damper | Spencer's damper |\n| ---: | ---: | ---: |\n"
    dampers = (TRUE, PARAMETER_SETS["spencer_1997"].parameters)
    rows = []
    for drive in TABLE_2:
        changes = []
        for p in dampers:
            right, wrong = integrate_force(p, drive), integrate_force(p, drive, printed=True)
            changes.append(f"{100 * float(np.sqrt(np.mean((wrong - right) ** 2))) / right.std():.1f} %")
        rows.append(f"| {drive:.1f} | {' | '.join(changes)} |")
    return head + "\n".join(rows)


def render_page(fit: dict[str, Any], prediction: dict[str, Any], commands: list[str]) -> str:
    """Return the page made from the documents of this run."""
    p = TABLE_1
    zero = -p.c0_a / p.c0_b
    unstable = -(p.c0_a + p.c1_a) / (p.c0_b + p.c1_b)
    known = [n for n, e in fit["parameters"].items() if e["ci95"]]
    inside = sum(
        fit["parameters"][q.symbol]["ci95"][0] <= TRUE[i] <= fit["parameters"][q.symbol]["ci95"][1]
        for i, q in enumerate(PARAMETERS)
        if q.symbol in known
    )
    band = prediction["band"]
    environment = Environment(undefined=StrictUndefined, keep_trailing_newline=True)
    return environment.from_string(TEMPLATE.read_text()).render(
        version=version("mrbench"),
        commands="\n".join(commands),
        table_1=render_table_1(fit),
        table_2=render_table_2(prediction),
        table_of_table_1=render_table_1_forces(),
        table_of_signs=render_sign_table(),
        inside=inside,
        known=len(known),
        rmse=f"{prediction['rmse_n']:.3f}",
        floor=f"{prediction['noise_floor_n']:.3f}",
        band=f"{100 * band['coverage']:.1f} % of its {prediction['samples']} samples lie inside the band of "
        f"± {band['half_width_n']:.2f} N",
        growth=f"{np.exp(p.eta * 0.1):.0f}",
        negative=f"{evaluate_coefficient(p.c0_a, p.c0_b, 0.5):.0f}",
        zero=f"{zero:.4f}",
        unstable=f"{unstable:.4f}",
        ratio=f"{p.c0_a / p.c1_a:.0f}",
    )


def run(folder: Path) -> None:
    """Write the page."""
    workspace = Workspace(folder)
    for output, command in COMMANDS:
        if not (folder / output).exists():
            workspace.run(command)
    found: PredictionSeries = read_series(folder / "unseen.npz")
    draw(found, PAGE.parent / "paper")
    PAGE.write_text(
        render_page(
            workspace.read_document("fit"), workspace.read_document("unseen"), [command for _, command in COMMANDS]
        )
    )


if __name__ == "__main__":
    if len(sys.argv) > 1:
        run(Path(sys.argv[1]))
    else:
        with TemporaryDirectory() as temporary:
            run(Path(temporary))
