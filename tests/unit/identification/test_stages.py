"""The stages of a fit, alone and together, and what they load."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from made_up_strokes import stretch

from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import parameter_set
from identification.errors import IdentificationError
from identification.identify import Request, identify
from identification.recordings import Recording, Segment
from identification.refine import Settings
from identification.results import Fit
from identification.simulate import Setting, Stroke, simulate

LABORATORY = to_coordinates(parameter_set("laboratory").parameters)
RATE, NOISE, LEVELS, SECONDS = 1000.0, 2.5, (0.0, 0.3, 0.5), 2.0


def recording() -> Recording:
    """One sine of the laboratory damper through three voltages."""
    count = round(RATE * SECONDS * len(LEVELS))
    t, w = np.arange(count) / RATE, 2 * np.pi * 1.5
    x = 0.010 * np.sin(w * t)
    drive = np.array(LEVELS)[np.minimum((t / SECONDS).astype(int), len(LEVELS) - 1)]
    stroke = Stroke(RATE, x, 0.010 * w * np.cos(w * t), -w * w * x, drive)
    random = np.random.default_rng(3)
    force = simulate(Setting(LABORATORY), stroke, fineness=0.005).force + NOISE * random.standard_normal(count)
    edges = np.linspace(0, count, len(LEVELS) + 1).astype(int)
    segments = tuple(
        Segment(i, f"{level}V", int(edges[i]), int(edges[i + 1]), "sine", 0.010, 1.5, level)
        for i, level in enumerate(LEVELS)
    )
    made = stretch(x, force, drive, segments, rate=RATE)
    metadata = {"run": {"specimen": "made up", "source": "run"}}
    return Recording(Path("made-up.mcap"), "0" * 64, "coil_v", "V", (made,), metadata)


def fitted(*stages: str, budget: float | None = None, preset: str = "local") -> Fit:
    return identify([recording()], Request(settings=Settings(budget=budget), stages=stages, preset=preset))


@pytest.fixture(scope="module")
def both() -> Fit:
    return fitted("pinn", "refine")


@pytest.fixture(scope="module")
def alone() -> Fit:
    return fitted("pinn")


def test_both_stages_reach_the_noise_and_agree(both):
    assert [stage.name for stage in both.stages] == ["pinn", "refine"]
    assert [stage.rmse_n for stage in both.stages] == pytest.approx([NOISE, NOISE], rel=0.03)
    assert both.agreement.startswith("agree: pinn and refine differ most in ")
    assert max(both.agreement_deviations.values()) < 1.96
    assert len(both.agreement_deviations) >= 11
    assert both.result == "converged"


def test_the_entry_of_the_network_has_both_of_its_errors_and_its_own_coordinates(both):
    entry = both.stages[0]
    assert "reaches the noise" in entry.note
    assert entry.simulated_n.validation == pytest.approx(NOISE, rel=0.1)
    assert entry.reconstructed_n.validation == pytest.approx(NOISE, rel=0.1)
    assert entry.coordinates["k1"].value == pytest.approx(LABORATORY.k1, rel=0.2)
    assert entry.coordinates["k1"].value != both.coordinates["k1"].value
    assert both.stages[1].coordinates is None


def test_the_network_alone_gives_a_whole_fit_with_intervals(alone):
    assert [stage.name for stage in alone.stages] == ["pinn"]
    assert alone.result == "converged"
    assert alone.agreement is None
    assert alone.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    for name in ("F_a", "F_b", "D_y", "c0_a", "k0", "f0"):
        low, high = alone.coordinates[name].ci95
        assert low < alone.coordinates[name].value < high
        assert low - (high - low) < getattr(LABORATORY, name) < high + (high - low)
    assert alone.parameters["A"].identifiable is False
    assert Fit.model_validate_json(alone.model_dump_json(by_alias=True)) == alone


def test_its_network_and_settings_are_in_the_provenance(both):
    assert both.provenance.settings["stages"] == "pinn,refine"
    assert both.provenance.settings["preset"] == "local"


def test_a_network_without_budget_is_said_beside_the_refinement_and_refused_alone():
    found = fitted("pinn", "refine", budget=0.2)
    assert found.agreement.startswith("not compared: pinn found nothing, its budget of 0.1 s")
    assert [stage.name for stage in found.stages] == ["refine"]
    assert found.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    with pytest.raises(IdentificationError, match=r"pinn found nothing: its budget.*raise --budget"):
        fitted("pinn", budget=0.1)


def test_an_unknown_preset_is_refused():
    with pytest.raises(IdentificationError, match="deep: neither a preset"):
        fitted("pinn", preset="deep")


def test_the_refinement_alone_leaves_torch_unloaded():
    program = (
        "import sys\n"
        "from test_stages import fitted\n"
        "assert fitted('refine').result == 'converged'\n"
        "assert 'torch' not in sys.modules, 'torch was loaded'\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=Path(__file__).parent, capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
