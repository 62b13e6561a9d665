# Everything a newcomer or a build machine needs: `make` lists it.

PYTHON ?= python3
ENV := .venv
PY := $(ENV)/bin/python
STAMP := $(ENV)/.installed

.DEFAULT_GOAL := help
.PHONY: help env demo test test-long lint types format bench golden clean

help: ## list these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

env: $(STAMP) ## make the environment in .venv (PYTHON=python3.12 to choose the interpreter)

# Installed anew only when the list of dependencies changes; an environment that does not run is remade.
$(STAMP): pyproject.toml
	@command -v $(PYTHON) > /dev/null || \
		{ echo "quilt needs Python 3.11 or newer, but there is no $(PYTHON); name one: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "quilt needs Python 3.11 or newer, but $(PYTHON) is $$($(PYTHON) -V); name another: make PYTHON=python3.12" >&2; exit 1; }
	@$(PY) -m pip --version > /dev/null 2>&1 || $(PYTHON) -m venv --clear $(ENV)
	$(PY) -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

demo: env ## render a short orbit and pictures of it
	$(PY) -m quiltcli render scenes/demo.yaml --overwrite

test: env lint types ## lint, types and all tests but the long ones
	$(PY) -m pytest -n 2

test-long: env ## the tests that take minutes
	$(PY) -m pytest -m long || test $$? -eq 5

lint: env ## ruff: mistakes and layout of the code
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .

types: env ## mypy, strict
	$(PY) -m mypy

format: env ## bring the code's layout in order
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

bench: env ## render the demo's first frames and show the seconds of each stage
	$(PY) -m quiltcli render scenes/demo.yaml --frames 1-3 --output out/bench --overwrite

golden: env ## make the golden pictures anew; look at the differences before committing them
	$(PY) -m pytest tests/test_golden.py --update-golden

clean: ## remove whatever make and the tests have made, the environment too
	rm -rf $(ENV) out scenes/out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
