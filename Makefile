PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready

.PHONY: setup run test check benchmark blind clean

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

test: check
	$(BIN)/pytest -n 2 --ignore=tests/system
	$(BIN)/pytest tests/system

benchmark: setup
	$(BIN)/python -m benchmarks

blind: setup
	$(BIN)/rths blind --cases 300 --jobs 2 -o runs/blind

clean:
	rm -rf .venv build runs *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
