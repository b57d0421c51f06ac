"""Every block of README, tutorial and how-to is run, in the order of its page, as a reader would."""

import os

import pytest

from tests.support import blocks

RUNNABLE = ("sh", "console")


@pytest.mark.parametrize("page", blocks.PAGES, ids=lambda page: page.stem)
def test_every_block_of_the_page_works(page, folder, environment, log):
    found = blocks.blocks(page)
    assert any(block.language in RUNNABLE and block.mark != "not run" for block in found)
    for block in found:
        blocks.carry_out(block, folder, environment, log)


@pytest.mark.parametrize("page", blocks.PAGES, ids=lambda page: page.stem)
def test_a_block_that_is_not_run_has_a_reason(page):
    for block in blocks.blocks(page):
        assert block.mark != "not run" or len(block.argument) > 10


def test_a_block_gets_the_log_that_was_recorded_before(tmp_path):
    log = tmp_path / "recorded.mcap"
    log.write_text("recorded")
    text = "mrbench run quick --scenario default --out a.mcap\nmrbench run quick --scenario default --out b.mcap\n"
    blocks.carry_out(blocks.Block("sh", text, "", ""), tmp_path, {"PATH": os.environ["PATH"]}, log)
    assert [(tmp_path / name).read_text() for name in ("a.mcap", "b.mcap")] == ["recorded", "recorded"]


@pytest.mark.parametrize(
    ("output", "expected", "same"),
    [
        ("a.mcap: 100 samples", "a.mcap: 100 samples", True),
        ("a.mcap: 103 samples", "a.mcap: 100 samples", True),
        ("a.mcap: 120 samples", "a.mcap: 100 samples", False),
        ("first\nand more\nlast", "first\n...\nlast", True),
        ("first\nand more", "first", False),
    ],
)
def test_an_output_is_compared_with_the_expected_one(output, expected, same):
    assert blocks.is_expected(output, expected) is same
