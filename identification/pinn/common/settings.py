"""Settings of the networks, read from presets or from JSON files.

Fields, values and presets that were renamed are still read under their former names.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AliasChoices, BeforeValidator, Field, TypeAdapter, ValidationError

from identification.errors import IdentificationError
from identification.pinn.common.activations import Activation
from identification.validation import FrozenModel, describe_validation_error

PRESETS = Path(__file__).parents[1] / "presets"
"""Folder of the presets that ship with the product."""

FORMER_NETWORKS = {"local": "elements", "global": "dense"}
"""Present names of networks, and of the presets of the same name, by their former names."""
_FORMER_WEIGHTINGS = {"points": "collocation", "means": "galerkin", "weak": "weak_form"}

ResidualWeighting = Literal["collocation", "galerkin", "weak_form"]
"""Form in which law residuals enter the loss.

``collocation``: at each Gauss point. ``galerkin``: weighted with test functions. ``weak_form``: as ``galerkin``,
with the stroke's velocity integrated by parts. All but ``galerkin`` are research options, used by benchmarks only.
"""
ElementInput = Literal["slip", "time", "stroke"]
"""Input of an element's network.

``slip``: time mapped around the breakthrough, elements between reversals of the slip. ``time``: plain time in the
same elements. ``stroke``: as ``slip``, with the reversals of the stroke. All but ``slip`` are research options for
ablations.
"""
FeatureGroup = Literal["motion", "drive", "time", "memory"]
"""Group of inputs of the dense network."""
FEATURE_GROUPS: tuple[FeatureGroup, ...] = get_args(FeatureGroup)


class CommonSettings(FrozenModel):
    """Settings of every network."""

    seed: int = Field(default=1, description="of weights, split and order of samples")
    validation_share: float = Field(
        default=0.2, ge=0.0, le=0.5, description="fraction of the samples that is set aside, in blocks"
    )
    refit_on_all: bool = Field(
        default=True,
        validation_alias=AliasChoices("refit_on_all", "take_back"),
        description="end the training with the blocks that were set aside",
    )


class ScheduleStage(FrozenModel):
    """Stage of the training with one law weight."""

    law_weight: float = Field(
        gt=0.0,
        validation_alias=AliasChoices("law_weight", "physics"),
        description="weight of the law residuals against the force misfit",
    )
    meshes: int = Field(ge=1, description="largest number of meshes")
    steps: int = Field(default=4, ge=1, description="largest number of Gauss-Newton steps on one mesh")
    decimation: int = Field(
        default=1, ge=1, validation_alias=AliasChoices("decimation", "thin"), description="keep every n-th sample"
    )
    frozen_coordinates: tuple[str, ...] = Field(
        default=(),
        validation_alias=AliasChoices("frozen_coordinates", "held"),
        description="coordinates that stay fixed, because they diverge far from the solution",
    )
    reversal_tolerance: float = Field(
        default=1e-4,
        validation_alias=AliasChoices("reversal_tolerance", "settled"),
        description="in s: the stage ends when no reversal moves by more",
    )


class LayerSize(FrozenModel):
    """Size of the hidden layer."""

    units: int = Field(default=120, ge=8, description="units of the hidden layer")
    rank: int = Field(default=36, ge=6, description="functions that are kept of them")
    points: int = Field(default=72, ge=8, description="Gauss points of the law residuals in each element")


class ElementSettings(CommonSettings):
    """Settings of the network `elements`: one hidden layer, output weights in each element."""

    network: Literal["elements"] = "elements"
    layers: tuple[LayerSize, ...] = Field(
        min_length=1, description="hidden layer, and larger ones that follow until the law is satisfied"
    )
    activation: Activation = Field(default="tanh", description="activation function of the units")
    element_input: ElementInput = Field(
        default="slip",
        validation_alias=AliasChoices("element_input", "features"),
        description="input of an element: time mapped around the breakthrough of the `slip`, plain `time`, or "
        "time mapped by the `stroke`; the latter two are research options",
    )
    law_tolerance: float = Field(
        default=5e-4,
        validation_alias=AliasChoices("law_tolerance", "kept"),
        description="hysteresis residual over the slip velocity at breakthrough at which the law is satisfied",
    )
    schedule: tuple[ScheduleStage, ...] = Field(
        validation_alias=AliasChoices("schedule", "levels"), description="stages of increasing law weight"
    )
    residual_weighting: Annotated[
        ResidualWeighting, BeforeValidator(lambda name: _FORMER_WEIGHTINGS.get(str(name), name))
    ] = Field(
        default="galerkin",
        validation_alias=AliasChoices("residual_weighting", "residual"),
        description="law residuals at points (`collocation`), weighted with test functions (`galerkin`), or the "
        "latter with the stroke's velocity integrated by parts (`weak_form`); all but `galerkin` are research "
        "options",
    )
    multiplier_steps: int = Field(
        default=3,
        ge=0,
        validation_alias=AliasChoices("multiplier_steps", "multipliers"),
        description="steps of the method of multipliers at the end",
    )
    max_starts: int = Field(
        default=8,
        ge=1,
        validation_alias=AliasChoices("max_starts", "starts"),
        description="largest number of starts",
    )
    opening_length: float = Field(
        default=40.0,
        gt=0.0,
        description="length of the data on which starts are compared, all pieces together, in s",
    )


class TorchSettings(CommonSettings):
    """Settings of the networks that can train on an accelerator."""

    device: str = Field(default="cpu", description="`cpu`, or a torch device such as `cuda`")


class DenseSettings(TorchSettings):
    """Settings of the network `dense`: a multilayer perceptron, all layers trained by Gauss-Newton."""

    network: Literal["dense"] = "dense"
    width: int = Field(default=20, ge=2, description="tanh units of each hidden layer")
    layers: int = Field(default=2, ge=1, description="number of hidden layers")
    features: tuple[FeatureGroup, ...] = Field(
        default=FEATURE_GROUPS,
        min_length=1,
        description="groups of inputs: `motion` and its products, the lagged `drive`, `time`, and the `memory` "
        "of the position in the hysteresis loop; leaving groups out is a research option",
    )
    samples: int = Field(default=3600, ge=100, description="samples in one batch")
    law_weights: tuple[float, float] = Field(
        default=(3.0, 30.0),
        validation_alias=AliasChoices("law_weights", "physics"),
        description="first and last law weight",
    )
    steps: int = Field(default=280, ge=10, description="number of Gauss-Newton steps")
    max_dampers: int | None = Field(
        default=None,
        ge=1,
        description="largest number of dampers that are trained together; by default 1 on `cpu` and 16 elsewhere",
    )


class PaperSettings(TorchSettings):
    """Settings of the network of the paper, eqs. 10-21."""

    network: Literal["paper"] = "paper"
    width: int = Field(default=64, ge=2)
    layers: int = Field(default=3, ge=1)
    derivative: Literal["total", "partial"] = Field(
        default="total",
        description="time derivative of the outputs: along the solution, or over the input t alone, which is "
        "a research option",
    )
    phi_data: float = Field(default=1.0, gt=0.0, description="weight of the two force losses")
    phi_phys: float = Field(default=1.0, gt=0.0, description="weight of the three losses of the law")
    learning_rate: float = Field(default=3e-3, gt=0.0)
    samples: int = Field(default=2048, ge=16, description="samples in one batch")
    adam_steps: int = Field(default=4000, ge=0)
    lbfgs_steps: int = Field(default=200, ge=0)


def _rename_network(document: Any) -> Any:
    """Replace a former name of the network."""
    if isinstance(document, Mapping) and "network" in document:
        network = document["network"]
        return {**document, "network": FORMER_NETWORKS.get(str(network), network)}
    return document


PinnSettings = ElementSettings | DenseSettings | PaperSettings
"""Settings of one of the networks."""
_SETTINGS_ADAPTER: TypeAdapter[PinnSettings] = TypeAdapter(
    Annotated[Annotated[PinnSettings, Field(discriminator="network")], BeforeValidator(_rename_network)]
)


def list_presets() -> list[str]:
    """Return the names of the presets that ship with the product."""
    return sorted(path.stem for path in PRESETS.glob("*.json"))


def rename_preset(preset: str) -> str:
    """Return the present name of a preset; other names and paths are returned as they are."""
    return FORMER_NETWORKS.get(preset, preset)


def read_settings(preset: str | Path) -> PinnSettings:
    """Read a preset by its name, or settings from a JSON file.

    Raises:
        IdentificationError: there is no such preset or file, or its content is invalid.
    """
    name = rename_preset(str(preset))
    path = PRESETS / f"{name}.json" if name in list_presets() else Path(preset)
    try:
        return _SETTINGS_ADAPTER.validate_json(path.read_bytes())
    except OSError as error:
        known = ", ".join(list_presets())
        raise IdentificationError(f"{preset}: neither a preset ({known}) nor a file that can be read") from error
    except ValidationError as error:
        raise IdentificationError(
            f"{path}: invalid settings of a network ({describe_validation_error(error)})"
        ) from error
