# Needs python3 (3.11 or newer, with venv) and make; everything else goes into .venv.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: paper test notebooks proofs mutants fuzz bench lint clean

paper: .venv/installed
	$(BIN)/peakmin paper --out out

# the notebooks are run in copies; tests/whole/test_notebooks.py holds these against what is committed
test: .venv/installed lint
	rm -rf out/notebooks && mkdir -p out && cp -r notebooks out/
	$(BIN)/pytest -n 2 -p no:benchmark --nbmake --overwrite out/notebooks
	$(BIN)/pytest -n 2 --dist worksteal -p no:benchmark -m uncounted
	$(BIN)/pytest -n 2 --dist worksteal -p no:benchmark -m "not uncounted" --cov=peakmin --cov-report=term:skip-covered

notebooks: .venv/installed
	$(BIN)/python notebooks/remake.py notebooks/*.ipynb

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# all seeds, 500 random maneuvers, 300 random scenes and 120 tasks of arms, where `make test` takes some
proofs: .venv/installed
	PEAKMIN_SEEDS=all $(BIN)/pytest -n 2 --dist worksteal -p no:benchmark tests/proofs/test_agreement.py tests/proofs/test_exact.py tests/proofs/test_proof.py tests/search/test_scenes.py tests/search/test_arm_tasks.py tests/spec/test_limits.py

# spoils the code of the proofs in one place after the other: each time a test must fail
mutants: .venv/installed
	$(BIN)/python -m tests.mutants

# 21000 files of hostile bytes, broken specs and broken plans, others every time; `make fuzz SEED=7` has those of seed 7
fuzz: SEED ?= $(shell date +%s)
fuzz: .venv/installed
	PEAKMIN_FUZZ=21000 PEAKMIN_FUZZ_SEED=$(SEED) $(BIN)/pytest -n 2 --dist worksteal -p no:benchmark tests/whole/test_fuzz.py

bench: .venv/installed
	$(BIN)/python benchmarks/table.py

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[dev,bench,sim,dask,parquet]"
	touch $@

clean:
	rm -rf .venv out
