# Needs python3 (3.11 or newer, with venv) and make; everything else goes into .venv.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: paper test tests coverage notebooks proofs mutants fuzz bench lint figures clean

paper: .venv/installed
	$(BIN)/peakmin paper --out out

test: .venv/installed
	$(MAKE) --jobs=2 lint tests

tests: .venv/installed
	$(BIN)/pytest -n 2 --dist worksteal -p no:benchmark

# the same, with the lines of the package that they run counted
coverage: .venv/installed
	$(BIN)/pytest -n 2 --dist worksteal -p no:benchmark --cov=peakmin --cov-report=term:skip-covered

notebooks: .venv/installed
	$(BIN)/python notebooks/remake.py notebooks/*.ipynb

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# all seeds where `make test` takes some: 500 random maneuvers, 300 random scenes, 120 tasks of arms and more
proofs: .venv/installed
	PEAKMIN_SEEDS=all $(BIN)/pytest -n 2 --dist worksteal -p no:benchmark $$(grep -rlw --include='test_*.py' ALL tests)

# spoils the code of the proofs in one place after the other: each time a test must fail
mutants: .venv/installed
	$(BIN)/python -m tests.mutants

# 21000 files of hostile bytes, broken specs and broken plans, others every time; `make fuzz SEED=7` has those of seed 7
fuzz: SEED ?= $(shell date +%s)
fuzz: .venv/installed
	PEAKMIN_FUZZ=21000 PEAKMIN_FUZZ_SEED=$(SEED) $(BIN)/pytest -n 2 --dist worksteal -p no:benchmark tests/whole/test_fuzz.py

# how the code stands: circles, long functions and the like
figures: .venv/installed
	$(BIN)/python -m tests.figures

bench: .venv/installed
	$(BIN)/python benchmarks/table.py

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[dev,bench,sim,dask,parquet]"
	touch $@

clean:
	rm -rf .venv out
