PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

FAULT_ROWS := runs/faults.jsonl

.PHONY: setup run test check unit alone again faults docs site benchmark blind clean

setup: $(READY)

$(READY): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("rths needs Python 3.11 or newer; say which with PYTHON=...") if sys.version_info < (3, 11) else None'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --no-index -e .
	$(BIN)/python -m models.warm
	@touch $(READY)

run: setup
	$(BIN)/rths run

check: setup
	$(BIN)/lint-imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

test: check unit alone

UNIT := -n 2 -m "not alone"
UNIT_CACHE := .pytest_cache/unit

unit: setup
	@rm -f $(UNIT_CACHE)/passed
	$(BIN)/pytest -o cache_dir=$(UNIT_CACHE) $(UNIT)
	@touch $(UNIT_CACHE)/passed

# one worker: nothing else is measured meanwhile, and where a test hangs beyond reach the others get another
ALONE := -n 1 -m alone tests/docs tests/system
ALONE_CACHE := .pytest_cache/alone

alone: setup
	@rm -f $(ALONE_CACHE)/passed
	$(BIN)/pytest -o cache_dir=$(ALONE_CACHE) $(ALONE)
	@touch $(ALONE_CACHE)/passed

again: check
	test -f $(UNIT_CACHE)/passed || $(BIN)/python -m tests.again $(UNIT_CACHE) $(UNIT)
	test -f $(ALONE_CACHE)/passed || $(BIN)/python -m tests.again $(ALONE_CACHE) $(ALONE)

FAULT_TESTS := tests/system/faults tests/system/test_recording_faults.py tests/system/test_security.py

faults: setup
	mkdir -p runs
	rm -f $(FAULT_ROWS)
	RTHS_FAULT_INTERVAL=0.002 RTHS_FAULT_ROWS=$(CURDIR)/$(FAULT_ROWS) $(BIN)/pytest tests/faults $(FAULT_TESTS)
	$(BIN)/python -m tests.faults.rows $(FAULT_ROWS) docs/reference/faults.md

docs: setup
	$(BIN)/python -m docs.generate
	test ! -f $(FAULT_ROWS) || $(BIN)/python -m tests.faults.rows $(FAULT_ROWS) docs/reference/faults.md

site: docs
	$(BIN)/python -m mkdocs build --strict --quiet

benchmark: setup
	$(BIN)/python -m benchmarks

blind: setup
	$(BIN)/rths blind --cases 300 --jobs 2 -o runs/blind

clean:
	rm -rf .venv build runs site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
