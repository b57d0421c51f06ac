# Everything a clean machine needs: Python 3.11, make and a C compiler. `make` alone shows the targets.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready

.PHONY: help install demo test wire check bench clean

help:
	@echo "make demo   records six voltages on the simulated rig, identifies the damper, writes the report"
	@echo "make test   style, types, import contracts and the test suite"
	@echo "make wire   the drivers against the simulated instruments over their real protocols"
	@echo "make check  style, types and import contracts only"
	@echo "make bench  the benchmarks, as ratios against baselines of the same run"

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

check: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: check
	$(BIN)/pytest -n 2

# In real time: what a busy machine has made late is tried once more, alone.
wire: $(READY)
	$(BIN)/pytest -m wire || $(BIN)/pytest -m wire --last-failed --last-failed-no-failures none

bench: $(READY)
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) runs build
