# Every target sets up .venv by itself; `make help` lists them.

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
ARGS ?=

.PHONY: help run test test-long test-faults lint format bench docs fidelity update-goldens clean test-bounds endurance

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

run: $(STAMP) ## train and evaluate the TalkItOut agent; more options in ARGS="--frames 50000"
	$(BIN)/socialai-run scenarios/talkitout.yaml $(ARGS)

test: $(STAMP) ## run the tests
	$(BIN)/python -m pytest $(ARGS)

test-long: $(STAMP) ## run the tests that take minutes
	$(BIN)/python -m pytest -m slow $(ARGS)

test-faults: $(STAMP) ## lose workers, nodes and the command of an experiment; installs Ray submitit PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[ray,slurm]' pytest "slow or not slow" tests/socialai_dsl/experiments $(ARGS) test-bounds: run engine's tests with bounds checks, guard cells around every array, one after another NUMBA_BOUNDSCHECK=1 --guards tests/socialai_dsl/engine tests/socialai_dsl/envs endurance: play 500 million steps all scenarios; watch memory, speed open files slow -s tests/test_endurance.py

lint: $(STAMP) ## check formatting, style and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: $(STAMP) ## rewrite the code in the house style
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(STAMP) ## measure the engine's speed on this machine
	$(BIN)/socialai bench $(ARGS)

fidelity: $(STAMP) ## compare the scenarios with the paper's code, under a random policy; writes docs/fidelity.md
	$(BIN)/socialai fidelity --write docs/fidelity.md $(ARGS)

docs: $(STAMP) ## build the pages of docs/ as a site, in build/site
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[docs]'
	$(BIN)/python -m sphinx -q -W -n --keep-going docs build/site

update-goldens: $(STAMP) ## rewrite the golden files; review the diff before committing it
	$(BIN)/python -m pytest --update-goldens $(ARGS)

clean: ## remove caches and builds; .venv and runs/ stay
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis build dist
	find socialai_dsl trainer tests -name __pycache__ -type d -prune -exec rm -rf {} +

# Locked versions bind the installation and, through the variable, the build tool as well.
$(STAMP): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[train,report,dev]'
	touch $@
