# `make demo` computes and draws the main result, `make test` checks everything; both set up .venv themselves.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

# One thread for the numerical libraries: tables are then bitwise equal from run to run.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

# An interpreter that is named must be the one that the environment has.
ifneq ($(origin PYTHON),file)
ifeq ($(filter clean,$(MAKECMDGOALS)),)
HAS := $(shell sed -nE 's/^version(_info)? = ([0-9]+[.][0-9]+).*/\2/p' $(VENV)/pyvenv.cfg 2>/dev/null)
WANTED := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')
ifneq ($(filter-out $(WANTED),$(HAS)),)
$(error $(VENV) has Python $(HAS), but $(PYTHON) is $(or $(WANTED),not there); run 'make clean' first, or leave PYTHON out)
endif
endif
endif

.PHONY: demo test test-slow lint format bench reproduce docs clean

demo: $(VENV)/installed
	$(BIN)/fracctl run experiment=ic1_outofplane

test: lint
	$(BIN)/pytest --numprocesses=auto --maxprocesses=4 -m "not slow"

test-slow: $(VENV)/installed-test
	$(BIN)/pytest --numprocesses=auto --maxprocesses=4 -m slow

lint: $(VENV)/installed-test
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

format: $(VENV)/installed-test
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

bench: $(VENV)/installed-bench
	$(BIN)/python -m benchmarks

reproduce: $(VENV)/installed
	$(BIN)/fracctl reproduce

# The tables of what is reproduced are part of the documentation; stored runs are used again.
docs: $(VENV)/installed-docs
	@mkdir -p docs/_generated
	$(BIN)/fracctl reproduce --json > docs/_generated/reproduction.jsonl
	$(BIN)/sphinx-build -W -q docs docs/_build
	@echo docs/_build/index.html

clean:
	rm -rf $(VENV) build dist docs/_build docs/_generated .mypy_cache .pytest_cache .ruff_cache .hypothesis

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "fracctl needs Python 3.11 or newer: name one, e.g. make PYTHON=python3.11 $(MAKECMDGOALS)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

# The stamps renew an installation when pyproject.toml has changed; sources are used in place.
$(VENV)/installed: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable .
	@touch $@

$(VENV)/installed-test: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-bench: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[bench]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-docs: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	@touch $@ $(VENV)/installed
