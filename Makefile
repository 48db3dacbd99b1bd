# make study   sets umbra up in .venv and studies an example city quarter
# make test    sets it up with what the tests need and runs them all
# make help    lists the rest

PYTHON ?= python3
VENV ?= .venv
OUT ?= out

PY := $(VENV)/bin/python
UMBRA := $(VENV)/bin/umbra
SOURCES := $(shell find src -name '*.py')

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup study test fuzz lint docs wheel bench pictures clean

help:
	@echo "make setup     umbra and the packages it needs, in $(VENV)"
	@echo "make study     a shadow study of an example city quarter, from nothing to pictures"
	@echo "make test      every test"
	@echo "make fuzz      edited views for a minute, then small files that ask for much, then damaged ones of every format for a minute (SECONDS=600: for ten; SEED=1: others)"
	@echo "make lint      ruff (rules and format), mypy and import-linter"
	@echo "make docs      the documentation, in docs/_build/html"
	@echo "make wheel     the wheel and the source archive, in $(OUT)/dist, installed alone and tried on the example"
	@echo "make bench     the benchmarks at small sizes (umbra bench NAME: in full)"
	@echo "make pictures  the pictures of README.md and docs/, made anew"
	@echo "make clean     delete what all these made, and $(VENV)"

# -- the virtual environment: one stamp for each group of packages -----------------------

$(PY):
	@command -v $(PYTHON) >/dev/null || { \
	  echo "There is no '$(PYTHON)' here: install Python 3.11 or newer," \
	       "or name it: make PYTHON=/path/to/python3" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "umbra needs Python 3.11 or newer; '$(PYTHON)' is $$($(PYTHON) -V 2>&1)." \
	       "Name another: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo "'$(PYTHON)' cannot make virtual environments. On Debian and Ubuntu:" \
	       "apt install python3-venv" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV)
	@$(PY) -m pip install --quiet --disable-pip-version-check --upgrade 'pip>=25.1'

$(VENV)/.umbra: pyproject.toml | $(PY)
	@echo "installing umbra and the packages it needs into $(VENV) (once; a minute on an idle computer with a fast network)"
	@$(PY) -m pip install --quiet --editable .
	@touch $@

# The tests use every extra; each is named once, in pyproject.toml.
WITH_test := --editable '.[cad,city,citygml,dxf,gis,gl,gltf,ifc,notebook,vectors,video,view,wgpu]' --editable './benchmarks[embree]'

$(VENV)/.test $(VENV)/.lint $(VENV)/.docs $(VENV)/.wheel: $(VENV)/.%: $(VENV)/.umbra
	@echo "installing the packages of the group '$*' into $(VENV)"
	@$(PY) -m pip install --quiet $(WITH_$*) --group $*
	@touch $@

# Without a driver of the system's, the tests use OpenGL from PyPI (84 MB) where there is one.
$(VENV)/.opengl: $(VENV)/.test
	@$(PY) -c 'from umbra.gl.context import open_device; open_device()' 2>/dev/null || { \
	  echo "no OpenGL here: installing one from PyPI into $(VENV)"; \
	  $(PY) -m pip install --quiet --only-binary :all: --editable '.[osmesa]' || \
	    echo "PyPI has none for this machine: tests of OpenGL will skip"; }
	@touch $@

$(VENV)/.test: benchmarks/pyproject.toml

setup: $(VENV)/.umbra
	@echo "umbra is installed: $(UMBRA) --help"

# -- the example -------------------------------------------------------------------------

BLOCK := $(OUT)/city_block.city.json
STUDY := --date 2026-03-21 --from 09:00 --to 17:00 --every 15min \
         --extent 2545,340005,2895,340245

$(BLOCK): examples/city_block.py | $(PY)
	$(PY) examples/city_block.py $@ >/dev/null

$(OUT)/city_block/study.nc: $(BLOCK) $(VENV)/.umbra $(SOURCES)
	$(UMBRA) study $(BLOCK) $(STUDY) --cell 0.25 --out $(OUT)/city_block >/dev/null

$(OUT)/city_block.png: $(BLOCK) $(VENV)/.umbra $(SOURCES)
	$(UMBRA) render $(BLOCK) --eye 2640,339790,370 --target 2702,340118,180 --fov 25 \
	  --light -0.75,-0.25,0.5,0 --ground 171 --size 1200x640 --out $@ >/dev/null

study: $(OUT)/city_block/study.nc $(OUT)/city_block.png
	@echo
	@echo "An invented quarter of Vienna on 21 March 2026, 9:00 to 17:00. Look at"
	@echo "  $(OUT)/city_block/hours.png    how long each place lies in shadow"
	@echo "  $(OUT)/city_block/profile.png  where the shadows fall at 9:00, 12:00 and 15:00"
	@echo "  $(OUT)/city_block.png          the quarter itself, seen from the south"
	@echo "The figures are in $(OUT)/city_block/study.nc, the model in $(BLOCK)"

# -- checks ------------------------------------------------------------------------------

# One more than cores: tests of browsers, windows and Ctrl-C often wait.
WORKERS ?= $(shell $(PYTHON) -c 'import os; print((os.cpu_count() or 1) + 1)')

test: $(VENV)/.opengl
	$(PY) -m pytest -n $(WORKERS) --dist loadfile $(ARGS)

BOMBS ?= --bombs

fuzz: $(VENV)/.test
	$(PY) tests/fuzz/sequences.py --seconds $(or $(SECONDS),60) --seed $(or $(SEED),0)
	$(PY) tests/fuzz/run.py $(BOMBS) --seconds $(or $(SECONDS),60) --seed $(or $(SEED),0) --keep $(OUT)/fuzz

lint: $(VENV)/.lint
	$(VENV)/bin/ruff check .
	$(VENV)/bin/ruff format --check .
	$(VENV)/bin/mypy
	$(VENV)/bin/lint-imports --no-cache

docs: $(VENV)/.docs
	$(VENV)/bin/sphinx-build -W --keep-going -q -b html docs docs/_build/html
	@echo docs/_build/html/index.html

wheel: $(VENV)/.wheel
	rm -rf $(OUT)/dist
	$(PY) -m build --outdir $(OUT)/dist . >/dev/null
	$(PY) tests/wheel/run.py $(OUT)/dist $(OUT)/wheel

bench: $(VENV)/.test
	for name in city study frame silhouette startup tools mcguire wallner weng soft; do $(UMBRA) bench $$name --quick || exit 1; done

pictures: study $(VENV)/.test
	$(UMBRA) study $(BLOCK) $(STUDY) --cell 0.25 --sheet --quiet --out $(OUT)/sheet
	$(UMBRA) study $(BLOCK) --date 2026-03-21 --receivers 215/35 --quiet --out $(OUT)/above
	$(UMBRA) study $(BLOCK) --date 2026-03-21,2026-06-21,2026-09-21,2026-12-21 --every 1h \
	  --extent 2500,340005,2900,340305 --cell 0.25 --quiet --out $(OUT)/seasons
	$(UMBRA) study $(BLOCK) --date 2026-03-21 --receivers top --proposed Tower --cell 0.25 \
	  --quiet --out $(OUT)/tower
	$(UMBRA) envelope $(BLOCK) --plot examples/envelope/plot.geojson --points examples/envelope/windows.csv \
	  --rules examples/envelope/three_of_seven.yaml --year 2026 --max 40 --quiet --out $(OUT)/envelope
	$(UMBRA) sky $(BLOCK) --at 2713,340080,172 --date 2026-03-21 --out $(OUT)/sky
	$(UMBRA) sky $(BLOCK) --at 2713,340080,172,0,-1,0 --date 2026-03-21 --projection waldram --out $(OUT)/waldram
	cp $(OUT)/above/hours.png $(OUT)/above.png
	cp $(OUT)/waldram/sky.png $(OUT)/sky_waldram.png
	cp $(OUT)/seasons/profile.png $(OUT)/seasons.png
	$(PY) examples/draw_diagrams.py docs/pictures
	$(PY) examples/count_in_a_frame.py $(OUT)
	$(PY) examples/hall.py $(OUT)
	$(PY) examples/three_cases.py $(OUT)
	$(PY) examples/frame_by_pass.py $(OUT)
	$(PY) examples/soft_shadows.py $(OUT) --samples 1024
	$(PY) docs/shrink.py $(OUT)/city_block/hours.png $(OUT)/city_block/profile.png \
	  $(OUT)/city_block.png $(OUT)/hall.png $(OUT)/three_cases.png $(OUT)/volumes.png $(OUT)/frame_by_pass.png $(OUT)/table.png $(OUT)/table_count.png \
	  $(OUT)/soft_shadows.png $(OUT)/soft_errors.png $(OUT)/sheet/sheet.png $(OUT)/above.png \
	  $(OUT)/seasons.png $(OUT)/tower/hours_lost.png $(OUT)/envelope/envelope.png \
	  $(OUT)/sky/sky.png $(OUT)/sky_waldram.png docs/pictures
	$(UMBRA) view $(BLOCK) --date 2026-03-21 --proposed Tower --out $(OUT)/scene.html
	$(PY) docs/film_page.py $(OUT)/scene.html docs/pictures/live.webp
	$(PY) docs/film_page.py $(OUT)/scene.html docs/pictures/live.png \
	  "at=2026-03-21T900&show=11011&hours=540,1020&compare=after"
	cp $(OUT)/hall_soft.png docs/pictures  # in 256 colours its penumbrae would band

clean:
	rm -rf $(VENV) $(OUT) docs/_build .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find src benchmarks tests docs examples -name __pycache__ -prune -exec rm -rf {} +
