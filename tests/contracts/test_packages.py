"""Structure of the packages: public names, number of modules, and which package starts processes."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOTS = ("bench", "drivers", "identification", "sim_rig", "benchmarks")
MOST_MODULES = 14
TABLES = {"identification/damper/effects", "sim_rig/effect_forms", "bench/catalogue/migrations/versions"}
"""Packages that hold one module for each effect, or for each revision of the tables, which stays forever."""
PACKAGES = sorted(
    path.parent.relative_to(ROOT).as_posix() for root in ROOTS for path in (ROOT / root).rglob("__init__.py")
)


def modules(package):
    return [path for path in (ROOT / package).glob("*.py") if path.name not in ("__init__.py", "__main__.py")]


def exported(package):
    """Return the names in ``__all__``, and the names that ``__init__.py`` binds."""
    tree = ast.parse((ROOT / package / "__init__.py").read_text("utf-8"))
    listed = None
    bound = set()
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names = {target.id for target in targets if isinstance(target, ast.Name)}
        if "__all__" in names:
            listed = ast.literal_eval(node.value)
        bound |= names
        if isinstance(node, ast.Import | ast.ImportFrom):
            bound |= {alias.asname or alias.name for alias in node.names}
    return listed, bound


def test_there_are_packages():
    assert len(PACKAGES) > 40


@pytest.mark.parametrize("package", PACKAGES)
def test_the_public_names_of_a_package_exist(package):
    listed, bound = exported(package)
    assert listed is not None, f"{package}/__init__.py has no __all__"
    assert set(listed) <= bound


@pytest.mark.parametrize("package", [p for p in PACKAGES if p not in TABLES])
def test_a_package_has_few_modules(package):
    assert len(modules(package)) <= MOST_MODULES


@pytest.mark.parametrize("root", ROOTS)
def test_every_folder_with_modules_is_a_package(root):
    folders = {path.parent for path in (ROOT / root).rglob("*.py")}
    assert all((folder / "__init__.py").is_file() for folder in folders)


def test_identification_starts_no_process():
    """The bench starts identification; the other direction would be a cycle that no import shows."""
    starting = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "identification").rglob("*.py")
        if "subprocess" in path.read_text("utf-8")
    ]
    assert starting == []
