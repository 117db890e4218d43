# Everything runs in .venv of the checkout; the first target that needs it makes it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# one thread by default: the machine may be shared, and results do not depend on it
export OMP_NUM_THREADS ?= 1
# processes of the tests and of the verification table
JOBS ?= 2

.PHONY: demo test verify bench lint clean

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet -e ".[dev]"
	touch $@

demo: $(VENV)/installed  ## install, run the paper's Example 1 and the frictional upsetting, compare with the references
	$(BIN)/python examples/demo.py

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/mypy

test: lint  ## lint, types, and the whole test suite
	$(BIN)/python -m pytest -n $(JOBS)

verify: $(VENV)/installed  ## the verification table, every case against its reference
	$(BIN)/prensa verify --jobs $(JOBS)

bench: $(VENV)/installed  ## benchmarks/RESULTS.md: against the factorisations alone, CalculiX, felupe; three quarters of an hour
	$(BIN)/python benchmarks/run.py

clean:
	rm -rf $(VENV) results .pytest_cache .mypy_cache .ruff_cache
