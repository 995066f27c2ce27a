# Everything a developer or a new user runs. PYTHON picks the interpreter for .venv; without it,
# the one that made .venv stays.
PYTHON ?= $(or $(shell cat .venv/made_by 2>/dev/null),python3)
BIN := .venv/bin

.PHONY: help venv demo balance test lint format bench docs clean

help:
	@echo "make demo      replay the bundled recording through the live graph; errors as a table"
	@echo "make balance   see a simulated robot balance on a page: push it, drive it"
	@echo "make test      run the tests; fail below the floor of coverage in pyproject.toml"
	@echo "make lint      check lint, format and types"
	@echo "make format    rewrite the sources in the project's format"
	@echo "make bench     measure speed and memory"
	@echo "make docs      build the documentation as a site, in site/"
	@echo "make venv      set up .venv (the others do it by themselves)"
	@echo "make clean     remove .venv and build products"

venv:
	@$(PYTHON) tools/make_venv.py

demo: venv
	@$(BIN)/python tools/demo.py

balance: venv
	@$(BIN)/python tools/balance.py

# What runs nodes in real time runs alone; everything else on two cores, its coverage measured.
REAL_TIME := test/nodes test/robustness test/dashboard test/hardware test/test_balance_tool.py test/test_demo.py
test: venv
	$(BIN)/python -m pytest -n 2 --dist loadfile --cov $(REAL_TIME:%=--ignore=%)
	$(BIN)/python -m pytest $(REAL_TIME)

lint: venv
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: venv
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

bench: venv
	@$(BIN)/python tools/run_benches.py

docs: venv
	$(BIN)/mkdocs build --strict

clean:
	rm -rf .venv site build install log dist *.egg-info
