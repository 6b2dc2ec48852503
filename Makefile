# Everything runs in ./.venv; nothing outside this folder is touched.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
DEMO_READY := .venv/.demo-ready
DEMO := demo
# Compiled modules are kept: without them every test that starts a program compiles rig again.
unexport PYTHONDONTWRITEBYTECODE
WORKERS ?= 2
SEED ?= 1
PYTEST := $(BIN)/python -m pytest -q -n $(WORKERS) --dist loadgroup --no-loadscope-reorder

.DEFAULT_GOAL := help
.PHONY: help demo scan test test-all check format docs benchmarks mutants clean

help: ## Show what can be made
	@grep -E '^[a-z-]+:.*##' Makefile | sed 's/:.*## /\t/' | expand -t 14

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "rig needs Python 3.11 or newer, $(PYTHON) is %d.%d; call: make PYTHON=/path/to/python3.11" % sys.version_info[:2])'
	@$(PYTHON) -m venv .venv || { rm -rf .venv; $(PYTHON) -m venv --without-pip .venv && $(PYTHON) -m pip --python $(BIN)/python install pip; }

# The demo needs less than the developers do, so it installs less.
$(DEMO_READY): EXTRAS := sim,report
$(READY): EXTRAS := sim,report,parquet,oak,ros,foxglove,postgres,dev,docs
$(DEMO_READY) $(READY): pyproject.toml constraints.txt | $(BIN)/python
	@echo "installing rig into .venv (once; a few minutes on a slow line) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[$(EXTRAS)]'
	@touch $(DEMO_READY) $@

demo: $(DEMO_READY) ## Sweep the simulated rig, then measure depth with it
	@RIG_DATABASE=sqlite:///$(DEMO)/rig.sqlite RIG_CACHE_DIR=$(DEMO)/renders sh -e -c '\
	  mkdir -p $(DEMO); rm -rf $(DEMO)/depth; \
	  $(BIN)/rig sweep sim; \
	  $(BIN)/rig capture sim --frames 5 --out $(DEMO)/depth'
	@echo
	@echo "report:     $$(ls -td $(DEMO)/frames/sim/*/report.html | head -1)"
	@echo "depth maps: $(DEMO)/depth (last_frame.png is a picture to look at)"

scan: $(DEMO_READY) ## A light field from one simulated camera on a slider
	@RIG_DATABASE=sqlite:///$(DEMO)/scan/rig.sqlite RIG_CACHE_DIR=$(DEMO)/renders sh -e -c '\
	  mkdir -p $(DEMO)/scan; rm -rf $(DEMO)/scan/depth; \
	  $(BIN)/rig calibrate sim-scan --pictures 25 --set world.renderer=analytic; \
	  $(BIN)/rig sweep sim-scan --set world.renderer=analytic; \
	  $(BIN)/rig capture sim-scan --frames 1 --out $(DEMO)/scan/depth'
	@echo
	@echo "views:      $$(ls -td $(DEMO)/scan/scans/sim-scan/* | head -1)"
	@echo "depth map:  $(DEMO)/scan/depth (last_frame.png is a picture to look at)"

test: $(READY) ## Run the quick tests (about three minutes on two cores)
	@$(PYTEST) -m "not slow"

test-all: $(READY) ## Run every test
	@$(PYTEST)

check: $(READY) ## Format, lint, types, import rules, then the quick tests
	@$(BIN)/ruff format --check .
	@$(BIN)/ruff check .
	@$(BIN)/basedpyright --pythonpath $(BIN)/python
	@$(BIN)/lint-imports
	@$(MAKE) --no-print-directory test

format: $(READY) ## Rewrite the code in the house format
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

docs: $(READY) ## Build the site into build/docs; a warning or a dead link is an error
	@$(BIN)/python -m sphinx -q -W --keep-going -b html docs build/docs
	@echo "build/docs/index.html"

benchmarks: $(READY) ## Measure the numbers that README quotes
	@$(BIN)/python -m benchmarks

mutants: $(READY) ## Try 300 faults of the source and name those that no test notices (hours)
	@$(BIN)/python -m benchmarks.mutants --count 300 --seed $(SEED) --workers $(WORKERS)

clean: ## Remove the environment and everything the demo made
	rm -rf .venv $(DEMO) .pytest_cache .ruff_cache .hypothesis benchmarks/out
