# What one does with this project, one verb a job. `make run` and `make test` set up by themselves.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
SETUP := .venv/.set-up
# The wheel that carries the networks for hand landmarks, installed without its dependencies.
MODELS := app/pipeline/hand_landmarks/mediapipe.lock

.PHONY: run test check lint types borders format lock wheel clean help

help:            ## say what there is
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/ \t/'

run: $(SETUP)    ## start the server and a robot; prints the link to open
	$(BIN)/python -m app serve --data-dir .farhand $(ARGS)

# What keeps real time has the machine for itself; see tests/scheduling.py. Of some tests (ARGS) one
# of the two parts may be empty, which pytest tells by its code 5.
test: $(SETUP)   ## run all tests: those that compute side by side, then the live ones alone
	@tests() { $(BIN)/python -m pytest "$$@" $(ARGS) || test $$? = 5 || failed=yes; }; \
	tests -n 3 -m 'not live'; tests -m live; test -z "$$failed"

check: lint types borders ## linters, types and import borders

lint: $(SETUP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check

types: $(SETUP)
	$(BIN)/mypy

borders: $(SETUP)
	$(BIN)/lint-imports

format: $(SETUP) ## put the code into its form
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# The locks carry hashes and no addresses, so that any mirror serves.
EXPORT := --no-emit-project --no-header --format requirements-txt
lock: $(SETUP)   ## resolve the dependencies anew into the two lock files
	$(BIN)/uv lock --upgrade
	$(BIN)/uv export --quiet $(EXPORT) --no-default-groups --output-file requirements.lock
	$(BIN)/uv export --quiet $(EXPORT) --only-group dev --output-file requirements-dev.lock

wheel: $(SETUP)  ## build the wheel into dist/
	$(BIN)/python -m hatchling build -t wheel

clean:           ## remove what was made here
	rm -rf .venv dist

$(SETUP): requirements.lock requirements-dev.lock $(MODELS) pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
		{ echo "Farhand needs Python 3.11 (PyBullet has no wheels for newer ones); set PYTHON=/path/to/python3.11" >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	awk '/^[a-z]/ {uv = /^uv==/} uv' requirements-dev.lock > .venv/uv.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --no-deps -r .venv/uv.lock
	$(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes --no-deps \
		-r requirements.lock -r requirements-dev.lock
	$(BIN)/uv pip install --quiet --python $(BIN)/python --require-hashes --no-deps -r $(MODELS)
	$(BIN)/uv pip install --quiet --python $(BIN)/python --no-deps --no-build-isolation --editable .
	touch $@
