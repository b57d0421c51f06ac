"""Places that the reference gives for common questions: they exist, and their paths carry the question's noun."""

import re

import pytest

from tests.support import blocks

PAGE = blocks.ROOT / "docs" / "reference" / "where.md"
DEEPEST = 3
"""Most components of a path."""
ROWS = re.findall(r"^\| (.+?) \| \[(.+?)\]\((.+?)\) \|", PAGE.read_text("utf-8"), re.MULTILINE)
NAMES = re.compile(r"`([a-z_/]+/[a-z_/.]+)`")


def test_ten_questions_have_a_place():
    assert len(ROWS) == 10


@pytest.mark.parametrize(("question", "path", "link"), ROWS, ids=[row[1] for row in ROWS])
def test_a_place_exists_and_its_name_contains_the_noun_of_the_question(question, path, link):
    assert (blocks.ROOT / path).exists()
    assert (PAGE.parent / link).resolve() == (blocks.ROOT / path).resolve()
    assert len(path.split("/")) <= DEEPEST
    nouns = re.findall(r"\*\*(.+?)\*\*", question)
    assert len(nouns) == 1
    assert nouns[0].replace(" ", "_") in path


@pytest.mark.parametrize("path", NAMES.findall(PAGE.read_text("utf-8")))
def test_paths_in_the_explanations_exist(path):
    assert (blocks.ROOT / path).exists()
