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

help: ## list all targets
	@awk -F ':.*## ' '/^[a-z]+:.*## /{printf "make %-8s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

venv: $(BIN)/.ready ## create a virtual environment with all packages for the tests

$(BIN)/.ready: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

test: venv ## create the virtual environment, then run `make check`
	$(MAKE) check

check: ## check format, lint, types and import contracts, and run the fast tests
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy --num-workers $(WORKERS)
	$(BIN)/lint-imports
	$(BIN)/pytest -n $$(($(WORKERS) + 1)) --dist worksteal -m "not slow" # one more than cores: some wait, for a browser or a clock

docs: venv ## build the documentation site in build/site
	$(BIN)/python -m website

format: ## format the code and fix lint errors
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

slow: ## run the slow tests
	$(BIN)/pytest -m slow

fuzz: ## run the property tests with many more random missions, edits, command lines and formulas
	MISSIONC_FUZZ=200000 $(BIN)/pytest -q --timeout 0 tests/properties/frontend/test_mutated_missions.py
	MISSIONC_FUZZ=10000 $(BIN)/pytest -q --timeout 0 tests/properties/tools/test_lsp_typing.py
	MISSIONC_FUZZ=5000 $(BIN)/pytest -q --timeout 0 tests/properties/verification/test_verdict_table.py tests/properties/verification/test_interval_robustness.py
	MISSIONC_FUZZ=2000 $(BIN)/pytest -q --timeout 0 tests/properties/project/test_whole_language.py
	MISSIONC_FUZZ=5000 $(BIN)/pytest -q --timeout 0 tests/properties/cli/test_hostile_commands.py

farm: ## search for defects with random trials for MINUTES=10; continue the last run, and save findings in tests/corpus/found
	$(BIN)/python -m farm --minutes $(MINUTES)

$(BIN)/.mutants: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev,mutants]'
	touch $@

mutants: $(BIN)/.mutants ## run mutation tests of the verifier; continue the last run. MODULE=missionc/ir/kernel selects a part, SAMPLE=400 SEED=1 a random sample of each package
	OMP_NUM_THREADS=1 $(BIN)/python -m tests.mutation --workers $(WORKERS) $(if $(SAMPLE),--sample $(SAMPLE)) $(if $(SEED),--seed $(SEED)) $(MODULE)

bench: ## run all benchmarks of docs/performance.md
	for program in bench/*.py; do $(BIN)/python $$program || exit; done

gallery: ## rebuild docs/gallery.md and its pictures from missions/gallery
	$(BIN)/python docs/gallery.py

vscode: ## build the VS Code extension editors/vscode/dist/missionc.vsix (needs Node.js)
	cd editors/vscode && npm ci && npm run package

studio: ## build the script of the studio page, which is part of the repository (needs Node.js)
	cd editors/studio && npm ci && npm run build

$(BIN)/.release: pyproject.toml constraints.txt
	test -x $(BIN)/python || python3 -m venv $(VENV)
	$(BIN)/pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[release]'
	touch $@

dist: $(BIN)/.release ## build the wheel, the source archive and their hashes in dist, reproducibly
	rm -rf dist
	SOURCE_DATE_EPOCH=1580601600 $(BIN)/python -m hatchling build
	cd dist && sha256sum * | tee SHA256SUMS

lock: $(BIN)/.release ## update requirements.lock, the pinned packages of all user extras with hashes
	$(BIN)/pip-compile --quiet --generate-hashes --allow-unsafe --strip-extras --no-emit-index-url --no-emit-trusted-host --no-emit-find-links --no-header --no-annotate -c constraints.txt --extra $(USERS) -o requirements.lock pyproject.toml

sbom: $(BIN)/.release ## write a CycloneDX SBOM and the licences of requirements.lock in build; fail on an incompatible licence
	rm -rf build/sbom && python3 -m venv build/sbom && mkdir -p build
	build/sbom/bin/pip install --quiet --no-compile --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/cyclonedx-py environment --output-reproducible --pyproject pyproject.toml --output-format JSON --output-file build/sbom.cdx.json build/sbom/bin/python
	$(BIN)/pip-licenses --python build/sbom/bin/python --from mixed --format markdown --output-file build/licences.md
	$(BIN)/pip-licenses --python build/sbom/bin/python --from mixed --partial-match --fail-on '$(INCOMPATIBLE)' > /dev/null

clean: ## remove all build outputs
	rm -rf build dist mutants .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache editors/vscode/dist editors/vscode/node_modules editors/studio/node_modules
