# `make` alone lists what there is. The virtual environment is made on first use, and brought up to date when
# pyproject.toml or the pinned versions have changed. ARGS is passed on: make test ARGS="-k dronecan".

VENV := .venv
# The first of these that is new enough makes the environment; `make PYTHON=/path/to/python3` names another.
PYTHON := python3 python3.13 python3.12 python3.11
ARGS :=

export PIP_DISABLE_PIP_VERSION_CHECK := 1
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.NOTPARALLEL:
.PHONY: help demo hil test bench fuzz lint clean

help:
	@echo "make demo    the gateway against a simulated vehicle: weeds, a current, a net, a DVL that drifts"
	@echo "make hil     scripted faults on a simulated vehicle, judged: all scenarios that ship, and a report"
	@echo "make test    all tests; those of a real CAN bus on vcan0 or in a small virtual machine"
	@echo "make bench   the detectors beside their peers and the papers' figures"
	@echo "make fuzz    every parser under bytes that nobody would send, for minutes; the tests do it for seconds"
	@echo "make lint    ruff, mypy and the layers of the packages"
	@echo "make clean   remove what make has made, $(VENV) too"

demo: $(VENV)/installed-base
	@$(VENV)/bin/gateway demo $(ARGS)

hil: $(VENV)/installed-base
	@$(VENV)/bin/gateway hil play $(ARGS)

test: $(VENV)/installed-test
	@$(VENV)/bin/python -m pytest $(ARGS)

bench: $(VENV)/installed-bench
	@$(VENV)/bin/gateway bench $(ARGS)

fuzz: $(VENV)/installed-fuzz
	@$(VENV)/bin/python -m hil_tests.fuzz $(ARGS)

lint: $(VENV)/installed-lint
	@$(VENV)/bin/ruff check .
	@$(VENV)/bin/ruff format --check .
	@$(VENV)/bin/mypy
	@$(VENV)/bin/lint-imports

clean:
	rm -rf $(VENV) build dist *.egg-info .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +

# "base" is the project alone, every other name one of its extras. pip's warnings are for those who maintain this
# file (-q -q leaves the errors).
$(VENV)/installed-%: pyproject.toml .ci/constraints.txt $(VENV)/bin/python
	@echo "Installing into $(VENV), for make $(MAKECMDGOALS): a minute or two, the first time"
	@$(VENV)/bin/python -m pip install -q -q -c .ci/constraints.txt -e ".$(patsubst %,[%],$(filter-out base,$*))"
	@touch $@

$(VENV)/bin/python:
	@for python in $(PYTHON); do \
		if $$python -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
			exec $$python -m venv --clear $(VENV); \
		fi; \
	done; \
	echo "Python 3.11 or newer with its venv module is needed; looked at: $(PYTHON)." >&2; \
	echo "On Debian or Ubuntu, as root: apt-get install python3-venv (or python3.11-venv)." >&2; \
	echo "Or name another: make PYTHON=/path/to/python3" >&2; \
	exit 1
