# make bake        set up, and bake the Cornell box sample into build/
# make test        set up, and run every check, on each Python that Blender uses and this machine has
# make extension   one installable package per platform, in build/extension/
# make repository  and a listing of them in build/repository/, to put on any web server as an extension repository
# make test-4.5    the tests on Blender 4.5 as well
# make test-5.3    the same on Blender 5.3
# make lint        the style and type checks alone
# make samples     rebuild the sample scenes from their scripts
# make accuracy    measure the samples against Cycles, for docs/accuracy.md: takes long
# make bench       measure speed and honesty on six scenes beside Cycles, for docs/speed.md: takes half an hour
# make effects     measure every effect against Cycles, for docs/effects.md
# make colours     measure vertex colours beside Cycles' and the best fit, for docs/vertex_colours.md
# make fuzz        try thousands of random scenes, and a thousand faults of each kind: takes hours
# make reliability run the hard cases on each Blender that has an environment here, for docs/reliability.md
# make test-gui    drive a real Blender window (needs one: see tests/gui)

.DEFAULT_GOAL := bake
.PHONY: bake test test-own test-other test-3.13 test-4.5 test-5.3 lint samples extension repository accuracy bench effects colours fuzz reliability test-gui clean

SAMPLE := sample_blends/cornell_box_area_lamp.blend

# Blender 5.0 as a Python module needs Python 3.11, Blender 5.2 needs 3.13. Every recipe works with either.
PYTHON = $(shell packaging/find-python 3.11 3.13)
PYTEST = -m pytest --quiet
PYTHON_3.11 = $(shell packaging/find-python 3.11)
PYTHON_3.13 = $(shell packaging/find-python 3.13)

bake: .venv/ready
	@mkdir -p build
	@.venv/bin/radiosity-baker bake $(SAMPLE) --output build/cornell_box.blend --preview build/cornell_box.png --report build/report.json
	@echo "Look at build/cornell_box.png, open build/cornell_box.blend in Blender; the figures are in build/report.json."

# Both Pythons at once: a test seldom keeps more than one core busy.
test: lint
	@$(MAKE) --jobs=2 $(if $(filter output-sync,$(.FEATURES)),--output-sync) test-own test-other

test-own: .venv/ready
	.venv/bin/python $(PYTEST)

test-other: .venv/ready
	@if .venv/bin/python -c 'import sys; sys.exit(sys.version_info < (3, 13))'; then \
	    echo "SKIPPED: the tests on Python 3.11, which Blender 4.3 to 5.0 use: none that runs was found."; \
	elif test -n "$(PYTHON_3.13)"; then $(MAKE) test-3.13; \
	else \
	    echo "SKIPPED: the tests on Python 3.13, which Blender 5.1 and later use: none that runs was found."; \
	fi

test-3.13: .venv-3.13/ready
	.venv-3.13/bin/python $(PYTEST)

test-4.5: .venv-4.5/ready
	.venv-4.5/bin/python $(PYTEST)

test-5.3: .venv-5.3/ready
	.venv-5.3/bin/python $(PYTEST)

lint: .venv/ready
	.venv/bin/ruff check --quiet
	.venv/bin/ruff format --check --quiet
	.venv/bin/mypy

extension: .venv/ready
	.venv/bin/python packaging/build_extension.py

repository: extension
	.venv/bin/python packaging/build_repository.py

samples: .venv-4.5/ready
	for script in $$(grep -l __main__ sample_blends/*.py); do .venv-4.5/bin/python $$script || exit 1; done

accuracy: .venv/ready
	.venv/bin/python docs/measure.py

bench: .venv/ready
	.venv/bin/python -m radiosity_baker.docs.bench

effects: .venv/ready
	.venv/bin/python -m radiosity_baker.docs.effects

colours: .venv/ready
	.venv/bin/python -m radiosity_baker.docs.colours

fuzz: .venv/ready
	rm -f build/fuzz.jsonl
	.venv/bin/python -m pytest --quiet tests/hard_cases --hypothesis-profile=fuzz

reliability: .venv/ready
	.venv/bin/python docs/reliability.py

test-gui: extension
	tests/gui/run

# The environments are made once, and again when pyproject.toml changes.
.venv/ready: pyproject.toml
	@test -x .venv/bin/python || test -n "$(PYTHON)" || \
	    { echo "Radiosity Baker needs Python 3.11 or 3.13 (with venv), and found neither. Install one and try again." >&2; exit 2; }
	@echo "Setting up .venv; the first time this downloads Blender as a Python module (about 400 MB)."
	test -x .venv/bin/python || "$(PYTHON)" -m venv .venv
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[blender,dev]'
	@touch $@

.venv-3.13/ready: pyproject.toml
	test -x .venv-3.13/bin/python || "$(PYTHON_3.13)" -m venv .venv-3.13
	.venv-3.13/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[blender,dev]'
	@touch $@

# The oldest Blender at hand as a module: every supported Blender reads the files it saves.
.venv-4.5/ready: pyproject.toml
	@test -n "$(PYTHON_3.11)" || { echo "This needs Blender 4.5 as a Python module, and so Python 3.11." >&2; exit 2; }
	test -x .venv-4.5/bin/python || "$(PYTHON_3.11)" -m venv .venv-4.5
	.venv-4.5/bin/python -m pip install --quiet --disable-pip-version-check 'bpy==4.5.*' --editable '.[dev]'
	@touch $@

.venv-5.3/ready: pyproject.toml
	@test -n "$(PYTHON_3.13)" || { echo "This needs Blender 5.3 as a Python module, and so Python 3.13." >&2; exit 2; }
	test -x .venv-5.3/bin/python || "$(PYTHON_3.13)" -m venv .venv-5.3
	.venv-5.3/bin/python -m pip install --quiet --disable-pip-version-check 'bpy==5.3.*' --editable '.[dev]'
	@touch $@

clean:
	rm -rf build .mypy_cache .pytest_cache .ruff_cache .hypothesis
