"""Links, paths and commands in the documentation exist, and generated parts are up to date."""

import re
import tomllib
from importlib.metadata import entry_points
from importlib.util import find_spec

import pytest

from bench.config import BenchConfig
from bench.safety.limits import Action
from tests.support import blocks
from tests.support.reference import generator

HIDDEN = {".venv", "node_modules", "build", "runs"}
ALL_PAGES = [p for p in sorted(blocks.ROOT.rglob("*.md")) if not HIDDEN & set(p.relative_to(blocks.ROOT).parts)]
GENERATED = [
    p for p in sorted(blocks.ROOT.glob("docs/reference/*.md")) if "<!-- generated: " in p.read_text("utf-8")
]
PATH = re.compile(r"`((?:bench|benchmarks|docs|drivers|identification|sim_rig|tests)/[\w./*-]*\w)/?`")
CALL = re.compile(r"(?:^|`|\$ |&& )mrbench ([a-z]+)([^`|&;#]*?)(?=`|\||&|;|#|$)", re.MULTILINE)
"""Command and arguments of a call in a block or in the text."""
COMMAND_LINE = blocks.ROOT / "docs" / "reference" / "command-line.md"
COMMANDS = dict(
    re.findall(r"^```text\nmrbench (\w+) (.*?)```", COMMAND_LINE.read_text(), re.MULTILINE | re.DOTALL)
)
"""Usage of each command."""


def name(page):
    return str(page.relative_to(blocks.ROOT))


def anchors(page):
    headings = re.findall(r"^#+ (.+)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- /]", "", heading.lower()).replace(" ", "-").replace("/", "") for heading in headings}


@pytest.mark.parametrize("page", ALL_PAGES, ids=name)
def test_every_link_leads_somewhere(page):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for link in re.findall(r"\]\(([^)]+)\)", text):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f"{name(page)} links to {link}"
        assert not anchor or anchor in anchors(target), f"{name(page)} links to {link}"


@pytest.mark.parametrize("page", ALL_PAGES, ids=name)
def test_every_path_named_in_a_page_exists(page):
    for path in PATH.findall(page.read_text()):
        folders = (blocks.ROOT, page.parent)
        assert any(any(folder.glob(path)) for folder in folders), f"{name(page)} names {path}"


@pytest.mark.parametrize("page", ALL_PAGES, ids=name)
def test_every_module_run_by_a_page_exists(page):
    for module in re.findall(r"python -m ([a-z_.]+\w)", page.read_text()):
        assert find_spec(module), f"{name(page)} runs {module}"


@pytest.mark.parametrize("page", ALL_PAGES, ids=name)
def test_every_command_and_option_in_a_page_exists(page):
    for command, arguments in CALL.findall(page.read_text()):
        assert command in COMMANDS, f"{name(page)} calls mrbench {command}"
        for option in re.findall(r"(?<!\S)--[a-z][a-z-]*", arguments):
            known = f"{option} " in f"{COMMANDS[command]} --help " or f"[{option}]" in COMMANDS[command]
            assert known, f"{name(page)} calls mrbench {command} {option}"


@pytest.mark.parametrize("page", [p for p in ALL_PAGES if "docs" in p.parts], ids=name)
def test_every_page_of_the_documentation_is_reached_from_its_index(page):
    index = blocks.ROOT / "docs" / "index.md"
    assert page == index or str(page.relative_to(index.parent)) in index.read_text()


def test_most_pages_of_the_reference_have_generated_parts():
    assert len(GENERATED) == 7


@pytest.mark.parametrize("page", GENERATED, ids=name)
def test_generated_parts_of_the_reference_are_up_to_date(page):
    text = page.read_text()
    assert text == generator.fill_page(text), "run: python docs/generate_reference.py"


@pytest.mark.parametrize("command", sorted(entry.name for entry in entry_points(group="mrbench.commands")))
def test_every_command_is_in_the_reference(command):
    assert f"\n## {command}\n" in COMMAND_LINE.read_text()


@pytest.mark.parametrize("readme", sorted(blocks.ROOT.glob("*/**/README.md")), ids=name)
def test_a_package_is_described_in_at_most_sixty_lines(readme):
    if not HIDDEN & set(readme.relative_to(blocks.ROOT).parts):
        assert len(readme.read_text().splitlines()) <= 60


@pytest.mark.parametrize("decision", sorted(blocks.ROOT.glob("docs/decisions/*.md")), ids=name)
def test_a_decision_says_what_it_must_in_at_most_sixty_lines(decision):
    text = decision.read_text()
    assert len(text.splitlines()) <= 60
    for heading in ("## Context", "## Options", "## Decision", "## Consequences"):
        assert f"\n{heading}\n" in text


def test_the_pieces_of_bench_toml_in_the_how_to_make_a_bench():
    page = blocks.ROOT / "docs" / "how-to" / "connect-real-hardware.md"
    pieces = [block.text for block in blocks.blocks(page) if block.language == "toml"]
    config = BenchConfig.model_validate(tomllib.loads("\n".join(pieces)))
    assert len(config.instruments) == 5
    assert config.limits.make_limit_matrix()["force"][Action.TRIP] == 1500.0
