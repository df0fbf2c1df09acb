# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
#
#   make demo     bake the demo file; the results are left in demo/
#   make test     everything: environment, ruff, mypy, pytest
#   make quick    the solver's tests without the slow ones, for while you work: no Blender
#   make assets   make the demo files again with the script that made them
#   make extension   the packages for Blender, one for each platform, in dist/; PLATFORM=linux-x64 makes only this one,
#                    EXTRA_PYTHON=3.14 a test build with wheels for one more Python
#
# PYTHON=python3.13 chooses the interpreter; the default is the first of 3.11 and 3.13 that really runs.

PYTHON ?= $(shell tools/find_python)
VERSION := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')
ifeq ($(VERSION),)
$(error QC3D needs python3.11 or python3.13)
endif
VENV := .venv-$(VERSION)
BIN := $(VENV)/bin

.PHONY: demo test quick lint assets extension clean

KEYS := --object Arm --from Basis --to "Bend and twist"

demo: $(VENV)/installed
	rm -rf demo && mkdir demo
	$(BIN)/qc3d bake assets/limb.blend $(KEYS) --frames 5 --keyframes 1 49 \
	    --output demo/limb.blend --report demo/limb.json
	$(BIN)/qc3d bake assets/limb.blend $(KEYS) --frames 5 --keyframes 1 49 --mode linear \
	    --output demo/limb_linear.blend --report demo/limb_linear.json
	$(BIN)/python tools/contact_sheet.py "mode linear=demo/limb_linear.blend" "mode natural=demo/limb.blend" --straight \
	    $(KEYS) --output demo/limb.png
	@echo "Look at demo/limb.png, open demo/limb.blend in Blender and press play, read demo/limb.json."

test: $(VENV)/installed lint
	$(BIN)/python -m pytest

quick: $(VENV)/installed
	$(BIN)/python -m pytest tests/solver -m "not slow"

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/mypy

assets: $(VENV)/installed
	$(BIN)/python assets/make_assets.py

extension: $(VENV)/installed
	$(BIN)/python tools/build_extension.py $(addprefix --platform ,$(PLATFORM)) \
	    $(addprefix --extra-python ,$(EXTRA_PYTHON))

$(VENV)/installed: pyproject.toml blender_manifest.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable '.[test]'
	@$(BIN)/python -c 'import bpy' || { echo "Blender's Python module does not load; on Debian or Ubuntu:" \
	    "apt-get install libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libice6 libgl1"; exit 1; }
	touch $@

clean:
	rm -rf .venv-* .wheels demo dist
