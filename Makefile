# make site    the environment, the tool, the course in public/ and the manual in docs/public/
# make quick   the tests that need no browser, no lab engine and no whole site
# make test    all set-up, then the tests of a change, but for those that take long
# make test-all  with those, as continuous integration runs them
# make fuzz    inputs that nobody wrote, for TIME seconds
# make lock    the versions of all packages, and their hashes
# make help    the rest

PYTHON ?= python3
WORKERS ?= 2
PYTEST_ARGS ?=
TIME ?= 600

VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/uv pip install --quiet --python $(BIN)/python --compile-bytecode
# The packages of this repository that are installed from it.
OURS := coursebuild mjbench coursebuild-cluster coursebuild-mermaid coursebuild-tabs
SHELL := /bin/sh
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
# Compiled modules, and with them the compiled assertions of tests, are kept from run to run.
unexport PYTHONDONTWRITEBYTECODE

# What an installation depends on. It is editable: a change of Python code or of a template needs
# none. Folders are listed because they change when a file in them is removed.
BUILD_INPUTS := pyproject.toml mjbench/pyproject.toml requirements.lock hatch_build.py $(wildcard site/.npmrc site/*.json site/*.mjs site/*.py) \
  $(shell find site/css site/js 2>/dev/null)

# An environment does not outlive a move of its folder, whose path is in its scripts, nor the Python
# that it was made with.
ifneq ($(shell $(BIN)/python -c '' 2>/dev/null && cat $(VENV)/.made),$(CURDIR))
.PHONY: $(VENV)/.made
endif

.PHONY: help site pages release-files tag-check version serve quick test test-all test-slow test-oldest fuzz lint format types dist vscode lock npm system clean distclean

help:
	@echo 'make site       make the environment, install, build the course into public/, the manual into docs/public/'
	@echo 'make pages      build both anew, with their addresses, as they are published: into build/pages/'
	@echo 'make release-files  that, the packages, the extension: what a tag publishes, into build/release/'
	@echo 'make version    write VERSION=0.2.0 wherever the version stands, before a release'
	@echo 'make serve      the same, then serve it and rebuild on every change'
	@echo 'make quick      run the tests that need no browser, no lab engine and no whole site'
	@echo 'make test       do all set-up and run the tests, but for those that take long (PYTEST_ARGS=..., WORKERS=$(WORKERS))'
	@echo 'make test-all   the same with those that take long, as continuous integration does'
	@echo 'make test-slow  measure pages, look for leaks, try random cases that are new each time'
	@echo 'make test-oldest  run the quick tests with the oldest packages that the tool may be used with'
	@echo 'make fuzz       try inputs that nobody wrote for TIME=600 seconds; an hour before a release'
	@echo 'make lint       check style and formatting; make format mends what can be mended'
	@echo 'make types      check types, of Python and of JavaScript'
	@echo 'make vscode     try and make the extension for Visual Studio Code, in editors/vscode/dist/'
	@echo 'make dist       wheels and source distributions of all packages, in dist/'
	@echo 'make lock       lock what pyproject.toml newly asks for; UPGRADE=--upgrade: all, in newest versions'
	@echo 'make clean      remove what was built; make distclean also what was installed'

site: $(VENV)/.site
	$(BIN)/coursebuild build
	$(BIN)/coursebuild -C docs build

# What is published: the course, and in docs/ below it the manual. The manuals of earlier releases,
# which are kept as files of these, are taken from MANUALS and get folders of their own there.
PAGES := build/pages
MANUALS := build/manuals
RELEASE := build/release
pages: $(VENV)/.site
	rm -rf $(PAGES) build/sources
	mkdir -p build/sources
	git archive HEAD content docs lib matplotlibrc models runs | tar -x -C build/sources
	$(BIN)/python docs/release.py maps build/sources
	$(BIN)/coursebuild -C build/sources build --strict
	$(BIN)/coursebuild -C build/sources/docs build --strict
	mv build/sources/public $(PAGES)
	mv build/sources/docs/public $(PAGES)/docs
	$(BIN)/python docs/release.py manuals $(PAGES) $(MANUALS) $(RELEASE)

# All that a pushed tag publishes, from what is committed; a tag that is not the version is refused.
release-files: tag-check $(VENV)/.site
	rm -rf $(RELEASE)
	$(MAKE) pages dist vscode
	cp dist/* $(RELEASE)
	cp editors/vscode/dist/coursebuild.vsix $(RELEASE)/$$(basename dist/coursebuild-*.tar.gz .tar.gz).vsix
	$(BIN)/python docs/release.py notes $(RELEASE)

tag-check:
	$(PYTHON) docs/release.py check

version: $(VENV)/.site
	$(BIN)/python docs/release.py version $(VERSION)
	$(BIN)/python docs/release.py check

serve: $(VENV)/.site
	$(BIN)/coursebuild serve

PYTEST = PATH="$$PATH:$$($(BIN)/python site/bundle.py node)" $(BIN)/python -m pytest
PARALLEL = -n $(WORKERS) --dist worksteal

QUICK = $(PARALLEL) --ignore tests/browser --ignore tests/packaging \
  -m 'not (browser or engine or site or long or slow)' $(PYTEST_ARGS)

quick: $(VENV)/.dev npm
	@$(PYTEST) $(QUICK)

test: $(VENV)/.dev npm system
	@$(PYTEST) $(PARALLEL) -m 'not (long or slow)' $(PYTEST_ARGS)

test-all: $(VENV)/.dev npm system
	@$(PYTEST) $(PARALLEL) -m 'not slow' $(PYTEST_ARGS)

# One after the other, since some of them measure; property tests get new examples in every run.
test-slow: $(VENV)/.dev npm system
	@$(PYTEST) -m 'slow or hypothesis' --hypothesis-profile free $(PYTEST_ARGS)

# Of the oldest MuJoCo it is known that these hold for that of the labs only.
OLDEST := build/oldest
OF_THIS_ENGINE := tests/core/text/test_format_mistakes.py tests/mjcourse/test_against_mujoco.py \
  tests/site/test_node.py::test_reference_values_are_those_of_this_mujoco

test-oldest: $(VENV)/.dev npm
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python $(OLDEST)
	$(BIN)/uv pip compile --quiet --resolution lowest-direct $(addprefix --no-emit-package ,$(OURS)) pyproject.toml --extra lsp --extra figures --extra measure -o $(OLDEST)/packages.txt
	$(BIN)/uv pip install --quiet --python $(OLDEST) -c $(OLDEST)/packages.txt --group dev --editable '.[figures,lsp,measure]' --editable ./mjbench
	PATH="$$PATH:$$($(BIN)/python site/bundle.py node)" $(OLDEST)/bin/python -m pytest $(QUICK) \
	  $(addprefix --deselect ,$(OF_THIS_ENGINE))

fuzz: $(VENV)/.dev
	@PYTHONPATH=tests $(BIN)/python -m fuzz --seconds $(TIME)

lint: $(VENV)/.dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check

format: $(VENV)/.dev
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

types: $(VENV)/.dev npm
	$(BIN)/mypy
	PATH="$$PATH:$$($(BIN)/python site/bundle.py node)" site/node_modules/.bin/tsc -p site

vscode: $(VENV)/.site
	cd editors/vscode && PATH="$$PATH:$$(../../$(BIN)/python ../../site/bundle.py node)" && \
	  npm ci --ignore-scripts && npm test && npm run package

dist: $(VENV)/.site
	rm -rf dist
	for folder in . mjbench plugins/*; do \
	  (cd $$folder && '$(CURDIR)/$(BIN)/python' -m hatchling build -d '$(CURDIR)/dist') || exit; done

# A MuJoCo Warp says itself of no MuJoCo that it is for.
lock: $(VENV)/.dev
	echo 'mujoco-warp<3.15' | $(BIN)/uv pip compile --quiet $(UPGRADE) --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url $(addprefix --no-emit-package ,$(OURS)) --custom-compile-command 'make lock' \
	  pyproject.toml --all-extras --group dev -c - -o requirements.lock

clean:
	rm -rf public .coursebuild dist build site/dist site/.bundle* $(VENV)/.site $(VENV)/.dev
	rm -rf .hypothesis .mypy_cache .pytest_cache .ruff_cache
	find . \( -name $(VENV) -o -name node_modules -o -name .git \) -prune -o \
	  -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean
	rm -rf $(VENV) site/node_modules

$(VENV)/.made:
	@command -v $(PYTHON) >/dev/null || { \
	  echo "$(PYTHON) was not found: install Python 3.11 or newer, or run make PYTHON=/path/to/python" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "Python 3.11 or newer is needed, $(PYTHON) is $$($(PYTHON) --version 2>&1): run make PYTHON=/path/to/python" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "$(PYTHON) has no venv module: install it (on Debian and Ubuntu: apt-get install python3-venv)" >&2; exit 1; }
	$(PYTHON) -m venv --clear $(VENV)
	@printf '%s' '$(CURDIR)' > $@

# It installs in a minute what takes pip ten.
$(BIN)/uv: $(VENV)/.made
	@sed -n '/^uv==/,/[^\\]$$/p' requirements.lock > $(VENV)/uv.txt
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $(VENV)/uv.txt
	@touch $@

$(VENV)/.site: $(BIN)/uv $(BUILD_INPUTS)
	@echo 'installing coursebuild, mjbench and what they need (the first time takes minutes)'
	@$(BIN)/python site/locked.py figures measure build > $(VENV)/requirements.txt
	@$(INSTALL) --require-hashes -r $(VENV)/requirements.txt
	@$(INSTALL) --no-deps --no-build-isolation --editable . --editable ./mjbench
	@touch $@

$(VENV)/.dev: $(BIN)/uv $(BUILD_INPUTS)
	@echo 'installing coursebuild, mjbench, what they and their tests need (the first time takes minutes)'
	@$(INSTALL) --require-hashes -r requirements.lock
	@$(INSTALL) --no-deps --no-build-isolation --editable . --editable ./mjbench
	@touch $(VENV)/.site $@

# The packages that only tests use, beside those that are bundled.
npm: $(VENV)/.dev
	@$(BIN)/python site/bundle.py packages

# The browser, the Java runtime (for the HTML checker) and the sandbox that tests use.
system:
	@missing=''; \
	command -v chromium-headless-shell >/dev/null || missing='chromium-headless-shell'; \
	java -version >/dev/null 2>&1 || missing="$$missing default-jre-headless"; \
	command -v bwrap >/dev/null || missing="$$missing bubblewrap"; \
	[ -n "$$missing" ] || exit 0; \
	if [ "$$(id -u)" = 0 ]; then root=''; else root='sudo -n'; fi; \
	if command -v apt-get >/dev/null && $$root true 2>/dev/null; then \
	  echo "installing $$missing"; \
	  export DEBIAN_FRONTEND=noninteractive; \
	  $$root apt-get update -qq && $$root apt-get install -y -qq --no-install-recommends $$missing; \
	else \
	  echo "the tests need Debian's packages (or the like of your system): $$missing" >&2; \
	  echo "install them, with the commands chromium-headless-shell, java and bwrap on PATH, and run make test again" >&2; \
	  exit 1; \
	fi
