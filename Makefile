# Everything a newcomer or a build machine needs: `make` lists it.

PYTHON ?= python3
ENV := .venv
PY := $(ENV)/bin/python
STAMP := $(ENV)/.installed
QUILT := $(PY) -m quiltcli
SEEN := out/demo/pictures
DOCS := docs/pictures

.DEFAULT_GOAL := help
.PHONY: help env demo pictures mirror-pictures test test-long fuzz lint types format bench bench-docs packing-table surfaces golden schema docs dist clean

help: ## list these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

env: $(STAMP) ## make the environment in .venv (PYTHON=python3.12 to choose the interpreter)

# Installed anew only when the list of dependencies changes; an environment that does not run is remade.
$(STAMP): pyproject.toml
	@command -v $(PYTHON) > /dev/null || \
		{ echo "quilt needs Python 3.11 or newer, but there is no $(PYTHON); name one: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "quilt needs Python 3.11 or newer, but $(PYTHON) is $$($(PYTHON) -V); name another: make PYTHON=python3.12" >&2; exit 1; }
	@$(PY) -m pip --version > /dev/null 2>&1 || $(PYTHON) -m venv --clear $(ENV)
	$(PY) -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

demo: env ## render two short walks and pictures of them
	$(QUILT) render scenes/demo.yaml --overwrite
	$(QUILT) preview out/demo/quilt/page_01.0006.exr -o $(SEEN)/box_quilt.png
	$(QUILT) simulate scenes/demo.yaml -f 2,4,6 -o $(SEEN)/box_eye.####.png --heat-map $(SEEN)/box_errors.####.png
	$(QUILT) simulate scenes/demo.yaml -f 6 -o $(SEEN)/box_aside.0006.png --from=-0.35,0.55,1.05 --edges
	$(QUILT) render scenes/demo_sphere.yaml --overwrite
	$(QUILT) preview out/demo_sphere/quilt/page_01.0004.exr -o $(SEEN)/sphere_quilt.png
	$(QUILT) simulate scenes/demo_sphere.yaml -f 4,8 -o $(SEEN)/sphere_eye.####.png
	$(QUILT) simulate scenes/demo_sphere.yaml -f 4 -o $(SEEN)/sphere_aside.0004.png --from 0.9,0.6,1.0 --edges
	@echo; echo "Pictures to look at are in $(CURDIR)/$(SEEN):"
	@echo "  *_eye.*    the display as the viewer sees it      *_aside.*  from another place"
	@echo "  *_quilt    the quilt, tone-mapped                 *_errors.* what differs from a direct picture"
	@echo "Quilts, facet images and reports are in $(CURDIR)/out/demo and $(CURDIR)/out/demo_sphere"

# Reduced to a palette of 256 colours: a picture in the repository is a few dozen kilobytes.
pictures: env ## make the pictures of the README anew
	$(QUILT) simulate scenes/demo.yaml -f 6 -o $(DOCS)/box_eye.png --size 960x720 --supersample 3
	$(QUILT) simulate scenes/demo.yaml -f 6 -o $(DOCS)/box_aside.png --size 960x720 --supersample 3 --from=-0.35,0.55,1.05 --edges
	$(QUILT) simulate scenes/demo_sphere.yaml -f 4 -o $(DOCS)/sphere_eye.png --size 960x720 --supersample 3
	$(QUILT) simulate scenes/demo_sphere.yaml -f 4 -o $(DOCS)/sphere_aside.png --size 960x720 --supersample 3 --from 0.9,0.6,1.0 --edges
	$(QUILT) simulate scenes/demo.yaml -f 4 -o $(DOCS)/box_third.png --size 960x600 --supersample 3 --third-person
	$(QUILT) simulate scenes/demo_stereo.yaml -f 6 -o $(DOCS)/stereo-glasses.png --size 720x540 --supersample 3 --glasses half-color
	$(QUILT) simulate scenes/show_box.yaml -f 9 -o $(DOCS)/show_box.png --size 960x720 --supersample 2
	$(QUILT) simulate scenes/show_sphere.yaml -f 15 -o $(DOCS)/show_sphere.png --size 960x720 --supersample 2
	$(QUILT) simulate scenes/show_corner.yaml -f 12 -o $(DOCS)/show_corner.png --size 960x720 --supersample 2
	$(QUILT) render scenes/demo.yaml -f 6 --overwrite
	$(QUILT) preview out/demo/quilt/page_01.0006.exr -o $(DOCS)/box_quilt.png
	$(QUILT) simulate scenes/demo_hall.yaml -f 1 -o $(DOCS)/textures.png --size 720x480 --supersample 3
	$(QUILT) path scenes/demo_cave.yaml -o $(DOCS)/take.png
	$(QUILT) simulate scenes/demo_cave.yaml -f 120 -o $(DOCS)/cave-take.png --size 960x600 --supersample 2 --third-person
	mv $(DOCS)/cave-take.left.png $(DOCS)/cave-take.png && rm $(DOCS)/cave-take.right.png
	rm -rf out/lobby && $(QUILT) new corner -o out/lobby --left 8x4.5m --right 4.5x4.5m --pitch 6mm --canvas 2112x1024 --place right=1340,0,90 --frames 1-48
	cp out/lobby/plan.png $(DOCS)/wall-plan.png
	$(QUILT) simulate out/lobby/job.yaml -f 1 -o $(DOCS)/wall-eye.png --size 960x540 --supersample 3
	$(QUILT) simulate out/lobby/job.yaml -f 1 -o $(DOCS)/wall-aside.png --size 960x540 --supersample 3 --from 6,2,9 --edges
	$(QUILT) render out/lobby/job.yaml -f 1
	$(QUILT) preview out/lobby/out/quilt/page_01.0001.exr -o $(DOCS)/wall-canvas.png
	rm -rf out/lab && $(QUILT) new cave -o out/lab --size 3x3x3m --pixels 512x512
	$(QUILT) simulate out/lab/job.yaml -f 1 -o $(DOCS)/cave-lab.png --third-person --from 2.6,3.4,5.2 --size 640x400 --supersample 3
	$(PY) docs/pictures/reduce.py $(DOCS)/wall-*.png $(DOCS)/cave-lab.png
	$(PY) -m tests.benchmarks.halftones --write docs/halftones.md --picture $(DOCS)/halftones.png
	$(PY) docs/pictures/lightfield.py $(DOCS)/lightfield.png
	$(QUILT) render scenes/demo.yaml -f 3 --overwrite --set output.channels='[rgba,Z,motion,cryptoobject]' --set render.samples=16
	$(PY) docs/pictures/channels.py out/demo/facets/facet_0001.0003.exr -o $(DOCS)/channels.png
	$(PY) docs/pictures/motion_blur.py -o $(DOCS)/motion-blur.png
	$(PY) docs/pictures/transparency.py -o $(DOCS)/transparency.png
	$(PY) docs/pictures/usd.py -o $(DOCS)/usd.png && $(PY) docs/pictures/reduce.py $(DOCS)/usd.png
	$(PY) docs/pictures/calibrate.py $(DOCS)/calibrate-residuals.png
	$(QUILT) simulate scenes/demo.yaml -f 4 -o $(DOCS)/triptych.png --triptych --size 480x380 --supersample 3
	$(PY) docs/pictures/brightness.py -o $(DOCS)/brightness.png
	$(PY) docs/pictures/projectors.py -o $(DOCS)/projectors.png
	$(QUILT) simulate scenes/study/sphere.yaml -f 9 -o $(DOCS)/study-sphere.png --size 600x480 --supersample 3
	$(QUILT) simulate scenes/study/panel.yaml -f 9 -o $(DOCS)/study-panel.png --size 600x480 --supersample 3
	$(PY) docs/pictures/join.py $(DOCS)/study-cubes.png $(DOCS)/study-sphere.png $(DOCS)/study-panel.png
	$(PY) docs/pictures/points.py out/points
	$(QUILT) simulate out/points/job.yaml -f 1 -o $(DOCS)/points.png --size 720x600 --supersample 3
	$(PY) docs/pictures/study.py tests/analysis/ease/made_up_log.csv $(DOCS)/study-persons.svg
	$(PY) docs/pictures/reduce.py $(DOCS)/brightness.png $(DOCS)/projectors.png $(DOCS)/triptych.png $(DOCS)/calibrate-residuals.png $(DOCS)/study-cubes.png $(DOCS)/points.png $(DOCS)/channels.png $(DOCS)/motion-blur.png $(DOCS)/transparency.png $(DOCS)/lightfield.png $(DOCS)/box_*.png $(DOCS)/sphere_*.png $(DOCS)/textures.png $(DOCS)/take.png $(DOCS)/cave-take.png $(DOCS)/stereo-*.png $(DOCS)/show_*.png

mirror-pictures: env ## make the pictures of docs/lightfield360.md anew
	$(QUILT) render scenes/demo_mirror.yaml --positions 25-48 --overwrite --set output.tones=true
	$(QUILT) preview out/demo_mirror/tones/turn_0001.0025.exr -o $(DOCS)/mirror-tones.png --view srgb
	$(QUILT) unpack out/demo_mirror/packed/dvi.00000002.png -o out/demo_mirror/bits --overwrite
	cp out/demo_mirror/bits/bits.00000025.png $(DOCS)/mirror-bits.png
	for content in mcop diffuse perspective; do \
		$(QUILT) simulate scenes/demo_mirror.yaml --tones --content $$content --eye 30,0.4,1 --size 480x480 --view srgb -o $(DOCS)/mirror-$$content.png --heat-map $(DOCS)/mirror-$$content-errors.png; done
	for distance in 0.56 3; do \
		$(QUILT) simulate scenes/demo_mirror.yaml --slices --eye 30,0.4,$$distance --size 480x480 --view srgb -o $(DOCS)/mirror-slices-$$distance.png; done
	for slit in 0.06,0 0,0.06; do \
		$(QUILT) simulate scenes/demo_mirror.yaml --tones --aperture $$slit --eye 30,0.4,1 --size 480x480 --view srgb -o $(DOCS)/mirror-slit-$$slit.png; done
	mv $(DOCS)/mirror-slit-0.06,0.png $(DOCS)/mirror-slit-across.png; mv $(DOCS)/mirror-slit-0,0.06.png $(DOCS)/mirror-slit-upright.png
	$(PY) docs/pictures/join.py $(DOCS)/mirror-seen.png $(DOCS)/mirror-mcop.png $(DOCS)/mirror-diffuse.png $(DOCS)/mirror-perspective.png
	$(PY) docs/pictures/join.py $(DOCS)/mirror-errors.png $(DOCS)/mirror-mcop-errors.png $(DOCS)/mirror-diffuse-errors.png $(DOCS)/mirror-perspective-errors.png
	$(PY) docs/pictures/join.py $(DOCS)/mirror-slices.png $(DOCS)/mirror-slices-0.56.png $(DOCS)/mirror-slices-3.png
	$(PY) docs/pictures/join.py $(DOCS)/mirror-slits.png $(DOCS)/mirror-slit-across.png $(DOCS)/mirror-slit-upright.png
	$(PY) docs/pictures/join.py $(DOCS)/mirror-shown.png $(DOCS)/mirror-tones.png $(DOCS)/mirror-bits.png
	$(PY) docs/pictures/reduce.py $(DOCS)/mirror-*.png

test: env lint types ## lint, types and all tests but the long ones
	$(PY) -m pytest -n 2

test-long: env ## the tests that take minutes
	$(PY) -m pytest -n 2 -m long

fuzz: env ## spoil inputs of every kind and look for faults: minutes (COUNT=20000 SEED=7: as long as wanted)
	$(PY) -m tests.fuzz --count $(or $(COUNT),2000) --seed $(or $(SEED),1) --keep out/fuzz

lint: env ## mistakes and layout of the code (ruff), misspelt words (codespell)
	$(PY) -m ruff check .
	$(PY) -m ruff format --check .
	$(PY) -m codespell_lib

types: env ## mypy, strict
	$(PY) -m mypy

format: env ## bring the code's layout in order
	$(PY) -m ruff check --fix .
	$(PY) -m ruff format .

bench: env ## measure against Embree, OpenGL and the disk: 9 minutes (BENCH=--quick: one)
	$(PY) -m tests.benchmarks $(BENCH)

bench-docs: env ## the same, and put the tables and pictures into docs/performance.md
	$(PY) -m tests.benchmarks --docs $(BENCH)

packing-table: env ## pack every display by every method and write the tables of docs/packing.md
	$(PY) -m tests.benchmarks.packing --write docs/packing.md

surfaces: env ## measure curved displays, and put tables and pictures into docs/surfaces.md
	$(PY) -m tests.benchmarks.surfaces --docs
	$(PY) docs/pictures/reduce.py $(DOCS)/surfaces.png $(DOCS)/surfaces-two-eyes.png

golden: env ## make the golden pictures anew; look at the differences before committing them
	$(PY) -m pytest tests/system/test_golden.py tests/system/test_golden_turn.py --update-golden

schema: env ## write the schemas of the YAML files anew, docs/schema
	$(PY) -m quiltcli.job.schema docs/schema

docs: schema ## the same, and the reference of their keys, docs/reference
	$(PY) -m quiltcli.job.reference docs/reference

dist: docs ## a wheel and a source distribution, in dist
	$(PY) -m build --outdir dist .

clean: ## remove whatever make and the tests have made, the environment too
	rm -rf $(ENV) out scenes/out build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
