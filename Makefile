# Each target does its own set-up; stamps keep the second run quick.
SHELL := bash
.SHELLFLAGS := -e -o pipefail -c

# Many a process starts here; one that compiles all that it imports takes seconds longer each time.
unexport PYTHONDONTWRITEBYTECODE

BIN := .venv/bin
VENV_STAMP := .venv/stamp
ROS_STAMP := install/stamp
# Nodes and rclpy need the message libraries on the loader's path before Python starts.
ROS := . install/setup.bash &&

.DEFAULT_GOAL := help
SAFETY_STAMP := .venv/safety

.PHONY: help setup demo screenshots follow test coverage test-slow lint bench soak fuzz audit reproduce study-rths tables scores docs news clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 20

setup: $(ROS_STAMP) ## make .venv, build the interface package, install the nodes

$(VENV_STAMP): pyproject.toml constraints.txt setup.py setup.cfg scripts/find_python.sh \
		scripts/make_venv.sh scripts/mend_ros_wheels.py
	@scripts/make_venv.sh
	@touch $@

$(ROS_STAMP): $(VENV_STAMP) scripts/build_ros.sh scripts/warm_up.py setup.py setup.cfg package.xml \
		$(wildcard msg_defs/*.* msg_defs/*/*.* launch/*.py config/*.yaml config/*/*.yaml)
	@echo 'set-up: compiling for the first calibration and diagnosis meanwhile (a minute or two)'
	@$(BIN)/python scripts/warm_up.py & warm_up=$$!; \
		scripts/build_ros.sh || { kill $$warm_up; exit 1; }; wait $$warm_up
	@touch $@

# make demo DATA=record.csv CHANNELS=map.yaml STIFFNESS=250e3 runs on a laboratory file instead of the simulator.
demo: $(ROS_STAMP) ## 90 s of real nodes, three minutes in all; results in out/demo
	@$(ROS) $(BIN)/python -m examples.demonstration --force --out out/demo \
		$(if $(DATA),--data '$(DATA)') $(if $(CHANNELS),--channels '$(CHANNELS)') \
		$(if $(STIFFNESS),--stiffness '$(STIFFNESS)') $(DEMO_ARGS)

# make screenshots REV=COMMIT photographs another commit beside this one.
screenshots: $(VENV_STAMP) ## report and live page on phone, tablet and desk, in Chromium; out/screenshots
	@$(BIN)/python scripts/screenshots.py $(if $(REV),--rev '$(REV)')

follow: ## the tutorial, word for word, in an empty container (root, ten minutes)
	@scripts/follow_tutorial.sh

test: $(ROS_STAMP) ## all tests but the slow ones
	@$(ROS) $(BIN)/python -m pytest -n 4 --dist loadfile --durations 10 $(PYTEST_ARGS)

# A target of its own: before Python 3.12 every call is traced, and the tests take much longer.
coverage: $(ROS_STAMP) ## the same tests, counting lines; fails below 90 %
	@$(ROS) $(BIN)/python -m pytest -n 2 --dist loadfile --timeout 900 --cov --cov-report term $(PYTEST_ARGS)

test-slow: $(ROS_STAMP) ## the long statistical tests
	@$(ROS) $(BIN)/python -m pytest -m slow -n 2 --durations 10 $(PYTEST_ARGS)

lint: $(VENV_STAMP) ## ruff and mypy --strict
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

bench: $(ROS_STAMP) ## speed, side by side with peers; results in out/bench
	@$(ROS) $(BIN)/python -m benchmarks --out out/bench $(BENCH_ARGS)

soak: $(ROS_STAMP) ## half an hour of all nodes with random faults; result in out/soak (SOAK_ARGS='--minutes 5')
	@$(ROS) $(BIN)/python -m benchmarks.soak --out out/soak $(SOAK_ARGS)

reproduce: $(VENV_STAMP) ## the paper beside our numbers; report in out/reproduce
	@$(BIN)/python -m studies.chen --force --out out/reproduce $(REPRODUCE_ARGS)

study-rths: $(VENV_STAMP) ## predicted stability against simulated hybrid tests, an hour (stopped, it goes on); out/study-rths
	@$(BIN)/python -m studies.hybrid --out out/study-rths --workers 2 $(STUDY_ARGS)

# Seeds 900 and up decide nothing that is reported; a run that was stopped goes on.
tables: $(VENV_STAMP) ## tables of structures of blind machines, and what another choice from them says; out/tables
	@for generator in cases variant mixed far; do \
		$(BIN)/python benchmarks/blind/campaign.py --first 900 --cases 18 --jobs 2 \
			--generator $$generator --out out/tables/$$generator; \
		$(BIN)/python benchmarks/blind/tables.py out/tables/$$generator --generator $$generator; \
	done

# Seeds that nothing was set with; answers of another commit are refused by the page.
scores: $(VENV_STAMP) ## diagnose machines of four generators and write docs/scores.md (SCORE_ARGS='--first 70100 --cases 50')
	@for generator in cases variant mixed far; do \
		$(BIN)/python benchmarks/blind/campaign.py --first 70000 --cases 15 --threads 2 $(SCORE_ARGS) \
			--generator $$generator --out out/scores/$$generator; \
	done
	@$(BIN)/python benchmarks/blind/page.py out/scores --out docs/scores.md

$(SAFETY_STAMP): $(VENV_STAMP)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --editable '.[safety]'
	@touch $@

fuzz: $(SAFETY_STAMP) ## 100 000 inputs of every kind, guided by coverage; result in out/fuzz
	@$(BIN)/python -m benchmarks.fuzz --out out/fuzz $(FUZZ_ARGS)

# --strict: a dependency of which nothing is known is no dependency without vulnerability.
audit: $(SAFETY_STAMP) ## known vulnerabilities of every pinned dependency; asks PyPI
	@$(BIN)/pip-audit --strict --no-deps --disable-pip -r constraints.txt

# Its tools are installed by this target alone.
.venv/docs: $(VENV_STAMP)
	@echo 'docs: installing sphinx and what runs the notebooks'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt --editable '.[docs]'
	@touch $@

# -W: a link that leads nowhere, and a notebook that fails, end the build.
docs: .venv/docs ## renew generated tables; guides, API, executed notebooks as a site in out/docs
	@$(BIN)/python scripts/write_message_reference.py
	@$(BIN)/python scripts/write_effect_table.py
	@$(BIN)/python scripts/write_house_map.py
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs out/docs
	@echo 'docs: out/docs/index.html'

# Version and date go unused: `Forthcoming` is what catkin_prepare_release names after the release.
news: $(VENV_STAMP) ## move the fragments of changelog.d to CHANGELOG.rst
	@$(BIN)/towncrier build --yes --version forthcoming --date ''

clean: ## remove everything that make has made
	rm -rf .venv build install log out *.egg-info
	find . -name __pycache__ -not -path './.git/*' -prune -exec rm -rf {} +
