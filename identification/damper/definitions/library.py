"""Library of effects together with those of the user's own effect files.

The files lie in the folder that ``MRBENCH_EFFECTS`` names, else in the user's configuration folder.
"""

import os
import re
from collections.abc import Mapping
from pathlib import Path

from platformdirs import user_config_path

from identification.damper.definitions.defined_effect import make_effect
from identification.damper.definitions.effect_file import EffectFile, parse_effect_file
from identification.damper.effects import EFFECTS, Effect
from identification.errors import EffectFileError

_SUFFIX = ".json"


def find_effect_folder() -> Path:
    """Return the folder of the user's effect files; it may not exist."""
    named = os.environ.get("MRBENCH_EFFECTS")
    return Path(named) if named else user_config_path("mrbench") / "effects"


def read_effect_files(folder: Path | None = None) -> dict[str, EffectFile]:
    """Return the effect files of a folder by the names of their effects; of the user's folder if None.

    Raises:
        EffectFileError: a file cannot be read, is not valid, or has the name of another.
    """
    folder = folder or find_effect_folder()
    files: dict[str, EffectFile] = {}
    for path in sorted(folder.glob(f"*{_SUFFIX}")):
        try:
            file = parse_effect_file(path.read_bytes(), str(path))
        except OSError as error:
            raise EffectFileError(f"{path}: cannot be read ({error.strerror})") from error
        if file.name in files:
            raise EffectFileError(f"{path}: another file of this folder defines {file.name} too; rename one")
        files[file.name] = file
    return files


def load_effects(folder: Path | None = None) -> Mapping[str, Effect]:
    """Return the library's effects and the user's own, by name.

    Raises:
        EffectFileError: as `read_effect_files` does.
    """
    return {**EFFECTS, **{name: make_effect(file) for name, file in read_effect_files(folder).items()}}


def check_new_name(name: str) -> None:
    """Check that a name can be given to a new effect.

    Raises:
        EffectFileError: the name is not one of small letters and underscores, or there is an effect of this name.
    """
    if not re.fullmatch(r"[a-z_]{1,40}", name):
        raise EffectFileError(f"{name!r} cannot be the name of an effect: give 1 to 40 of a-z and _")
    if name in load_effects():
        raise EffectFileError(f"there is an effect {name} already; choose another name")


def write_effect_file(file: EffectFile, folder: Path | None = None) -> Path:
    """Write an effect file into a folder, the user's if None, and return its path.

    Raises:
        EffectFileError: there is an effect of this name, the file cannot be written, or another file of the folder
            is not valid.
    """
    folder = folder or find_effect_folder()
    path = folder / f"{file.name}{_SUFFIX}"
    if path.exists() or file.name in read_effect_files(folder):
        raise EffectFileError(f"{path}: there is an effect {file.name}; choose another name or remove its file")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(file.model_dump_json(by_alias=True, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise EffectFileError(f"{path}: cannot be written ({error.strerror})") from error
    return path
