"""Presets and settings files, with present and former names."""

import json

import pytest

from identification.errors import IdentificationError
from identification.pinn.common.settings import list_presets, read_settings


def test_shipped_presets_are_complete_and_name_their_network():
    networks = {name: read_settings(name).network for name in list_presets()}
    assert networks == {"dense": "dense", "elements": "elements", "paper": "paper", "tuned": "elements"}


@pytest.mark.parametrize(("former", "present"), [("local", "elements"), ("global", "dense")])
def test_presets_are_read_under_their_former_names(former, present):
    assert read_settings(former) == read_settings(present)


@pytest.mark.parametrize(
    ("former", "present"),
    [
        (
            {
                "network": "local", "layers": [{"rank": 24}], "take_back": False, "features": "time", "kept": 1e-4,
                "residual": "weak", "multipliers": 2, "starts": 4,
                "levels": [{"physics": 5.0, "meshes": 2, "thin": 4, "held": ["rho"], "settled": 1e-3}],
            },
            {
                "network": "elements", "layers": [{"rank": 24}], "refit_on_all": False, "element_input": "time",
                "law_tolerance": 1e-4, "residual_weighting": "weak_form", "multiplier_steps": 2, "max_starts": 4,
                "schedule": [
                    {
                        "law_weight": 5.0, "meshes": 2, "decimation": 4, "frozen_coordinates": ["rho"],
                        "reversal_tolerance": 1e-3,
                    }
                ],
            },
        ),
        ({"network": "global", "physics": [1.0, 20.0]}, {"network": "dense", "law_weights": [1.0, 20.0]}),
    ],
    ids=["elements", "dense"],
)  # fmt: skip
def test_settings_files_are_read_under_the_former_names_and_written_under_the_present_ones(
    tmp_path, former, present
):
    (tmp_path / "former.json").write_text(json.dumps(former))
    (tmp_path / "present.json").write_text(json.dumps(present))
    settings = read_settings(tmp_path / "former.json")
    assert settings == read_settings(tmp_path / "present.json")
    assert json.loads(settings.model_dump_json(exclude_unset=True)) == present


@pytest.mark.parametrize(("former", "present"), [("points", "collocation"), ("means", "galerkin")])
def test_former_names_of_residual_weightings_are_read(tmp_path, former, present):
    settings = {"network": "elements", "layers": [{}], "schedule": [], "residual_weighting": former}
    (tmp_path / "settings.json").write_text(json.dumps(settings))
    assert read_settings(tmp_path / "settings.json").residual_weighting == present


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"network": "elements"}, r"elements\.layers: Field required"),
        ({"network": "local"}, r"elements\.layers: Field required"),
        ({"network": "paper", "learning_rate": 0.0}, "learning_rate.*greater than 0"),
        ({"network": "dense", "depth": 3}, "depth.*not permitted"),
        ({"network": "deep"}, "does not match any of the expected tags"),
        ({"network": ["deep"]}, "invalid settings of a network"),
        (["local"], "invalid settings of a network"),
    ],
)
def test_invalid_settings_are_refused_with_their_location(tmp_path, settings, message):
    path = tmp_path / "settings.json"
    path.write_text(json.dumps(settings))
    with pytest.raises(IdentificationError, match=message):
        read_settings(path)


def test_an_unknown_preset_is_refused_with_the_known_ones():
    with pytest.raises(IdentificationError, match=r"neither a preset .dense, elements, paper, tuned. nor a file"):
        read_settings("elments")
