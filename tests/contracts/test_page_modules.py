"""Modules of the page: whatever one imports, the other one exports. A missing name would stop the whole page."""

import re
from pathlib import Path

import pytest

STATIC = Path(__file__).parents[2] / "bench" / "web" / "static"
MODULES = sorted(path for path in STATIC.rglob("*.js") if "vendor" not in path.parts)
_IMPORT = re.compile(r'^import \{([^}]*)\} from "(\.[^"]+)";', re.MULTILINE)
_EXPORT = re.compile(r"^export (?:async )?(?:function\*?|const|class|let) (\w+)", re.MULTILINE)
_EXPORT_LIST = re.compile(r"^export \{([^}]*)\}", re.MULTILINE)


def list_exports(module):
    text = module.read_text("utf-8")
    listed = (name.strip().split(" as ")[-1] for names in _EXPORT_LIST.findall(text) for name in names.split(","))
    return {*_EXPORT.findall(text), *filter(None, listed)}


@pytest.mark.parametrize("module", MODULES, ids=lambda path: str(path.relative_to(STATIC)))
def test_imported_names_are_exported(module):
    for names, source in _IMPORT.findall(module.read_text("utf-8")):
        imported = (module.parent / source).resolve()
        assert imported.is_file(), source
        if "vendor" not in imported.parts:
            wanted = {name.strip().split(" as ")[0] for name in names.split(",") if name.strip()}
            assert wanted <= list_exports(imported), source


def test_the_entry_imports_modules():
    assert len(_IMPORT.findall((STATIC / "app.js").read_text("utf-8"))) > 30
