# Two commands do all the set-up on a fresh machine with Python >= 3.11: `make study` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
OUT ?= results/office
# make study FRESH=1 computes again where results are there already

.PHONY: help study docs pages screens validate-experiments lint test test-slow test-all \
        wheel coverage covered-lines engine-truth faults test-exchange environments golden lock benchmark clean

# `python3` may be too old where a newer one is installed beside it.
$(BIN)/python:
	@for python in $(PYTHON) python3.14 python3.13 python3.12 python3.11; do \
	  if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then found=$$python; break; fi; \
	done; \
	if [ -z "$$found" ]; then echo "toppling needs Python >= 3.11: install it, or name it: make PYTHON=/path/to/python" >&2; exit 1; fi; \
	echo "making $(VENV) with $$($$found --version)"; \
	$$found -m venv $(VENV) || { echo "making $(VENV) failed (on Debian: apt install python3-venv)" >&2; exit 1; }

$(VENV)/installed: pyproject.toml | $(BIN)/python
	@echo "installing (half a minute, once)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable .
	@touch $@

$(VENV)/installed-dev: pyproject.toml | $(BIN)/python
	@echo "installing with the tools for tests (a minute, once)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@ $(VENV)/installed

$(VENV)/installed-docs: pyproject.toml | $(BIN)/python
	@echo "installing with the tools for the documentation (a minute, once)"
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	@touch $@ $(VENV)/installed

# the targets with what each is for: the comment above it
help:
	@awk '/^#/ { text = substr($$0, 3); next } /^[a-z][a-z0-9-]*:/ { split($$0, part, ":"); printf "make %-20s %s\n", part[1], text } { text = "" }' Makefile

# install into $(VENV), run the example study and write its report (FRESH=1 computes again)
study: $(VENV)/installed
	$(BIN)/toppling run studies/examples/office.toml --out $(OUT) $(if $(FRESH),--fresh)
	$(BIN)/toppling report $(OUT)/results.nc

# the documentation, docs/_build/html/index.html; a warning is an error
docs: $(VENV)/installed-docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html

# pages and figures that are computed: make pages NAME=walls, with FEW=1 a tenth of the motions; without NAME, all names
pages: $(VENV)/installed
	$(BIN)/python -m toppling.benchmarks.pages $(NAME) $(if $(FEW),--few)

# pictures of the live page in docs/tutorials/owner.md
screens: $(VENV)/installed-dev
	$(BIN)/python tests/support/owner.py

# docs/experiments.md: published tests beside blind predictions; TOPPLING_GRANITE=DIR names data outside
validate-experiments: $(VENV)/installed
	$(BIN)/python -m toppling.benchmarks.pages experiments

# ruff and mypy
lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@# mypy wants the package by its name, whatever this folder is called
	@mkdir -p $(VENV)/types && ln -sfn "$(CURDIR)" $(VENV)/types/toppling
	cd $(VENV)/types && ../bin/mypy --config-file toppling/pyproject.toml $(addprefix toppling/,core models motions fragility benchmarks studies)

# (whole runs of tests go to one process, which makes what they have in common once)
SHARED = -n auto --dist worksteal

# lint and all tests but the slow ones (some five minutes)
test: lint
	$(BIN)/python -m pytest $(SHARED) -m "not slow" tests

# the slow tests (twenty minutes)
test-slow: $(VENV)/installed-dev
	$(BIN)/python -m pytest $(SHARED) -m slow --durations=40 tests

# test and test-slow (half an hour)
test-all: test test-slow

# dist: a wheel for this platform, Python and numba that carries compiled code (six minutes; needs AVX-512)
wheel: $(VENV)/installed-dev
	PYTHON=$(BIN)/python .ci/wheel

# docs/runs/coverage.csv: coverage of intervals (half an hour; FULL=1: 1,000 studies per row)
coverage: $(VENV)/installed-dev
	$(BIN)/python -m toppling.benchmarks.coverage $(if $(FULL),--full) > $(VENV)/coverage.csv
	mv $(VENV)/coverage.csv docs/runs/coverage.csv

# (limits on time may fail while lines are counted: the tables are made all the same)
# tests/coverage.csv, the lines and branches that all tests reach, and which tests reach each of the sixty faults (an hour)
covered-lines: $(VENV)/installed-dev
	@rm -f $(VENV)/durations.tsv
	-COVERAGE_FILE=$(abspath $(VENV))/covered FAULTS_REPORT=$(abspath $(VENV))/durations.tsv PYTHONPATH=$(abspath tests/faults) \
	  $(BIN)/python -m pytest $(SHARED) -q -p fault_reports --cov --cov-config=tests/coverage.ini --cov-context=test \
	  --cov-report=json:$(VENV)/coverage.json tests
	$(BIN)/python tests/support/coverage_table.py $(VENV)/coverage.json tests/coverage.csv
	$(BIN)/python tests/faults/record.py $(VENV)/covered $(VENV)/durations.tsv

# which tests find each of the sixty faults: tests/faults (an hour)
faults: $(VENV)/installed-dev
	$(BIN)/python tests/faults/find.py --record --slow

# the engine's errors against the 40-digit truth, and a hash of all its numbers: the same before and after a rebuilding
engine-truth: $(VENV)/installed-dev
	$(BIN)/python tests/golden/engine_truth.py

# the lowest and the newest versions, other Pythons, the sdist beside other programs, the wheel (a quarter of an hour)
environments: | $(BIN)/python
	PYTHON=$(abspath $(BIN)/python) .ci/environments

# the versions of everything that is installed, with the hashes of their files
lock: $(VENV)/installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv pip compile --quiet --upgrade --universal --generate-hashes --no-annotate --python-version 3.11 \
	  --custom-compile-command 'make lock' --output-file requirements.lock pyproject.toml

# what differs between an old commit and the working tree: make golden OLD=COMMIT, and ONLY=PATTERN or PAIRS=1 (ten minutes)
golden: $(VENV)/installed-dev
	@test -n "$(OLD)" || { echo "make golden OLD=COMMIT: the commit to compare with is missing" >&2; exit 2; }
	$(BIN)/python tests/golden/run.py --old $(OLD) $(if $(ONLY),--only "$(ONLY)") $(if $(PAIRS),--pairs)

# Exported curves, read by the programs they are for: pelicun, and OpenQuake's own reader of NRML, each in an environment
# of its own (both ask for older libraries than ours). OpenQuake without what its reader does not need, GDAL above all.
EXCHANGE = $(VENV)/exchange

$(EXCHANGE)/pelicun/installed: | $(BIN)/python
	@echo "installing pelicun (a minute, once)"
	@$(BIN)/python -m venv $(@D)
	@$(@D)/bin/python -m pip install --quiet --disable-pip-version-check 'pelicun==3.10.*'
	@touch $@

$(EXCHANGE)/openquake/installed: | $(BIN)/python
	@echo "installing OpenQuake (a minute, once)"
	@$(BIN)/python -m venv $(@D)
	@$(@D)/bin/python -m pip install --quiet --disable-pip-version-check \
	  alpha_shapes decorator fiona h3 h5py numba pandas psutil pyproj pyzmq requests scipy shapely toml
	@$(@D)/bin/python -m pip install --quiet --disable-pip-version-check --no-deps 'openquake.engine==3.26.*'
	@touch $@

# exported files read by pelicun and OpenQuake
test-exchange: $(VENV)/installed $(EXCHANGE)/pelicun/installed $(EXCHANGE)/openquake/installed
	$(BIN)/python tests/support/exchange_set.py $(EXCHANGE)/files
	$(EXCHANGE)/pelicun/bin/python tests/support/exchange_pelicun.py $(EXCHANGE)/files
	$(EXCHANGE)/openquake/bin/python tests/support/exchange_openquake.py $(EXCHANGE)/files

# The engine beside its rivals: tables, figures and docs/performance.md (a command, not a test).
benchmark: $(VENV)/installed-dev
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[peers]'
	$(BIN)/python -m toppling.benchmarks --out docs

# remove $(VENV) and what was built
clean:
	if [ -f $(VENV)/pyvenv.cfg ]; then rm -rf $(VENV); fi
	rm -rf build dist *.egg-info .mypy_cache .ruff_cache .hypothesis
