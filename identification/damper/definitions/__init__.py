"""Effects of the user's own: files that define them, expressions, and the library that includes them."""

from identification.damper.definitions.defined_effect import (
    ACTIONS,
    CURVE,
    DEFINED_ACTIONS,
    DEFINED_FORM,
    DefinedFunction,
    find_action,
    find_effect_file,
    make_effect,
)
from identification.damper.definitions.effect_file import (
    STAGE_OF,
    VARIABLES_AT,
    Curve,
    EffectFile,
    EffectParameter,
    FunctionKind,
    is_elongation,
    parse_effect_file,
)
from identification.damper.definitions.expression import Expression, Instruction
from identification.damper.definitions.library import (
    check_new_name,
    find_effect_folder,
    load_effects,
    read_effect_files,
    write_effect_file,
)

__all__ = [
    "ACTIONS",
    "CURVE",
    "DEFINED_ACTIONS",
    "DEFINED_FORM",
    "STAGE_OF",
    "VARIABLES_AT",
    "Curve",
    "DefinedFunction",
    "EffectFile",
    "EffectParameter",
    "Expression",
    "FunctionKind",
    "Instruction",
    "check_new_name",
    "find_action",
    "find_effect_file",
    "find_effect_folder",
    "is_elongation",
    "load_effects",
    "make_effect",
    "parse_effect_file",
    "read_effect_files",
    "write_effect_file",
]
