# Every target works from a fresh clone: it creates `.venv` and builds the bindings if they are out of date.
# Requirements: Rust, Python 3.11 or newer, make. To use another interpreter: `make PYTHON=python3.13 test`.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
FIRMWARE := thumbv7em-none-eabihf
# `cargo fmt` does not follow modules that a macro declares.
EFFECTS := $(wildcard crates/gpi-core/src/effects/*.rs) python/tests/made_up_effect.rs

TOOLS := $(VENV)/.tools-installed
NATIVE := $(VENV)/.native-installed
# Directories are also listed, so that a deleted file counts as a change.
NATIVE_SOURCES := pyproject.toml Cargo.toml $(wildcard Cargo.lock crates/*/Cargo.toml) $(shell find crates/*/src)
NATIVE_MISSING := $(if $(wildcard python/gpi_hammerstein/_native*.so),,FORCE)

# Modules are compiled when they are first imported, which some environments switch off.
unexport PYTHONDONTWRITEBYTECODE

heading = @printf '\n== %s ==\n' '$(1)'

.DEFAULT_GOAL := help
.PHONY: help programs demo test compile-rust lint lint-rust lint-python test-rust test-python test-slow bench bench-peers bench-scale docs notebooks figures monte-carlo tracking expected-errors firmware-cost real-records public-benchmarks scoreboard blind-exam kill-writes fuzz-readers fuzz-models miri reliability clean FORCE

help: ## List the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-12s %s\n", $$1, $$2 }' Makefile

programs:
	@command -v cargo >/dev/null || \
		{ echo "error: cargo not found: install Rust 1.89 or newer" >&2; exit 1; }
	@command -v $(PYTHON) >/dev/null || \
		{ echo "error: $(PYTHON) not found: install Python 3.11 or newer, or select one with 'make PYTHON=...'" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "error: $(PYTHON) is $$($(PYTHON) -V 2>&1), Python 3.11 or newer is required: select one with 'make PYTHON=...'" >&2; exit 1; }

demo: $(NATIVE) ## Run `gpi demo` and write its pictures to out/demo
	$(BIN)/gpi demo -o out/demo

# Two at a time where one does not fill both cores. The tests of Python run alone, because some measure waiting times.
together = +@$(MAKE) --no-print-directory -j2

test: programs ## Run all tests, and the lint and type checks of Python
	$(together) $(TOOLS) compile-rust
	$(together) test-rust lint-python
	$(together) test-python

lint: lint-rust lint-python ## Run the format, lint and type checks of both languages

# Not a part of `test`: clippy reads all dependencies once more, and a minimal installation of Rust lacks both programs.
lint-rust: ## Run rustfmt and clippy
	$(call heading,Rust: format)
	cargo fmt --all --check -- $(EFFECTS)
	$(call heading,Rust: lint)
	PYO3_PYTHON=$(PYTHON) cargo clippy --release --workspace --all-targets -- -D warnings

# Before the wheel, because cargo makes the build of the wheel wait for that of the tests, or the other way round.
compile-rust:
	$(call heading,Rust: compile)
	PYO3_PYTHON=$(PYTHON) cargo test --release --workspace --exclude benches --no-run

test-rust: ## Build for firmware; run unit tests and documentation tests
	$(call heading,Rust: build without std for $(FIRMWARE))
	@if [ -d "$$(rustc --print target-libdir --target $(FIRMWARE))" ] || rustup target add $(FIRMWARE); then \
		cargo build -p gpi-core --no-default-features --target $(FIRMWARE); \
	else \
		echo "note: skipped, because the Rust target $(FIRMWARE) cannot be added here"; \
	fi
	$(call heading,Rust: tests)
	PYO3_PYTHON=$(PYTHON) cargo test --release --workspace --exclude benches
	$(call heading,Rust: tests without default features)
	cargo test --release -p gpi-core --no-default-features

lint-python: $(NATIVE) ## Run ruff, mypy, basedpyright and stubtest
	$(call heading,Python: lint and format)
	$(BIN)/python -m ruff check
	$(BIN)/python -m ruff format --check
	$(call heading,Python: types)
	$(BIN)/python -m mypy --strict
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m basedpyright --verifytypes gpi_hammerstein --ignoreexternal
	$(call heading,Python: stub of the compiled module)
	$(BIN)/python -m mypy.stubtest gpi_hammerstein._native

test-python: $(NATIVE) ## Run pytest
	$(call heading,Python: tests)
	$(BIN)/python -m pytest -n auto --dist loadgroup

test-slow: $(NATIVE) ## Run the tests that take minutes, and the benchmarks in test mode
	$(call heading,Rust: benchmarks in test mode)
	cargo test --release --benches
	$(call heading,Python: slow tests)
	$(BIN)/python -m pytest -m slow -n auto

docs: $(NATIVE) ## Build the documentation in out/site; its tutorial downloads a record or reads it from GPI_DATA_DIR
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python -m sphinx -W --keep-going docs out/site
	cargo doc -p gpi-core --no-deps
	rm -rf out/site/rust && cp -R target/doc out/site/rust

notebooks: $(NATIVE) ## Run the notebooks of the documentation and write their outputs into them (needs the measured data)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python tools/run_notebooks.py

bench: ## Run the benchmarks
	cargo bench

bench-peers: $(NATIVE) ## Compare the run time with other tools and write docs/benchmarks.md
	$(BIN)/python -m pip install --quiet --group peers
	$(BIN)/python tools/bench_peers.py --markdown docs/benchmarks.md

bench-scale: $(NATIVE) ## Print the time of explanations, and of identification as records and their experiments grow
	$(BIN)/python tools/bench_scale.py

figures: $(NATIVE) ## Print the figures of README (needs the measured data)
	$(BIN)/python tools/measured_figures.py

monte-carlo: $(NATIVE) ## Print errors over the Cramer-Rao bound and the coverage of confidence intervals
	$(BIN)/python tools/monte_carlo.py

tracking: $(NATIVE) ## Measure how well compensated drives work on a changed plant and write docs/tracking.md
	$(BIN)/python tools/tracking.py --markdown docs/tracking.md

expected-errors: $(NATIVE) ## Print the error that compensate expects beside the error that simulated stages make
	$(BIN)/python tools/expected_errors.py

firmware-cost: $(NATIVE) ## Count a compensator's instructions on a Cortex-M4F in QEMU and write docs/firmware.md
	$(BIN)/python tools/firmware_cost.py --markdown docs/firmware.md

real-records: $(NATIVE) ## Print the held-out errors on measured records next to simple rivals (takes a long time)
	$(BIN)/python tools/real_records.py --markdown docs/real-records.md

public-benchmarks: $(NATIVE) ## Explain the public benchmarks and write docs/public-benchmarks.md (needs the data or a network)
	$(BIN)/python tools/public_benchmarks.py --markdown docs/public-benchmarks.md

scoreboard: $(NATIVE) ## Print how often `explain` names the right effects (takes a long time)
	$(BIN)/python tools/scoreboard.py

blind-exam: $(NATIVE) ## Write the answers on the blind records to docs/blind-exam.json (takes a long time)
	$(BIN)/python tools/blind_exam.py

kill-writes: $(NATIVE) ## Kill runs 200 times while they write, and count damaged folders
	$(BIN)/python tools/kill_writes.py --kills 200

fuzz-models: ## Read and use 1,000,000 mutated model files of a new seed and count the results by class
	GPI_HOSTILE_MODELS=1000000 GPI_HOSTILE_SEED=$$(date +%s) cargo test --release -p gpi-core --test hostile_models -- --nocapture

fuzz-readers: $(NATIVE) ## Read 100,000 mutated record files of a new seed and count the results by class
	$(BIN)/python tools/fuzz_readers.py --number 100000

miri: ## Run the tests of the operators in Miri, which finds undefined behaviour (needs the nightly toolchain)
	cargo +nightly miri test -p gpi-core --no-default-features --lib

reliability: $(NATIVE) ## Attack the package with hostile files and killed runs and write docs/reliability.md
	$(BIN)/python tools/reliability.py --markdown docs/reliability.md

clean: ## Remove the environment, all builds and all caches
	cargo clean
	rm -rf $(VENV) .hypothesis .mypy_cache .pytest_cache .ruff_cache
	rm -f python/gpi_hammerstein/_native*.so
	find python benches -name __pycache__ -type d -prune -exec rm -rf {} +

# Order only: a check makes nothing out of date.
$(TOOLS): pyproject.toml | programs
	$(call heading,Python: environment)
	@[ -x $(BIN)/python ] || $(PYTHON) -m venv $(VENV) || \
		{ rm -rf $(VENV); echo "error: the virtual environment cannot be created (Debian, Ubuntu: install python3-venv)" >&2; exit 1; }
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	# compiling every module takes longer than installing it
	$(BIN)/python -m pip install --quiet --no-compile --group dev
	@touch $@

$(NATIVE): $(TOOLS) $(NATIVE_SOURCES) $(NATIVE_MISSING)
	$(call heading,Python: build and install the package)
	env -u CONDA_PREFIX PIP_QUIET=1 VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/python -m maturin develop --release
	@touch $@
