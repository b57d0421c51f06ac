"""Wire files: the contract with each instrument as data, read by driver and simulated instrument."""

import tomllib
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).parent / "wire"
ACTUATOR_EDS = _FOLDER / "actuator.eds"
"""Electronic data sheet of the servo drive (CiA 306)."""


def load_wire_file(instrument: str) -> dict[str, Any]:
    """Return the content of ``wire/INSTRUMENT.toml``.

    Raises:
        OSError: there is no wire file of this instrument.
    """
    return tomllib.loads((_FOLDER / f"{instrument}.toml").read_text("utf-8"))
