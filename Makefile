# `make demo` and `make test` work on a machine that has only Python 3.11 to 3.13 and make.

VENV ?= .venv
# The Python that makes the environment; unset: the newest of python3.13 … python3 that runs.
PYTHON ?=
# Test processes side by side.
WORKERS ?= 2

CANDIDATES := $(or $(PYTHON),python3.13 python3.12 python3.11 python3)
BIN := $(VENV)/bin
STAMP := $(VENV)/installed.stamp
DOCS_STAMP := $(VENV)/installed-docs.stamp

.PHONY: help venv demo docs test lint format types layers unit harness bench fix

help:
	@echo "make demo    train MADyS on rover-t2-c1, five seeds, and write its report to runs/demo"
	@echo "make test    all checks: lint format types layers unit (each is a target too)"
	@echo "make docs    the documentation as a site in build/site, to be read offline"
	@echo "make harness damages folders, kills, fills disks, misuses the commands, at length; takes hours"
	@echo "make bench   environment steps per second, beside the peers that are installed"
	@echo "make fix     apply what lint and format would complain about, where that is mechanical"
	@echo "make venv    only make $(VENV) and install; every target above does that when needed"
	@echo "Options: PYTHON=<interpreter for a new environment> VENV=<folder> WORKERS=<test processes>"

venv: $(STAMP)

# A command of that name may exist and not run, and a Python may lack venv: so each is tried. An
# environment that works is kept and brought up to date; one that does not is made anew.
$(STAMP): pyproject.toml $(wildcard constraints/*.txt)
	@set -e; \
	fits='import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 14))'; \
	if ! "$(BIN)/python" -c "$$fits" >/dev/null 2>&1; then \
	  python=; \
	  for candidate in $(CANDIDATES); do \
	    if $$candidate -c "$$fits" >/dev/null 2>&1; then python=$$candidate; break; fi; \
	  done; \
	  if [ -z "$$python" ]; then \
	    echo "none of these is a Python 3.11 to 3.13 with venv: $(CANDIDATES); give PYTHON=<path>" >&2; \
	    exit 1; \
	  fi; \
	  if [ -e "$(VENV)/pyvenv.cfg" ]; then clear=--clear; else clear=; fi; \
	  $$python -m venv $$clear "$(VENV)"; \
	fi; \
	version=$$("$(BIN)/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	echo "installing skillcrew into $(VENV), Python $$version"; \
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check \
	  --constraint constraints/python-$$version.txt --editable '.[dev,evolution,interop,onnx]'; \
	touch "$(STAMP)"

demo: $(STAMP)
	$(BIN)/skillcrew train madys rover-t2-c1 --seeds 2000..2004 --steps 2e6 --out runs/demo

$(DOCS_STAMP): $(STAMP)
	@version=$$("$(BIN)/python" -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	echo "installing what builds the documentation into $(VENV)"; \
	"$(BIN)/python" -m pip install --quiet --disable-pip-version-check \
	  --constraint constraints/python-$$version.txt --editable '.[docs]'; \
	touch "$(DOCS_STAMP)"

docs: $(DOCS_STAMP)
	$(BIN)/python docs/site/pages.py
	$(BIN)/zensical build --strict --clean
	$(BIN)/python docs/site/offline.py
	@echo "open build/site/index.html"

test: lint format types layers unit

lint: $(STAMP)
	$(BIN)/ruff check .

format: $(STAMP)
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/ty check --python $(VENV)

layers: $(STAMP)
	$(BIN)/lint-imports

unit: $(STAMP)
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile --no-loadscope-reorder

# All of them, whatever comes of the first.
harness: $(STAMP)
	@status=0; \
	$(BIN)/python -m benchmarks.harness.damages || status=1; \
	$(BIN)/python -m benchmarks.harness.kills || status=1; \
	$(BIN)/python -m benchmarks.harness.disks || status=1; \
	$(BIN)/python -m benchmarks.harness.inputs || status=1; \
	$(BIN)/python -m benchmarks.harness.soak || status=1; \
	exit $$status

bench: $(STAMP)
	$(BIN)/python -m benchmarks.stepping

fix: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
