# From a fresh clone: `make demo` shows the whole way, `make test` checks everything.
# Only Python >= 3.10 (PYTHON=... names another), make and git are needed.

PYTHON ?= python3
BIN := .venv/bin
WORKERS ?= 2

.PHONY: install live demo test docs package slow fuzz clean

install: .venv/installed

live: .venv/installed-ros

demo: .venv/installed
	$(BIN)/racecar demo --out demo --replace

test: .venv/installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	if $(BIN)/python -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then $(BIN)/mypy; \
		else echo "Types are not checked: NumPy's differ from version to version, those for Python 3.11 are meant."; fi
	$(BIN)/lint-imports
	$(BIN)/python tests/checks/unexplained_constants.py sensors mapping localization
	$(BIN)/pytest -n $(WORKERS) --no-loadscope-reorder

docs: .venv/installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict  # it is pinned below 2
	$(BIN)/python tests/checks/foreign_resources.py build/docs

package: .venv/installed-dev
	rm -rf dist
	$(BIN)/python -m build --outdir dist
	$(BIN)/twine check --strict dist/*

slow: .venv/installed-dev
	$(BIN)/pytest -m slow

fuzz: .venv/installed-dev
	$(BIN)/python -m tests.fuzz $(FUZZ)

.venv/installed: pyproject.toml
	$(PYTHON) -c 'import sys; sys.version_info >= (3, 10) or sys.exit("Python 3.10 or newer is needed.")'
	@echo "Installing into .venv; the first time this takes a few minutes."
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[full]'
	$(BIN)/python -m racecar.pipelines.commands.warm_up
	touch $@

.venv/installed-ros: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[ros]'
	touch $@

.venv/installed-dev: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev,ros]'
	touch $@

.venv/installed-docs: .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	touch $@

clean:
	rm -rf .venv build/docs dist demo fuzz
