# Photon Bake's commands; `make` alone lists them. Each makes the environment it needs in .venv first.

VENV ?= .venv
BIN := $(VENV)/bin
SCENE ?=
ARGS ?=
BLENDER ?=
export PYTHON
export MYPYPATH := $(VENV)/src
# Where compiled kernels are kept, so that a second run is quick.
export PHOTON_BAKE_KERNELS ?= $(CURDIR)/build/kernels

# `make -s` leaves out what the recipes and the tools say about themselves.
quiet := $(findstring s,$(firstword -$(MAKEFLAGS)))
export QUIET := $(quiet)
say = $(if $(quiet),:,printf '\n%s\n' $(1) >&2)

# The Blender that bakes: BLENDER, else a recent enough `blender` on PATH, else none (the bpy module then does).
blender_on_path = $(shell blender --version 2>/dev/null | grep -Eq '^Blender (4\.[5-9]|[5-9]\.|[1-9][0-9])' && command -v blender)
baker = $(or $(BLENDER),$(blender_on_path))
python_of = $(shell $(BIN)/python -c 'import sys; print("%d.%d" % sys.version_info[:2])')
# pytest's status 5, no tests, is fine where ARGS choose among them.
none_chosen = { [ $$? -eq 5 ] && [ -n "$(ARGS)" ]; }

.PHONY: help env bake test test-web test-long lint types test-core test-plain test-host mutants bench zip format clean
help:
	@echo 'make bake                    bake the demo scene and render it: build/demo.png'
	@echo 'make bake SCENE=x.blend ARGS="--quality high --save y.blend --report r.json"'
	@echo '                             bake any scene with any options of the command line (ARGS=--help lists them);'
	@echo '                             make -s prints nothing of its own. make exits with 2 whatever fails: for the exit'
	@echo '                             statuses 1, 2 and 130 call $(BIN)/python tools/blender_stand_in.py -b x.blend -c photon_bake …'
	@echo 'make test                    lint, types, core tests, host tests; ARGS="-k name" goes to pytest'
	@echo 'make test-long               the tests that it leaves out, since they are slow and rarely break'
	@echo 'make test-web                glTF with baked light in three.js, against Cycles: needs node and a Chromium'
	@echo 'make mutants                 which small changes to formulas no test notices; ARGS go to tests/mutants.py'
	@echo 'make bench                   speed; ARGS go to tests/bench/run.py'
	@echo 'make zip                     the extension for every Blender and platform, into dist/; ARGS="--platform linux-x64"'
	@echo 'make lint, format, clean     ruff; ruff, changing files; removes build/, dist/ and caches (not $(VENV))'
	@echo
	@echo 'PYTHON=python3.11            the interpreter for $(VENV), else the newest that there is of 3.13 and 3.11'
	@echo 'BLENDER=/path/to/blender     bake, and run the host tests, in that Blender instead of the bpy module'

env:
	@sh tools/setup_env.sh $(VENV)

ifeq ($(SCENE),)
bake: env
	@$(call say,'Building the demo scene')
	@mkdir -p build
	@$(BIN)/python tools/demo_scene.py build build/demo.blend >/dev/null
	@$(MAKE) $(if $(quiet),-s) --no-print-directory bake SCENE=build/demo.blend \
		ARGS='$(ARGS) --save build/demo_baked.blend --report build/demo_report.json'
	@$(call say,'Rendering it')
	@$(BIN)/python tools/demo_scene.py render build/demo_baked.blend build/demo.png >/dev/null
	@echo build/demo.png
else ifeq ($(baker),)
bake: env
	@$(call say,'Baking $(SCENE) with the bpy module')
	@$(BIN)/python tools/blender_stand_in.py -b '$(SCENE)' -c photon_bake $(ARGS)
else
bake: env
	@test -r '$(SCENE)' || { echo 'There is no file $(SCENE).' >&2; exit 1; } # Blender would bake its own cube
	@$(call say,'Baking $(SCENE) in $(baker)')
	@resources=$$($(BIN)/python tools/install_zip.py '$(baker)') && \
		BLENDER_USER_RESOURCES="$$resources" '$(baker)' -b '$(SCENE)' -c photon_bake $(ARGS)
endif

# Core and host tests each keep one core busy, so they run beside each other; who is done with the core tests helps.
test: export PHOTON_BAKE_CLAIMS := $(CURDIR)/build/claims
test: lint types
	@$(call say,'Core tests and then some host tests run beside the host tests; what they say comes last')
	@rm -rf build/claims && mkdir -p build/claims
	@{ $(MAKE) --no-print-directory test-core test-plain test-host >build/test_aside.log 2>&1; \
		echo $$? >build/test_aside.status; } & \
		$(MAKE) --no-print-directory test-host; host=$$?; wait; cat build/test_aside.log; \
		[ $$host -eq 0 ] && [ "$$(cat build/test_aside.status)" -eq 0 ]

# pyproject.toml leaves out the tests that are marked so.
test-long: override ARGS := -m long $(ARGS)
test-long: test-core test-host

# Without a lock file, which would hold addresses of registries; package.json has whole versions.
tests/web/node_modules: tests/web/package.json
	@command -v npm >/dev/null || { echo 'There is no npm: install Node.js.' >&2; exit 1; }
	@cd tests/web && npm install --silent --no-package-lock --no-audit --no-fund && touch node_modules

test-web: env tests/web/node_modules
	@$(call say,'Web tests: three.js in Chromium')
	@$(BIN)/python -m pytest tests/host/test_threejs.py -m '' $(ARGS)

lint: env
	@$(call say,'Lint: ruff')
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet . || { echo 'Run `make format`: these are not formatted:'; $(BIN)/ruff format --check .; }

types: env
	@$(call say,'Types: mypy')
	@$(BIN)/mypy

test-core: env
	@$(call say,'Core tests: without Blender')
	@$(BIN)/python -m pytest tests/core $(ARGS) || $(none_chosen)

# A part of what each of these runs by itself: NUMBA_DISABLE_JIT=1 make test-core, NUMBA_BOUNDSCHECK=1 make test-core.
# Kernels that check their indices are compiled anew: for a bake that takes over a minute.
test-plain: env
	@$(call say,'Core tests: kernels as plain Python')
	@NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest tests/core -m 'plain and not minutes' $(ARGS) || $(none_chosen)
	@$(call say,'Core tests: kernels that check their indices')
	@NUMBA_BOUNDSCHECK=1 $(BIN)/python -m pytest tests/core -m 'plain and not minutes' -k 'not every_stage' $(ARGS) || $(none_chosen)

ifeq ($(BLENDER),)
test-host: env
	@$(call say,'Host tests: in the bpy module of Python $(python_of)')
	@$(BIN)/python -m pytest tests/host $(ARGS) || $(none_chosen)
else
# pytest-blender stays out of the environment, since it sends every pytest run there to Blender.
$(VENV)/pytest-blender: | env
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --target $@ 'pytest-blender==3.*'

test-host: env $(VENV)/pytest-blender
	@$(call say,'Host tests: in $(BLENDER) through pytest-blender')
	@resources=$$($(BIN)/python tools/install_zip.py --tests '$(BLENDER)') && \
		BLENDER_USER_RESOURCES="$$resources" PYTHONPATH=$(VENV)/pytest-blender $(BIN)/python -m pytest \
		-p pytest-blender --blender-executable '$(BLENDER)' tests/host $(ARGS) -- --factory-startup || $(none_chosen)
endif

$(VENV)/mutants: | env
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --target $@ 'cosmic-ray==8.7.*'

mutants: env $(VENV)/mutants
	@$(call say,'Mutants')
	@PYTHONPATH=$(VENV)/mutants $(BIN)/python tests/mutants.py $(ARGS)

bench: env
	@$(call say,'Bench')
	@$(BIN)/python tests/bench/run.py $(ARGS)

zip: env
	@$(call say,'Building zips into dist/')
	@$(BIN)/python tools/build_zip.py $(ARGS)

format: env
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

clean:
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name .venv\* -prune -o -name __pycache__ -type d -prune -exec rm -rf {} +
