# Everything a developer types. `make help` lists it.
PYTHON ?= python3
VENV := .venv
PY := $(VENV)/bin/python
READY := $(VENV)/ready
SOURCES := $(shell find src -name '*.rs') Cargo.toml Cargo.lock pyproject.toml docs/papers
BUILT := $(VENV)/built
# BLAS and OpenCV must not spin threads of their own beside ours.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# maturin runs pip of its own: let it speak of errors only.
export PIP_QUIET := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

# Tests run in this many processes of one thread each; what needs more threads sets them itself.
WORKERS ?= 2

.PHONY: help build wheel demo test test-rust test-python check fuzz fuzz-rust deny soak report docs clean

# Wheels for old systems: zig links against an old glibc.
PORTABLE := $(if $(filter Linux,$(shell uname)),--zig --compatibility manylinux_2_28)

help:  ## List the commands
	@grep -hE '^[a-z-]+:.*?##' $(MAKEFILE_LIST) | awk -F ':.*?## ' '{printf "  make %-12s %s\n", $$1, $$2}'

$(READY): pyproject.toml
	test -x $(PY) || $(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --upgrade "pip>=25.1" "maturin>=1.16,<2"
	$(PY) -m pip install --quiet --group dev
	touch $@

$(BUILT): $(READY) $(SOURCES)
	PATH="$(abspath $(VENV))/bin:$$PATH" VIRTUAL_ENV="$(abspath $(VENV))" $(PY) -m maturin develop --release --quiet
	touch $@

build: $(BUILT)  ## Make .venv and build the extension into it

demo: build  ## Fit a cloud to the embedded photograph; pictures in out/
	$(PY) -m pleinair demo --out out

test: build  ## Build, pass every test, and say how long it took
	$(PY) scripts/timed.py $(MAKE) --no-print-directory test-rust test-python

test-rust:
	cargo test --release --quiet

# The page of the explorer is measured in milliseconds: with nothing beside it.
test-python: build
	$(PY) -m pytest -q tests/browser
	RAYON_NUM_THREADS=1 $(PY) -m pytest -q --ignore=tests/browser -n $(WORKERS) --dist loadfile

check: build  ## rustfmt, clippy, ruff, mypy, stubtest, floors, repo-review
	cargo fmt --check
	cargo clippy --release --all-targets --quiet -- -D warnings
	PYO3_PYTHON=$(abspath $(PY)) cargo clippy --release --features python --target-dir target/bindings --quiet -- -D warnings
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m mypy
	$(PY) -m mypy.stubtest pleinair._core --ignore-disjoint-bases
	$(VENV)/bin/repo-review .

wheel: build  ## Build wheel and source archive into dist/, install the wheel in a fresh environment and use it
	rm -rf dist
	$(PY) -m pip install --quiet ziglang
	PATH="$(abspath $(VENV))/bin:$$PATH" $(PY) -m maturin build --release --quiet $(PORTABLE) --out dist
	$(PY) -m maturin sdist --out dist
	$(PY) scripts/check_wheel.py dist

# Seconds of `make fuzz` and `make soak`.
FUZZ ?= 3600
SOAK ?= 600

fuzz: build  ## Mutated files and wrong arrays for an hour (FUZZ= seconds): only documented exceptions
	$(PY) fuzz/readers.py --seconds $(FUZZ) 2>/dev/null

fuzz-rust:  ## The parsers in Rust under libFuzzer, FUZZ= seconds each (cargo-fuzz and a nightly toolchain)
	mkdir -p fuzz/corpus/picture fuzz/corpus/icc_profile
	cargo +nightly fuzz run picture fuzz/corpus/picture tests/data/photographs -- -max_total_time=$(FUZZ)
	cargo +nightly fuzz run icc_profile fuzz/corpus/icc_profile fuzz/seeds/icc_profile -- -max_total_time=$(FUZZ)

deny:  ## Licences, sources and versions of the crates (cargo-deny)
	cargo deny check bans licenses sources

soak: build  ## Ten minutes (SOAK= seconds) of threads and signals: memory, threads, descriptors flat
	$(PY) fuzz/soak.py --seconds $(SOAK)

report: build  ## Measure speed and error beside the rivals; rewrites docs/report/
	$(PY) -m pleinair report

docs: build  ## Build the Rust documentation with the paper pages; broken links fail
	RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --quiet

clean:  ## Remove everything that was built
	rm -rf target $(VENV) out .mypy_cache .pytest_cache .ruff_cache
