# SPDX-License-Identifier: GPL-3.0-or-later
# PYTHON     the Python to make .venv from: 3.11, because Blender 4.5's module is for that one
# PIP_ARGS   options for pip, e.g. another package index
# BLENDER    a Blender to use instead of the provisioned one
# WHEELS     a folder with wheels for make zip and make lock that the package index does not have
# CUDA       1: make zip takes the wheels for NVIDIA's cards
# TEST_ARGS  options for pytest, e.g. TEST_ARGS="-k strokes"

SHELL := /bin/bash
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV_PYTHON := .venv/bin/python
INSTALLED := .venv/.installed
DOCS_PYTHON := .venv-docs/bin/python

export PIP_ARGS BLENDER
# Idle OpenMP threads that spin take the cores from the threads that work.
export OMP_WAIT_POLICY := PASSIVE

.PHONY: help demo gallery assets animations test test-plain test-bpy test-bpy-next test-blender test-slow coverage bench bench-page messages reliability lint blender build zip repo lock licences docs release clean

help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 15

demo: $(INSTALLED) ## sketch -> splash in Blender: out/demo.blend and out/demo.png
	$(VENV_PYTHON) scripts/make_demo.py --out out

gallery: $(INSTALLED) ## render the pictures of docs/gallery.md anew: half an hour
	$(VENV_PYTHON) scripts/make_gallery.py --out docs/images/gallery

assets: $(INSTALLED) ## the preset sketches and liquids as an asset library: out/assets
	$(VENV_PYTHON) scripts/make_assets.py --out out/assets

animations: $(INSTALLED) ## simulate and render the animations of docs/animation.md: half an hour
	$(VENV_PYTHON) scripts/animate.py crown letter_s --out docs/images --cache out/animation

test: lint ## every check: lint, types, and the tests in plain Python, the bpy module and Blender
	tests/every_way.sh $(TEST_ARGS)

test-plain: $(INSTALLED) ## the tests in plain Python, without Blender
	tests/every_way.sh --only plain $(TEST_ARGS)

test-bpy: $(INSTALLED) ## the tests under Blender's Python module, 4.5
	tests/every_way.sh --only bpy $(TEST_ARGS)

test-bpy-next: $(INSTALLED) ## the tests about Blender under the module of the next version, 5.0
	tests/every_way.sh --only bpy-next $(TEST_ARGS)

test-blender: $(INSTALLED) ## the tests in a real Blender: BLENDER, or the provisioned one
	tests/every_way.sh --only blender $(TEST_ARGS)

coverage: $(INSTALLED) ## how much of the code the tests run, in plain Python and under the bpy module
	$(VENV_PYTHON) -m coverage erase
	LIQUID_SPLASH_NO_BPY=1 $(VENV_PYTHON) -m coverage run tests/run.py $(TEST_ARGS)
	$(VENV_PYTHON) -m coverage run tests/run.py $(TEST_ARGS)
	$(VENV_PYTHON) -m coverage combine
	$(VENV_PYTHON) -m coverage report --include="liquid_splash_addon/core/*,training/*" --fail-under=90
	$(VENV_PYTHON) -m coverage report --include="liquid_splash_addon/blender/*" --fail-under=85

test-slow: lint ## the tests that `make test` has no time for
	tests/every_way.sh --slow $(TEST_ARGS)

bench: $(INSTALLED) ## benchmarks: out/bench.json
	$(VENV_PYTHON) -m tests.benchmarks.bench --out out/bench.json

bench-page: $(INSTALLED) ## docs/benchmarks.md anew, from what `make bench` has measured
	$(VENV_PYTHON) -m tests.benchmarks.page $(wildcard out/bench.json)

lint: $(INSTALLED) ## formatting, style, types
	$(VENV_PYTHON) -m ruff format --check .
	$(VENV_PYTHON) -m ruff check .
	$(VENV_PYTHON) -m mypy

blender: $(INSTALLED) ## provision a real Blender from Debian (needs root), outside the checkout
	PIP="$(VENV_PYTHON) -m pip" tests/provision_blender.sh
	@echo "tests/blender.sh runs it"

build: $(INSTALLED) ## the extension's light zip, in dist/
	$(VENV_PYTHON) build.py

zip: $(INSTALLED) ## the light zip, and one with all wheels for each platform and Python
	$(VENV_PYTHON) build.py --all $(if $(WHEELS),--wheels "$(WHEELS)") $(if $(CUDA),--cuda)

repo: $(INSTALLED) ## what `make zip` built, as a repository that Blender subscribes to
	$(VENV_PYTHON) -m scripts.extension.repository

lock: $(INSTALLED) ## list the wheels of the zips anew, with their hashes
	$(VENV_PYTHON) -m scripts.extension.lock $(if $(WHEELS),--wheels "$(WHEELS)")

licences: $(INSTALLED) ## the table of docs/licences.md: what the zips contain, and its licences
	$(VENV_PYTHON) -m scripts.extension.notices

messages: $(INSTALLED) ## the list of docs/messages.md anew: what the add-on says, from its sources
	$(VENV_PYTHON) -m scripts.messages

reliability: $(INSTALLED) ## docs/reliability.md anew: fuzzer, soak and injections, an hour
	mkdir -p out/reliability
	$(VENV_PYTHON) -m tests.blender.scene_fuzzer 50 2000 --out out/reliability/fuzzer.json
	$(VENV_PYTHON) -m tests.blender.soak --out out/reliability/soak.json
	$(VENV_PYTHON) tests/run.py tests/blender/test_injections.py --junit-xml out/reliability/injections.xml
	$(VENV_PYTHON) -m scripts.reliability out/reliability

docs: $(DOCS_PYTHON) ## the documentation as a site: out/site; a warning or broken link fails
	NO_MKDOCS_2_WARNING=1 $(DOCS_PYTHON) -m mkdocs build --strict

release: $(INSTALLED) ## check that the version can be released, and tag it
	$(VENV_PYTHON) scripts/release.py

clean: ## remove what the other targets made, except .venv, .venv-docs and the provisioned Blender
	rm -rf build dist out .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -not -path './.venv*/*' -prune -exec rm -rf {} +

# An environment of its own: nothing here may change what the tests run with.
$(DOCS_PYTHON): docs/requirements.txt
	$(PYTHON) -m venv --clear .venv-docs
	$(DOCS_PYTHON) -m pip install $(PIP_ARGS) --requirement docs/requirements.txt
	touch $@

$(INSTALLED): requirements.txt
	$(PYTHON) -c 'import sys; sys.version_info[:2] == (3, 11) or sys.exit("This needs Python 3.11: make PYTHON=...")'
	test -x $(VENV_PYTHON) || $(PYTHON) -m venv .venv
	$(VENV_PYTHON) -m pip install $(PIP_ARGS) --requirement requirements.txt
	touch $@
