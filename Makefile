# make demo | make test | make check | make torch | make bench | make results | make adapter
# (needs Python 3.11, a C++ compiler, make)

PYTHON ?= python3
PROFILE ?= chocolate-cake
BIN := .venv/bin
READY := .venv/ready

TORCH ?= torch==2.13.0

.PHONY: demo test check bench results adapter lock torch

demo: $(READY)  ## one grocery episode with a scripted human, on the built-in model
	$(BIN)/goalscope run grocery --profile $(PROFILE)

test: $(READY)  ## the whole test suite
	$(BIN)/python -m pytest

torch: $(READY)  ## the backend that runs models by Transformers, which `make test` then tests too
	$(BIN)/python -m pip install --quiet "$(TORCH)" --editable ".[torch]"

check: $(READY)  ## format, lint, types
	$(BIN)/ruff format --check src tests benchmarks
	$(BIN)/ruff check src tests benchmarks
	$(BIN)/pyright --pythonpath $(BIN)/python

bench: torch  ## speed of a belief update beside other ways, as ratios in one run
	$(BIN)/python -m pip install --quiet "$(TORCH)" lm-eval matplotlib minicons
	$(BIN)/python -W ignore benchmarks/speed.py

results: $(READY)  ## every experiment, which takes hours and goes on where it stopped; needs GOALSCOPE_DATA
	@failed=0; for each in experiments/*.toml; do $(BIN)/goalscope experiment run $$each || failed=1; done; \
		$(BIN)/goalscope report results --markdown docs/results.md && exit $$failed

# The first set-up compiles the inference engine, which takes some minutes.
$(READY): requirements.lock pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	touch $@

FITTED_ON := teach:train casino:train 'multiwoz:val[200:]' 'alfred:train[300:]' 'taskmaster4:dev[200:]'

adapter: torch  ## fit the adapter that goalscope comes with, which takes an hour or two; needs GOALSCOPE_DATA
	$(BIN)/goalscope fit $(FITTED_ON) --start none --out adapters/general
	cp adapters/general/adapter.gguf adapters/general/README.md adapters/general/fit.json src/goalscope/models/general/

lock:  ## pin the newest versions that pyproject.toml allows
	uv pip compile pyproject.toml --extra cluster --extra experiments --extra remote --extra thor --group dev \
		--universal --python-version 3.11 --upgrade \
		--generate-hashes --no-emit-index-url --no-emit-find-links --no-header \
		--output-file requirements.lock
