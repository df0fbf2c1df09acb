# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
#
#   make demo     bake the demo file; the results are left in demo/
#   make test     everything: environment, ruff, mypy, pytest
#   make quick    the solver's tests without the slow ones, for while you work: no Blender
#   make assets   make the demo files again with the script that made them
#   make figures  make the pictures and tables of the documentation again, and say which changed; hours, see
#                 python -m benchmarks.regenerate --list
#   make site     the documentation as a site, in site/
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

.PHONY: demo test quick lint assets figures site extension clean

FIGURE := qc3d_addon/demo/figure.blend
BEND := --object Arm --from Basis --to Bend
BLINK := --object Lids --from Basis --to Blink.L

demo: $(VENV)/installed
	rm -rf demo && mkdir demo
	$(BIN)/qc3d bake $(FIGURE) $(BEND) --frames 5 --mode linear --output demo/linear.blend
	$(BIN)/qc3d bake $(FIGURE) $(BEND) --frames 5 --output demo/arm.blend --report demo/arm.json
	$(BIN)/qc3d bake demo/arm.blend $(BLINK) --frames 5 --colliders Eyes --output demo/figure.blend --report demo/lids.json
	$(BIN)/python tools/contact_sheet.py "mode linear=demo/linear.blend" "mode natural=demo/figure.blend" --straight \
	    $(BEND) --view front --output demo/arm.png
	$(BIN)/python tools/contact_sheet.py "mode natural=demo/figure.blend" --straight $(BLINK) --scenery Eye.L \
	    --output demo/lids.png
	rm demo/linear.blend demo/arm.blend
	@echo "Look at demo/arm.png and demo/lids.png, open demo/figure.blend in Blender and press play, read demo/arm.json."

test: $(VENV)/installed lint
	$(BIN)/python -m pytest

quick: $(VENV)/installed
	$(BIN)/python -m pytest tests/solver -m "not slow"

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/mypy

assets: $(VENV)/installed
	$(BIN)/python assets/make_assets.py

figures: $(VENV)/installed
	$(BIN)/python -m benchmarks.regenerate

site: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

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
	rm -rf .venv-* .wheels demo dist site
