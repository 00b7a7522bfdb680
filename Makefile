# Every command a contributor needs. `make` alone lists them.

VENV ?= .venv
WORKERS ?= 2
MINUTES ?= 10
BIN := $(VENV)/bin
USERS := cluster,export,graph,grammar,lsp,maps,sat,studio,sweep,viz
# What may not be given on together with code under Apache-2.0.
INCOMPATIBLE := GNU General Public License;GNU Affero;AGPL;GPL-2.0-only;GPL-2.0-or-later;GPL-3.0-only;GPL-3.0-or-later

# What is installed is compiled where it is first imported, which is a fraction of it: that has to be kept.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help venv test check docs format slow fuzz farm mutants bench gallery vscode studio dist lock sbom clean

help: ## list the commands
	@awk -F ':.*## ' '/^[a-z]+:.*## /{printf "make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

venv: $(BIN)/.ready ## a virtual environment with everything the tests need

$(BIN)/.ready: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

test: venv ## install what is needed, then everything `make check` does
	$(MAKE) check

check: ## format, lint, types, import contracts, tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy --num-workers $(WORKERS)
	$(BIN)/lint-imports
	$(BIN)/pytest -n $$(($(WORKERS) + 1)) --dist worksteal -m "not slow" # one more than cores: some wait, for a browser or a clock

docs: venv ## the documentation as a site, in build/site
	$(BIN)/python -m website

format: ## put the code in the one format
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

slow: ## the tests that take longer than a few seconds
	$(BIN)/pytest -m slow

fuzz: ## random missions through every command, mutated ones through `check`, command lines, edits and formulas, far more than in `make check`
	MISSIONC_FUZZ=200000 $(BIN)/pytest -q --timeout 0 tests/properties/frontend/test_mutated_missions.py
	MISSIONC_FUZZ=10000 $(BIN)/pytest -q --timeout 0 tests/properties/tools/test_lsp_typing.py
	MISSIONC_FUZZ=5000 $(BIN)/pytest -q --timeout 0 tests/properties/verification/test_verdict_table.py tests/properties/verification/test_interval_robustness.py
	MISSIONC_FUZZ=2000 $(BIN)/pytest -q --timeout 0 tests/properties/project/test_whole_language.py
	MISSIONC_FUZZ=5000 $(BIN)/pytest -q --timeout 0 tests/properties/cli/test_hostile_commands.py

farm: ## random trials of the compiler for MINUTES=10; goes on where it was, and keeps what it finds in tests/corpus/found
	$(BIN)/python -m farm --minutes $(MINUTES)

$(BIN)/.mutants: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev,mutants]'
	touch $@

mutants: $(BIN)/.mutants ## mutation testing of what judges; goes on where it was. MODULE=missionc/ir/kernel: a part; SAMPLE=400 SEED=1: so many of each package, drawn
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.mutation --workers $(WORKERS) $(if $(SAMPLE),--sample $(SAMPLE)) $(if $(SEED),--seed $(SEED)) $(MODULE)

bench: ## the measurements of docs/performance.md
	for program in bench/*.py; do $(BIN)/python $$program || exit; done

gallery: ## docs/gallery.md and its pictures, from missions/gallery
	$(BIN)/python docs/gallery.py

vscode: ## the extension for VS Code, as editors/vscode/dist/missionc.vsix; takes Node.js
	cd editors/vscode && npm ci && npm run package

studio: ## the script of the page of `missionc studio`, which is kept in the repository; takes Node.js
	cd editors/studio && npm ci && npm run build

$(BIN)/.release: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[release]'
	touch $@

dist: $(BIN)/.release ## the wheel and the sources, in dist, and their hashes: the same bytes wherever they are built
	rm -rf dist
	SOURCE_DATE_EPOCH=1580601600 $(BIN)/python -m hatchling build
	cd dist && sha256sum * | tee SHA256SUMS

lock: $(BIN)/.release ## requirements.lock: what the extras for users bring, each with its hashes
	$(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-emit-index-url --no-emit-trusted-host --no-emit-find-links --no-header --no-annotate -c constraints.txt --extra $(USERS) -o requirements.lock pyproject.toml

sbom: $(BIN)/.release ## a CycloneDX SBOM and the licences of what requirements.lock installs, in build; an incompatible licence fails
	rm -rf build/sbom && python3 -m venv build/sbom && mkdir -p build
	build/sbom/bin/pip install --quiet --no-compile --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/cyclonedx-py environment --output-reproducible --pyproject pyproject.toml --output-format JSON --output-file build/sbom.cdx.json build/sbom/bin/python
	$(BIN)/pip-licenses --python build/sbom/bin/python --from mixed --format markdown --output-file build/licences.md
	$(BIN)/pip-licenses --python build/sbom/bin/python --from mixed --partial-match --fail-on '$(INCOMPATIBLE)' > /dev/null

clean: ## remove what was built
	rm -rf build dist mutants .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache editors/vscode/dist editors/vscode/node_modules editors/studio/node_modules
