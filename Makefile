PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

FAULT_ROWS := runs/faults.jsonl
FAULT_TESTS := tests/faults tests/system/faults tests/system/test_recording_faults.py tests/system/test_security.py

# the tests start hundreds of interpreters, which find this checkout compiled, whatever the user's shell says of bytecode
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup run test long check slow faults soak matrix opensees fmi cluster docs site benchmark blind clean

setup: $(READY)

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("rths needs Python 3.11 or newer; say which with PYTHON=...") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --no-index -e .
	$(BIN)/python -m simulation.warm
	@touch $(READY)

run: setup
	$(BIN)/rths run

check: setup
	$(BIN)/lint-imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# kernels that a change has made outdated are compiled once, before every worker would compile each of them; the third
# worker computes while tests of another one wait for clocks and processes
test: setup
	$(BIN)/python -m simulation.warm
	$(BIN)/pytest -n 3 --dist worksteal -m "not long and not slow and not faults and not soak"

# whole diagnoses and trials of more than a second each, which give the same on any machine
long: setup
	$(BIN)/python -m simulation.warm
	$(BIN)/pytest -n 3 --dist worksteal -m long

# what takes long or needs a machine that does little else; one worker: where a test hangs beyond reach the others get another
slow: setup
	$(BIN)/pytest -n 1 -m slow

faults: setup
	$(BIN)/pytest -n 1 -m faults

soak: setup
	$(BIN)/pytest -n 1 -m soak

# all rows at the interval of a laboratory, on a machine that does nothing else, and their table
matrix: setup
	mkdir -p runs
	rm -f $(FAULT_ROWS)
	RTHS_FAULT_INTERVAL=0.002 RTHS_FAULT_ROWS=$(CURDIR)/$(FAULT_ROWS) $(BIN)/pytest $(FAULT_TESTS)
	$(BIN)/python -m tests.faults.rows $(FAULT_ROWS) docs/reference/faults.md

# the peer of some tests, which skip without it: it needs Python 3.11 and Debian's libblas3 and liblapack3
opensees: setup
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r opensees.lock

# what loads FMUs, and the peer of their tests, which skip without it
fmi: setup
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r fmi.lock

# what spreads work over the machines of a Dask cluster (--dask), and its tests, which skip without it
cluster: setup
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r cluster.lock

docs: setup
	$(BIN)/python -m docs.generate
	test ! -f $(FAULT_ROWS) || $(BIN)/python -m tests.faults.rows $(FAULT_ROWS) docs/reference/faults.md

site: docs
	$(BIN)/python -m mkdocs build --strict --quiet

benchmark: setup
	$(BIN)/python -m benchmarks

blind: setup
	$(BIN)/rths blind --cases 300 --jobs 2 -o runs/blind --force

clean:
	rm -rf .venv build runs site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
