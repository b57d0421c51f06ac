# Everything a clean machine needs: Python 3.11, make and a C compiler. `make` alone shows the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
RESULTS := build/results
# CI sets this to --fail-on-skip: there, what the tests need is installed.
TEST_OPTIONS ?=
# The tests start hundreds of processes. Where no compiled modules may be written, each would compile them again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help install demo test unit wire check types contracts style coverage faults bench clean

help:
	@echo "make demo      hides an effect in the simulated damper, finds it from a recording, discloses the truth"
	@echo "make test      style, types, import contracts, all tests and the wire tests, one closing line"
	@echo "make unit      all tests but those on wires"
	@echo "make wire      the drivers against the simulated instruments over their real protocols"
	@echo "make check     style, types, import contracts and the structure of the packages"
	@echo "make coverage  branch coverage of all tests, wire tests counted"
	@echo "make faults    plants 100 faults and counts those that make a test fail"
	@echo "make bench     the benchmarks, as ratios against baselines of the same run"

$(READY): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable '.[dev]'
	@echo "trying it out: the first run and fit compile the simulation, once"
	@rm -rf build/first && mkdir -p build/first
	@$(BIN)/mrbench run quick --scenario default --out build/first/quick.mcap
	@$(BIN)/mrbench identify build/first/quick.mcap --out build/first/fit.json
	touch $@

install: $(READY)

demo: $(READY)
	$(BIN)/mrbench demo

# The three parts share two cores; the types take longest and begin first.
check: $(READY)
	@$(MAKE) --no-print-directory --jobs 2 types contracts style

types: $(READY)
	$(BIN)/mypy

contracts: $(READY)
	$(BIN)/lint-imports --no-cache
	$(BIN)/pytest -q tests/contracts/test_packages.py

style: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# Tests of processes run in real time: what a busy machine has made late is repeated alone, and named at the end.
# The tests of a file on wires stay together, because they share a bench. Only files with a mark are collected,
# because to import all of them takes half a minute.
find_marked = $(sort $(shell grep -rl --include='test_*.py' 'mark\.$(1)' tests))
WIRE = $(call find_marked,wire) tests/wire -m 'wire and not slow'
AGAIN := --last-failed --last-failed-no-failures none
unit: $(READY)
	@rm -rf $(RESULTS) && mkdir -p $(RESULTS)
	$(BIN)/pytest -n 2 --junitxml=$(RESULTS)/unit_1.xml $(TEST_OPTIONS) || \
		$(BIN)/pytest --junitxml=$(RESULTS)/unit_2.xml $(AGAIN) $(TEST_OPTIONS)

wire: $(READY)
	@mkdir -p $(RESULTS) && rm -f $(RESULTS)/wire*.xml
	$(BIN)/pytest -n 2 --dist loadfile $(WIRE) --junitxml=$(RESULTS)/wire_1.xml $(TEST_OPTIONS) || \
		$(BIN)/pytest $(WIRE) --junitxml=$(RESULTS)/wire_2.xml $(AGAIN) $(TEST_OPTIONS) || \
		$(BIN)/pytest $(WIRE) --junitxml=$(RESULTS)/wire_3.xml $(AGAIN) $(TEST_OPTIONS)

test: check unit wire
	@$(BIN)/pytest $(call find_marked,slow) -m slow --collect-only > $(RESULTS)/slow.txt || true
	@$(BIN)/python -m tests.summary $(RESULTS)/unit_*.xml $(RESULTS)/wire_*.xml --deselected $(RESULTS)/slow.txt

coverage: $(READY)
	$(BIN)/python -m benchmarks.quality.branch_coverage

faults: $(READY)
	$(BIN)/python -m benchmarks.quality.planted_faults

bench: $(READY)
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) runs build
