# `make` alone lists what there is. Needs Python 3.11 and make.

PYTHON ?= python3
PROFILE ?= chocolate-cake
BIN := .venv/bin
CORE := .venv/core
READY := .venv/ready

LOCK := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes --no-header \
	--no-emit-index-url --no-emit-find-links

TORCH ?= torch==2.13.0

# The first dialogues of some splits are for judging.
SETS := teach multiwoz casino alfred taskmaster4
FIT_teach := teach:train
FIT_casino := casino:train[100:]
FIT_multiwoz := multiwoz:val[200:]
FIT_alfred := alfred:train[300:]
FIT_taskmaster4 := taskmaster4:dev[200:]
HALVES := "teach:train[:740]" "teach:train[740:]" $(foreach set,$(filter-out teach,$(SETS)),"$(FIT_$(set))")
ADAPTERS := $(patsubst %,adapters/%/adapter.gguf,teach-10 teach-100)
# Published as Qwen/Qwen2.5-Coder-1.5B-Instruct-GGUF and 0.5B.
LARGER := $(patsubst %,models/qwen2.5-coder-%-instruct-q4_k_m.gguf,0.5b 1.5b)
FIT := $(BIN)/goalscope fit --start none --out adapters
SHORT := --steps 100 --every 100 --validation 20

.PHONY: help demo demo-web test test-all slow torch servers check package audit docs reliability pictures recording bench results adapter reader writer lock

help:
	@awk -F ':.*## ' '/^[a-z -]+:.*## / {printf "make %-15s%s\n", $$1, $$2}' Makefile

demo: $(CORE)  ## one grocery episode with a scripted human, on the built-in model
	$(BIN)/goalscope run grocery --profile $(PROFILE)

demo-web: $(READY)  ## the page, on the built-in model
	$(BIN)/goalscope serve

test: $(READY)  ## the tests that need no other programs, in minutes
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4 \
		-m "not (browser or docs or postgresql or slow or torch)"

test-all: $(READY)  ## all tests but the slow ones, as CI runs them
	$(BIN)/python -m pytest --numprocesses auto --maxprocesses 4

slow: $(READY)  ## the tests that take minutes each
	$(BIN)/python -m pytest -m slow

torch: $(READY)  ## the backend that runs models by Transformers, which `make test-all` then tests
	$(BIN)/python -m pip install --quiet "$(TORCH)" --editable ".[torch]"

servers:  ## Debian's programs that some tests need, which are skipped without them; as root
	test -n "$(wildcard /usr/lib/postgresql/*/bin/initdb)" && command -v chromium >/dev/null || { \
		apt-get update --quiet=2 && \
		DEBIAN_FRONTEND=noninteractive apt-get install --quiet=2 --yes --no-install-recommends postgresql chromium; }

check: $(READY)  ## format, lint, types
	$(BIN)/ruff format --check src tests benchmarks docs examples training weights hatch_build.py
	$(BIN)/ruff check src tests benchmarks docs examples training weights hatch_build.py
	$(BIN)/pyright --pythonpath $(BIN)/python

# The source of the first has no weights, and depends on the second.
package: $(CORE)  ## the two distributions, installed in an empty environment of each Python from 3.11 on
	rm -rf dist build/package && mkdir -p build/package/source && git archive HEAD | tar -x -C build/package/source
	rm -r build/package/source/weights
	sed -i 's/^dependencies = \[/&\n    "goalscope-smollm2==1.0.0",/' build/package/source/pyproject.toml
	$(PYTHON) -m venv build/package/build && build/package/build/bin/python -m pip install --quiet build
	for each in build/package/source weights; do build/package/build/bin/python -m build --outdir dist $$each || exit 1; done
	@du -m dist/*
	@for python in python3.11 python3.12 python3.13; do \
		$$python -c "" 2>/dev/null || { echo "$$python: not here"; continue; }; \
		here=build/package/$$python; \
		$$python -m venv $$here && $$here/bin/python -m pip install --quiet dist/*.whl || exit 1; \
		echo "$$python: $$(du -sm $$here | cut -f 1) MB, $$(cd $$here && HOME=$$PWD bin/goalscope doctor | grep '^problems')"; \
	done

audit:  ## known weaknesses of every pinned package
	test -x build/audit/bin/pip-audit || { $(PYTHON) -m venv build/audit && build/audit/bin/python -m pip install --quiet pip-audit; }
	build/audit/bin/pip-audit --requirement requirements.lock --require-hashes --disable-pip --strict

docs: $(READY)  ## the documentation as a site, in site/; a broken link is an error
	$(BIN)/mkdocs build --strict

reliability: $(READY)  ## what docs/reliability.md says, measured; the slow tests, too
	$(BIN)/python -m pytest tests/reliability -m "slow or not slow"

pictures: $(READY)  ## those of the page in docs/, by the tests that look at it; after `make servers`
	GOALSCOPE_PICTURES=docs $(BIN)/python -m pytest -m slow tests/test_page_pictures.py
	$(BIN)/python docs/belief_picture.py
	$(BIN)/python docs/house_picture.py

recording: $(READY)  ## docs/chat.svg, a chat with the garden's agent as a terminal that moves
	$(BIN)/python docs/chat_recording.py

bench: torch  ## speed of a belief update beside other ways, as ratios in one run
	$(BIN)/python -m pip install --quiet "$(TORCH)" lm-eval matplotlib minicons
	$(BIN)/python -W ignore benchmarks/speed.py

results: $(READY) $(ADAPTERS) $(LARGER)  ## every experiment, which takes hours and goes on where it stopped; like `adapter`
	@failed=0; for each in $(filter-out plans/paper.toml,$(wildcard plans/*.toml)); do \
		$(BIN)/goalscope experiment run $$each || failed=1; done; \
		rm -rf docs/results && $(BIN)/goalscope report results --out docs/results.md && exit $$failed

$(CORE): requirements-core.lock pyproject.toml hatch_build.py
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements-core.lock
	$(BIN)/python -m pip install --quiet --no-deps --editable .
	touch $@

$(READY): $(CORE) requirements.lock
	$(BIN)/python -m pip install --quiet --require-hashes --requirement requirements.lock
	touch $@

adapter: adapters/general/adapter.gguf  ## the adapter that goalscope comes with; after `make torch`, with GOALSCOPE_DATA
	cp $(addprefix adapters/general/,adapter.gguf README.md fit.json) src/goalscope/models/general/

# An hour or two each, and up to half an hour for each of the next ones; delete the folder of one to fit it again.
# After the first stage TEACh, named in halves, is drawn twice as often as the other sets.
adapters/general-1/adapter.gguf: | $(READY)
	$(FIT)/general-1 $(foreach set,$(SETS),"$(FIT_$(set))") --steps 400 --every 100 --learning-rate 5e-4

adapters/general-2/adapter.gguf: adapters/general-1/adapter.gguf
	$(BIN)/goalscope fit --start adapters/general-1 --out adapters/general-2 $(HALVES) \
		--steps 400 --every 200 --validation 48

adapters/general-3/adapter.gguf: adapters/general-2/adapter.gguf adapters/needs.jsonl adapters/talks.jsonl
	$(BIN)/goalscope fit --start adapters/general-2 --out adapters/general-3 $(HALVES) \
		adapters/needs.jsonl adapters/talks.jsonl --steps 600 --every 300 --validation 64

adapters/general/adapter.gguf: adapters/general-3/adapter.gguf
	$(BIN)/goalscope fit --start adapters/general-3 --out adapters/general $(HALVES) \
		adapters/needs.jsonl adapters/talks.jsonl --seed 2 --steps 480 --every 240 --validation 64

adapters/needs.jsonl: | $(READY)
	$(BIN)/python training/cases.py $@ src/goalscope/envs/scenarios --asides corpus/reading/train

adapters/talks.jsonl: | $(READY)
	$(BIN)/python training/cases.py $@ corpus/talks/train

adapters/teach-%/adapter.gguf: | $(READY)
	$(FIT)/teach-$* "teach:train[:$*]" $(SHORT)

$(LARGER):
	@echo "Some experiments need a larger model: get $(@F) from the hub, from Qwen/Qwen2.5-Coder-0.5B-Instruct-GGUF or 1.5B," \
		"and put it into models/."; exit 1

reader writer: %: adapters/%/adapter.gguf  ## the adapter that reads, and the one that proposes, plans and asks; after `make torch`
	cp $(addprefix adapters/$@/,adapter.gguf fit.json) src/goalscope/models/$@/

# Some hours on two cores, minutes on a GPU; each goes on where it stopped.
adapters/reader/adapter.gguf adapters/writer/adapter.gguf: adapters/%/adapter.gguf: | $(READY)
	$(BIN)/python training/fit_$*.py --out adapters/$*

lock:  ## pin the newest versions that pyproject.toml allows
	$(LOCK) --upgrade --extra experiments --extra mcp --extra postgres --extra remote \
		--extra web --group dev --output-file requirements.lock
	cp requirements.lock requirements-core.lock && $(LOCK) --output-file requirements-core.lock
