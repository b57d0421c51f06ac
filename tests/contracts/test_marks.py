"""The Makefile finds files of marked tests by the words `mark.wire` and `mark.slow`."""


def test_make_finds_every_marked_test(left_out):
    assert left_out == []
