"""How the networks are trained: presets in JSON, read into frozen settings."""

from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from identification.errors import IdentificationError
from identification.pinn.activations import Activation

PRESETS = Path(__file__).parent / "presets"
"""Where the presets lie that ship with the product."""


Residual = Literal["points", "means", "weak"]
"""How the law is asked for in an element: at points, in the mean, or in the mean without the stroke's velocity."""


Features = Literal["slip", "time", "stroke"]
"""What an element is shown: time stretched around the breakthrough, from one turn of the slip to the next; plain
time in these elements; or time stretched by the turns of the stroke, as if no inner damper were known of."""
Group = Literal["motion", "drive", "time", "memory"]
"""Inputs of the global network that belong together."""
GROUPS: tuple[Group, ...] = get_args(Group)


class CommonSettings(BaseModel):
    """What every network is told."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    seed: int = Field(default=1, description="of weights, split and order of samples")
    validation_share: float = Field(
        default=0.2, ge=0.0, le=0.5, description="of the samples, in blocks, set aside"
    )
    take_back: bool = Field(default=True, description="end with the set-aside blocks fitted too")


class Level(BaseModel):
    """A part of the training with one weight of the law."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    physics: float = Field(gt=0.0, description="weight of the law's residuals against the force misfit")
    meshes: int = Field(ge=1, description="most times that the elements are placed anew")
    steps: int = Field(default=4, ge=1, description="most Gauss-Newton steps on one mesh")
    thin: int = Field(default=1, ge=1, description="every how many samples one is taken")
    held: tuple[str, ...] = Field(
        default=(), description="coordinates that wait: far from the solution they run off"
    )
    settled: float = Field(default=1e-4, description="in s: a level ends when no reversal moves by more")


class LayerSize(BaseModel):
    """How much the hidden layer can hold."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    units: int = Field(default=120, ge=8, description="of the hidden layer")
    rank: int = Field(default=36, ge=6, description="functions kept of them")
    points: int = Field(default=72, ge=8, description="per element where the law is asked for")


class LocalSettings(CommonSettings):
    """One hidden layer, linear heads in each half stroke."""

    network: Literal["local"] = "local"
    layers: tuple[LayerSize, ...] = Field(
        min_length=1, description="the hidden layer, and richer ones for as long as the law is not kept"
    )
    activation: Activation = Field(default="tanh", description="what a unit makes of its input")
    features: Features = Field(
        default="slip",
        description="input of an element: time stretched where the `slip` breaks through, plain `time`, or "
        "elements and input by the `stroke` in place of the slip",
    )
    kept: float = Field(
        default=5e-4,
        description="residual of the hysteresis, over the slip velocity at breakthrough, that is kept",
    )
    levels: tuple[Level, ...] = Field(description="of rising weight")
    residual: Residual = Field(
        default="means",
        description="the law at `points`, in `means` weighed with an element's functions, or `weak`: means in "
        "which the stroke's velocity is integrated by parts",
    )
    multipliers: int = Field(default=3, ge=0, description="steps of the method of multipliers at the end")
    starts: int = Field(default=8, ge=1, description="most starts")


class TorchSettings(CommonSettings):
    """What the networks are told that train on an accelerator too."""

    device: str = Field(default="cpu", description="`cpu`, or a torch device such as `cuda`")


class GlobalSettings(TorchSettings):
    """One ordinary network, all of its layers trained by Gauss-Newton."""

    network: Literal["global"] = "global"
    width: int = Field(default=20, ge=2, description="tanh units of each hidden layer")
    layers: int = Field(default=2, ge=1, description="hidden ones")
    features: tuple[Group, ...] = Field(
        default=GROUPS,
        min_length=1,
        description="inputs: `motion` and its products, the `drive` lagged, `time`, and the `memory` of where in "
        "its loop the hysteresis is",
    )
    samples: int = Field(default=3600, ge=100, description="in one batch")
    physics: tuple[float, float] = Field(default=(3.0, 30.0), description="first and last weight of the law")
    steps: int = Field(default=280, ge=10, description="of Gauss-Newton")


class PaperSettings(TorchSettings):
    """The network of the paper, eqs. 10-21."""

    network: Literal["paper"] = "paper"
    width: int = Field(default=64, ge=2)
    layers: int = Field(default=3, ge=1)
    derivative: Literal["total", "partial"] = Field(
        default="total", description="of the outputs: along the trajectory, or over the input t alone"
    )
    phi_data: float = Field(default=1.0, gt=0.0, description="weight of the two force losses")
    phi_phys: float = Field(default=1.0, gt=0.0, description="weight of the three losses of the law")
    learning_rate: float = Field(default=3e-3, gt=0.0)
    samples: int = Field(default=2048, ge=16, description="in one batch")
    adam_steps: int = Field(default=4000, ge=0)
    lbfgs_steps: int = Field(default=200, ge=0)


PinnSettings = Annotated[LocalSettings | GlobalSettings | PaperSettings, Field(discriminator="network")]
"""Settings of one of the networks."""
_ANY: TypeAdapter[LocalSettings | GlobalSettings | PaperSettings] = TypeAdapter(PinnSettings)


def preset_names() -> list[str]:
    """Presets that ship with the product."""
    return sorted(path.stem for path in PRESETS.glob("*.json"))


def read_settings(preset: str | Path) -> LocalSettings | GlobalSettings | PaperSettings:
    """A preset by its name, or settings from a JSON file.

    Raises:
        IdentificationError: there is no such preset or file, or it holds no settings.
    """
    path = PRESETS / f"{preset}.json" if str(preset) in preset_names() else Path(preset)
    try:
        return _ANY.validate_json(path.read_bytes())
    except OSError as error:
        known = ", ".join(preset_names())
        raise IdentificationError(f"{preset}: neither a preset ({known}) nor a file that can be read") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the file"
        raise IdentificationError(f"{path}: no settings of a network ({place}: {first['msg'][:80]})") from error
