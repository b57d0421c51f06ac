"""Stages of a fit, alone and together, and the packages that they import."""

import subprocess
import sys
from pathlib import Path

import pytest

from identification.documents.fit import Fit
from identification.errors import IdentificationError
from tests.support.short_fit import LABORATORY, NOISE, fitted


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
    assert both.provenance.settings["preset"] == "elements"


def test_a_network_without_budget_is_noted_in_a_fit_with_both_stages_and_refused_alone():
    found = fitted("pinn", "refine", budget="0.2s")
    assert found.agreement.startswith("not compared: pinn found nothing, its budget of 0.1 s")
    assert [stage.name for stage in found.stages] == ["refine"]
    assert found.rmse_n.train == pytest.approx(NOISE, rel=0.03)
    with pytest.raises(IdentificationError, match=r"pinn found nothing: its budget.*raise --budget"):
        fitted("pinn", budget="0.1s")


def test_an_unknown_preset_is_refused():
    with pytest.raises(IdentificationError, match="deep: neither a preset"):
        fitted("pinn", preset="deep")


def test_the_refinement_alone_leaves_torch_unloaded():
    program = (
        "import sys\n"
        "from tests.support.short_fit import fitted\n"
        "assert fitted('refine').result == 'converged'\n"
        "assert 'torch' not in sys.modules, 'torch was loaded'\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=Path(__file__).parents[4], capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stderr
