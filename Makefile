# Everything runs in .venv of the checkout; the first target that needs it makes it.
VENV := .venv
ifeq ($(OS),Windows_NT)
PYTHON ?= python
BIN := $(VENV)/Scripts
# pages and messages have Greek letters, and the encoding of Windows has not
export PYTHONUTF8 := 1
else
PYTHON ?= python3
BIN := $(VENV)/bin
endif
# one thread by default: the machine may be shared, and results do not depend on it
export OMP_NUM_THREADS ?= 1
# processes of the tests and of the verification table
JOBS ?= 2

.PHONY: demo lint test suite slow pardiso coverage verify bench docs package clean examples

$(VENV)/installed: pyproject.toml quality/pyproject.toml
	@echo "installing into $(VENV): once, about a minute"
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --upgrade pip
	$(BIN)/python -m pip install -e ".[dev]" -e quality
	$(BIN)/python -c "open('$@', 'w').close()"

demo: $(VENV)/installed  ## install, run the paper's Example 1 and the frictional upsetting, compare with the references
	$(BIN)/python examples/demo.py

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/mypy

# types are checked while tests run: without its cache, in a fresh clone, mypy keeps one core busy for most of a minute
test: $(VENV)/installed  ## lint, types, and the tests, but for those that take long
	$(MAKE) --jobs 2 lint suite

suite: $(VENV)/installed
	$(BIN)/python -m pytest -n $(JOBS) -m "not slow"

slow: $(VENV)/installed  ## the tests that take long: campaigns of random problems, killed runs, guards switched off
	$(BIN)/python -m pytest -n $(JOBS) -m slow

# in an environment of its own, since `solver: auto` takes PARDISO wherever it is installed. Left out is a test that compares
# derivatives with differences of 1e-9 of a force, which PARDISO's last digits are worth
pardiso: pyproject.toml quality/pyproject.toml  ## tests of contact and of the solver with PARDISO (0.9 GB more) instead of rslab
	$(PYTHON) -m venv $(VENV)-pardiso
	$(VENV)-pardiso/$(notdir $(BIN))/python -m pip install -e ".[dev,mkl]" -e quality
	$(VENV)-pardiso/$(notdir $(BIN))/python -m pytest -n $(JOBS) tests/contact tests/solver tests/system tests/linear \
		--deselect "tests/solver/test_floating_bodies.py::test_derivatives_know_where_friction_begins[penalty-q4_fbar]"

# kernels run as machine code, out of sight of the measurement: they are left out (tool.coverage in pyproject.toml)
coverage: $(VENV)/installed  ## lines of src/prensa and quality that the test suite runs, kernels apart
	$(BIN)/python -m pytest -n $(JOBS) --cov --cov-report=term:skip-covered $(TESTS)

examples: $(VENV)/installed  ## the gallery of forming processes, each compared with an independent solution; some minutes
	$(BIN)/python examples/gallery.py --jobs $(JOBS)

verify: $(VENV)/installed  ## the verification table, every case against its reference
	$(BIN)/prensa verify --jobs $(JOBS) --out results/verification-table.md

bench: $(VENV)/installed  ## benchmarks/RESULTS.md: against the factorisations alone, CalculiX, felupe; half an hour
	$(BIN)/python benchmarks/run.py

$(VENV)/docs: pyproject.toml $(VENV)/installed
	$(BIN)/python -m pip install --quiet -e ".[docs]"
	$(BIN)/python -c "open('$@', 'w').close()"

docs: $(VENV)/docs  ## the documentation site, in site/, with the table of the last `make verify`; any warning fails it
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

package: $(VENV)/installed  ## wheels and sdists of both distributions in dist/, tried in a clean environment and an empty folder
	$(BIN)/python .ci/package.py

clean:
	rm -rf $(VENV) $(VENV)-pardiso results site dist .coverage .pytest_cache .mypy_cache .ruff_cache
