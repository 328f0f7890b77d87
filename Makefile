# Two commands matter: `make demo` and `make test`. Both set up what they need.
SHELL := /bin/bash
PYTHON ?= python3
VENV := .venv
space := $(subst ,, )
BIN := $(VENV)/bin
# The suite starts hundreds of processes; without caches of bytecode each compiles the package for a fifth of a second.
unexport PYTHONDONTWRITEBYTECODE
# One more than there are processors: a fifth of the suite's time browsers and killed studies are waited for.
TESTERS := $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)
TESTS := -m "not nightly"
ROOMS := $(ROOM:%=tests/%)
# A module is compiled to bytecode when it is first imported; most of what wheels hold never is (half of pip's time).
# Requirements name every package with its version, so that pip has nothing to resolve (--no-deps).
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile --no-deps
BACKEND := $(shell grep -E '^(hatchling|editables|pathspec|pluggy|tomlkit|trove-classifiers)==' requirements/dev.txt)

# Targets share one environment, which one pip at a time may change.
.NOTPARALLEL:
.PHONY: demo test lint style types unit dist check-nightly check-floors coverage audit docs live bench bench-quick bench-compare bench-app test-wheel requirements clean help

help:
	@echo "make demo           plan and simulate on a bundled map; pictures and a film in demo/"
	@echo "make test           style and import rules, the whole test suite, every promise at its smallest size"
	@echo "make test ROOM=planning  only the tests of one folder of tests/ (or files: ROOM='motion test_api.py'), in seconds"
	@echo "make lint           style, import rules and types (mypy); make unit: only the tests"
	@echo "make docs           the site, with every gallery picture, in build/site/html"
	@echo "make live           the app as a folder of files without a server, Python in the browser (needs npm): build/live"
	@echo "make dist           wheels and source archives of both distributions"
	@echo "make test-wheel     the same suite against the built wheel"
	@echo "make bench          timings compared with other libraries (installs them): docs/benchmarks.md and .json; ONLY='field query' for some"
	@echo "make bench-quick    the same in under two minutes, printed and not written"
	@echo "make bench-compare  OLD=FILE: docs/benchmarks.json compared with an older record, ratio by ratio"
	@echo "make bench-app      the app in a browser: frames a second, painting, dragging, memory over ten minutes"
	@echo "make check-nightly  the large sizes: tests, promises, coverage, known advisories (hours; resumes where it was stopped)"
	@echo "make check-floors   every Python from 3.11 to 3.14 on PATH, each dependency at its lowest allowed version; PYTHONS='...', SUITE=1: the whole suite"
	@echo "make coverage       branch coverage by package"
	@echo "make audit          known security advisories of the dependencies (needs the network)"
	@echo "make requirements   pin the requirements again; make clean: remove .venv, demo, dist, build (and ledgers in it)"

$(VENV)/.made:
	@tools/make_venv.sh "$(PYTHON)" "$(VENV)"
	@touch $@

$(VENV)/.run: $(VENV)/.made requirements/run.txt pyproject.toml selfcheck/pyproject.toml
	@echo "installing lampyris and what it runs on ..."
	@$(PIP) -r requirements/run.txt $(BACKEND)
	@$(PIP) --no-build-isolation -e . -e ./selfcheck
	@touch $@

# What only development needs, beside what lampyris runs on: `make test` installs both at once, a processor each.
$(VENV)/.tools: $(VENV)/.made requirements/dev.txt requirements/run.txt
	@echo "installing the development tools ..."
	@grep -E '^[^# ]' requirements/dev.txt | grep -vxFf requirements/run.txt | grep -vE '$(subst $(space),|,$(BACKEND))' >$(VENV)/tools.txt
	@$(PIP) -r $(VENV)/tools.txt
	@touch $@

$(VENV)/.dev: $(VENV)/.run $(VENV)/.tools
	@touch $@

$(VENV)/.nightly: $(VENV)/.dev requirements/nightly.txt
	@echo "installing what the nightly checks need ..."
	@$(PIP) -r requirements/nightly.txt
	@touch $@

$(VENV)/.bench: $(VENV)/.run requirements/bench.txt
	@echo "installing the libraries to compare with ..."
	@$(PIP) -r requirements/bench.txt
	@touch $@

$(VENV)/.docs: $(VENV)/.run requirements/docs.txt
	@echo "installing what the site is built with ..."
	@$(PIP) -r requirements/docs.txt
	@touch $@

demo: $(VENV)/.run
	@$(BIN)/python tools/demo.py demo

ifdef ROOM
test: $(VENV)/.dev
	@ls -d $(ROOMS) >/dev/null || { echo "ROOM: one or some of" $$(cd tests && ls */test_*.py | cut -d/ -f1 | uniq) "or test files"; exit 1; }
	$(BIN)/python -m pytest -q -n $(TESTERS) --dist worksteal $(TESTS) $(ROOMS)
else
# Before the suite's workers start, the machine code and the bytecode that each of them would make are made once. The tools
# and a browser, whose packages are mostly waited for, are installed beside that. Style is judged beside it, too, and has
# the last word. Types are not: mypy takes a minute or more of CPU time on a fresh clone. `make lint` judges them, in CI
# beside the suite, and `make check-nightly`.
test: $(VENV)/.made
	@mkdir -p build; $(MAKE) --no-print-directory $(VENV)/.tools >build/tools.txt 2>&1 & tools=$$!; \
	tools/browser.sh >build/browser.txt 2>&1 & browsed=$$!; \
	trap "kill $$tools $$browsed" INT TERM; \
	$(MAKE) --no-print-directory $(VENV)/.run || { kill $$tools $$browsed; exit 1; }; \
	{ $(BIN)/python -m compileall -q tests selfcheck/src; exec $(BIN)/python tools/warm_suite.py; } >build/warm.txt 2>&1 & warmed=$$!; \
	trap "kill $$warmed $$tools $$browsed" INT TERM; \
	wait $$tools && $(MAKE) --no-print-directory $(VENV)/.dev || { cat build/tools.txt; kill $$warmed $$browsed; exit 1; }; \
	$(MAKE) --no-print-directory style >build/style.txt 2>&1 & styled=$$!; \
	trap "kill $$warmed $$styled $$browsed" INT TERM; \
	wait $$warmed || { cat build/warm.txt; kill $$styled $$browsed; exit 1; }; \
	wait $$browsed; \
	$(MAKE) --no-print-directory unit; tested=$$?; \
	wait $$styled || tested=1; cat build/style.txt; exit $$tested
endif

lint: style types

style: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python tools/lint_determinism.py
	$(BIN)/python tools/house.py

types: $(VENV)/.dev
	$(BIN)/mypy

# A test that hangs is named and ended with its process: the slowest takes a tenth of that. pytest rewrites assertions to show the values
# in them, which takes half a minute for the whole suite: only what failed is run again so. It stays a failure.
HANGS := -o faulthandler_timeout=600 -o faulthandler_exit_on_timeout=true
unit: $(VENV)/.dev
	@tools/browser.sh
	$(BIN)/python -m pytest -q -n $(TESTERS) --dist worksteal $(HANGS) --assert=plain $(TESTS) || { \
	echo "what failed, once more, with the values in its assertions:"; \
	$(BIN)/python -m pytest -q $(HANGS) --lf --lfnf none $(TESTS); exit 1; }

# Each check resumes where it was stopped: delete build/nightly.ledger to start over. Results are appended to
# build/promises.jsonl; docs/promises.jsonl is for figures that are to be published.
# A failing line does not keep the others from running; the exit code reports it at the end.
check-nightly: $(VENV)/.nightly
	@tools/browser.sh axe
	@mkdir -p build
	@failed=0; \
	run() { echo "$$*"; "$$@" || { failed=1; echo "FAILED: $$*"; }; }; \
	run $(BIN)/python -m mypy; \
	run $(BIN)/python -m pytest -q -n auto -m nightly -s; \
	run $(BIN)/lampyris selfcheck --size nightly --ledger build/nightly.ledger \
		--failures build/failures --record build/promises.jsonl; \
	run $(BIN)/python tools/coverage_rooms.py; \
	run $(BIN)/python tools/check_floors.py $(PYTHONS); \
	exit $$failed

check-floors: $(VENV)/.dev
	$(BIN)/python tools/check_floors.py $(if $(SUITE),--suite) $(PYTHONS)

coverage: $(VENV)/.nightly
	@tools/browser.sh
	$(BIN)/python tools/coverage_rooms.py

audit: $(VENV)/.nightly
	$(BIN)/python -m pip_audit --strict --no-deps --disable-pip -r requirements/run.txt

test-wheel: $(VENV)/.dev
	@rm -rf dist build/wheel-venv && mkdir -p build
	$(BIN)/python -m build --wheel --no-isolation --outdir dist . >/dev/null
	$(BIN)/python -m build --wheel --no-isolation --outdir dist selfcheck >/dev/null
	@tools/make_venv.sh "$(PYTHON)" build/wheel-venv
	@build/wheel-venv/bin/python -m pip install --quiet -r requirements/run.txt -r requirements/dev.txt dist/*.whl
	@# Run from a copy of tests/ alone, so that src/ cannot be what is tested.
	@rm -rf build/wheel-tests && mkdir build/wheel-tests && cp -r tests pyproject.toml examples README.md build/wheel-tests/
	cd build/wheel-tests && LAMPYRIS_SHARED="$(abspath ../shared)" ../wheel-venv/bin/python -m pytest -q -n $(TESTERS) --dist worksteal -m "not nightly and not source"

docs: $(VENV)/.docs
	$(BIN)/python site/build.py

live: $(VENV)/.run
	$(BIN)/python site/live/build.py

# Both distributions, checked as an index would check them.
dist: $(VENV)/.dev
	@rm -rf dist
	$(BIN)/python -m build --no-isolation --outdir dist . >/dev/null
	$(BIN)/python -m build --no-isolation --outdir dist selfcheck >/dev/null
	@ls -l dist

bench: $(VENV)/.bench
	$(BIN)/python -m benchmarks $(ONLY) --page docs/benchmarks.md --json docs/benchmarks.json

bench-quick: $(VENV)/.bench
	$(BIN)/python -m benchmarks $(ONLY) --quick

bench-compare: $(VENV)/.run
	@$(BIN)/python -m benchmarks.compare $(or $(OLD),$(error say which record to compare with: make bench-compare OLD=FILE)) docs/benchmarks.json

bench-app: $(VENV)/.dev
	@tools/browser.sh
	$(BIN)/python -m benchmarks.bench_app $(if $(MINUTES),--minutes $(MINUTES))

requirements: $(VENV)/.dev
	tools/compile_requirements.sh

clean:
	rm -rf $(VENV) demo dist build
