# Everything a user or a developer runs. `make` prints the targets.

PYTHON ?= python3
BIN    := .venv/bin
USER   := .venv/.user
DEV    := .venv/.dev
PYTEST := $(BIN)/pytest -n 2
SIM    := "builtin:room?n=20000" --path orbit --frames 8 --size 384x256 -o build/sim
STUDY  := "builtin:room?n=20000" --path orbit --frames 6 --size 384x256
export PIP_DISABLE_PIP_VERSION_CHECK = 1

.PHONY: help setup lint test test-fast rtl-settings formal mutate coverage sim bench accuracy synth power fpga params docs clean
.DELETE_ON_ERROR:

help: ## print the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

setup: $(DEV) ## install everything into .venv

lint: $(DEV) ## every tool that reads the RTL, ruff, layout and generated files; a warning fails
	$(PYTEST) tests/test_lint.py tests/test_layout.py tests/test_generated.py

test: $(DEV) ## all tests: golden model, RTL, lint, proofs
	$(PYTEST)

test-fast: $(DEV) ## the tests that take two minutes together
	$(PYTEST) -m "not slow"

rtl-settings: $(DEV) ## every bench with the number formats small and wide; an hour
	$(BIN)/python -m tests.builds --setting small
	$(BIN)/python -m tests.builds --setting wide

formal: $(DEV) ## prove that every output stream holds its beat until it moves
	$(PYTEST) tests/test_formal.py

mutate: $(DEV) ## break each unit in 100 places and see its bench notice: docs/mutation.md (UNIT=gs_fifo N=100)
	$(BIN)/python -m tests.mutation --count $(or $(N),100) $(addprefix --unit ,$(UNIT))

coverage: $(DEV) ## line and toggle coverage of the RTL by its benches: docs/mutation.md
	$(BIN)/python -m tests.mutation --coverage

sim: $(USER) ## co-simulate eight small frames: golden model against the Verilated RTL
	$(BIN)/splatcore cosim $(SIM)

bench: $(USER) ## how fast the simulator is, as ratios; history in docs/bench.csv
	$(BIN)/python -m tests.bench

accuracy: $(USER) ## what each knob does to picture, time and bytes; writes docs/accuracy/room
	$(BIN)/splatcore accuracy $(STUDY) -o build/accuracy --page docs/accuracy/room

synth: $(DEV) ## area and timing of every unit, or of UNIT=gs_merge_sort_unit, in ASAP7 cells; table in docs/synthesis.md
	$(BIN)/python -m synth $(UNIT)

power: $(DEV) ## power of the units on real tiles, or of UNIT=gs_merge_sort_unit; tables in docs/synthesis.md
	$(BIN)/python -m synth.power $(UNIT)

fpga: $(DEV) ## units placed and routed on a Lattice ECP5, or UNIT=gs_sorting_core; table in docs/synthesis.md
	$(BIN)/python -m synth.fpga $(UNIT)

params: $(USER) ## write rtl/gs_params.vh from golden/params.py
	$(BIN)/python -m golden.params

docs: $(DEV) ## write docs/modules.md from the RTL
	$(BIN)/python -m tests.module_table

clean: ## remove what runs have made; .venv stays
	rm -rf build .pytest_cache .ruff_cache .hypothesis

# What to install (. or .[dev]); pip itself stays silent.
define install
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
	    { echo "Python 3.11 or newer not found: install it, or name it: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@command -v g++ >/dev/null || { echo "g++ not found: run 'apt install g++'"; exit 1; }
	@test -x $(BIN)/pip || { echo "making .venv"; $(PYTHON) -m venv .venv >/dev/null; } || \
	    { rm -rf .venv; echo "no venv module: run 'apt install python3-venv'"; exit 1; }
	@echo "installing $(1) into .venv"
	@$(BIN)/pip install --quiet -e '$(1)'
	@touch $(2)
endef

$(USER): pyproject.toml
	$(call install,.,$@)

$(DEV): pyproject.toml
	$(call install,.[dev],$(USER) $@)
