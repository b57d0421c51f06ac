"""Words of the code and the documentation: everyday English, and docstrings that state what a thing is or does."""

import ast
import re

from tests.docs.test_pages import HIDDEN
from tests.support import blocks

PHRASES = (
    "anew",
    "whoever",
    "whyever",
    "swiftly",
    "in good order",
    "of its own accord",
    "hangs on",
    "nobody knows",
    "is no number",
    "is no log",
    "is no damper",
    "is no gap",
)
UNWANTED = re.compile(r"(?<!\bthere )\b(?:" + "|".join(PHRASES).replace(" ", r"\s+") + r")\b", re.IGNORECASE)
"""Not after "there": "there is no gap" is plain English."""
OPENINGS = re.compile(r"\s*(What|How|Whether|Who|Of)\b")
THIS = "tests/docs/test_words.py"
DOCUMENTS = "tests/contracts/documents_47f8566/"
EVIDENCE = "docs/evidence/"
TABLE_ROW = re.compile(r"^\|.*$", re.MULTILINE)


def list_files(*patterns):
    paths = (path.relative_to(blocks.ROOT) for pattern in patterns for path in blocks.ROOT.rglob(pattern))
    return [path.as_posix() for path in paths if not HIDDEN & set(path.parts) and path.as_posix() != THIS]


def read(name):
    """Return a file's text, without the tables of measurements in pages of evidence."""
    text = (blocks.ROOT / name).read_text("utf-8")
    return TABLE_ROW.sub("", text) if name.startswith(EVIDENCE) else text


def find_phrases(text):
    """Return line and words of each unwanted phrase."""
    return [(text.count("\n", 0, match.start()) + 1, match.group()) for match in UNWANTED.finditer(text)]


def find_openings(source):
    """Return line and first word of each docstring that opens as a question."""
    strings = (node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Expr))
    strings = (node for node in strings if isinstance(getattr(node.value, "value", None), str))
    matches = ((node.lineno, OPENINGS.match(node.value.value)) for node in strings)
    return [(line, match[1]) for line, match in matches if match]


def render(found):
    return "\n".join(f"{name}:{line}: {' '.join(word.split())}" for name, line, word in sorted(found))


def test_no_unwanted_phrase():
    names = [name for name in list_files("*.py", "*.md") if not name.startswith(DOCUMENTS)]
    found = [(name, line, word) for name in names for line, word in find_phrases(read(name))]
    assert not found, f"write these in plain words:\n{render(found)}"


def test_no_docstring_opens_as_a_question():
    found = [(name, line, word) for name in list_files("*.py") for line, word in find_openings(read(name))]
    assert not found, f"begin with a verb (functions) or a noun (everything else):\n{render(found)}"


def test_phrases_and_openings_are_found():
    assert find_phrases("a\nin good\norder, and there is no gap") == [(2, "in good\norder")]
    assert find_openings('"""Fine."""\nx = 1\n"""Whether so."""\n') == [(3, "Whether")]
