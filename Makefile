# chipwise: build, test, install.
#
#   make run        install what is missing, build, install, start the simulated mill
#   make test       install what is missing, build, run the tests: ten minutes
#   make test-all   with those that take long: half an hour
#   make test-long  the same with all random cases, five times as many, and a new seed, which it prints
#   make test-quick the tests that need no machine and little time: a minute
#   make test-shipped  those of the installed form: an ordinary user, the package's setuid rtapi_app; part of test-all
#   make sanitized  the C core and its test programs under ASan and UBSan, in build/sanitized; test-all makes and runs them after a change
#   make coverage   lines and branches of the C core and components/offline that the tests run, in build/coverage: two minutes
#   make lint       ruff, mypy and clang-format over the tree; changes nothing
#   make bench      the benchmarks; writes build/bench.json
#   make build      components, the C core as a library, C test programs
#   make install    DESTDIR and PREFIX honoured; make uninstall removes the same
#   make deb        Debian packages in build/deb, for the Debian and the LinuxCNC of this machine
#   make CROSS=aarch64  realtime modules, library and C test programs for another processor, in build/aarch64, with Debian's cross compiler;
#                   make CROSS=aarch64 deb the package for it; make test-cross runs the C test programs under qemu-user
#   make deps       the Debian packages needed, only those missing
#   make clean      remove build/
#
# The C core (components/core/*.c) is built three ways: into the components
# (which include it), into build/libchipwise.so for Python, and into the C test
# and benchmark programs.  LinuxCNC's own realtime flags apply to all three.
# components/offline/*.c is in the library only.
# build/sanitized has the library and the test programs with the sanitizers.

PREFIX ?= /usr/local
DESTDIR ?=
export PREFIX DESTDIR         # through the environment: any character is allowed
PYTHON = /usr/bin/python3
# A processor other than this machine's, as GNU names it, and where all that depends on the processor is built.
CROSS ?=
BUILD ?= build$(if $(CROSS),/$(CROSS))
TRIPLET = $(if $(CROSS),$(CROSS)-linux-gnu-)
CC = $(TRIPLET)gcc
HALCOMPILE = halcompile
ifneq ($(CROSS),)
.DEFAULT_GOAL = cross
endif

COMPONENTS = $(sort $(wildcard components/*.comp))
CORE       = $(sort $(wildcard components/core/*.c))
OFFLINE    = $(sort $(wildcard components/offline/*.c))
HEADERS    = $(sort $(wildcard components/*.h components/core/*.h components/offline/*.h))
LAYOUT     = remap/chipwise/clib/layout.py build/layout_table.c
CORE_TESTS = $(sort $(wildcard tests/core/*.c))
BENCHES    = $(sort $(wildcard bench/*.c))

MODULES  = $(COMPONENTS:components/%.comp=$(BUILD)/modules/%.so)
COMMANDS = $(notdir $(wildcard bin/*))
MANPAGES = $(COMPONENTS:components/%.comp=build/man/%.9) $(COMMANDS:%=build/man/%.1)
CATALOGUES = $(patsubst remap/chipwise/locale/%.po,build/locale/%/LC_MESSAGES/chipwise.mo,$(wildcard remap/chipwise/locale/*.po))
COMPLETIONS = build/completion/chipwise build/completion/chipwise-sandbox
OBJECTS  = $(CORE:components/core/%.c=$(BUILD)/core/%.o)
OFFLINES = $(OFFLINE:components/offline/%.c=$(BUILD)/offline/%.o)
# Made by this file and tools/make_layout.py.
MADE     = $(BUILD)/version.o $(BUILD)/layout_table.o
LIBRARY  = $(BUILD)/libchipwise.so $(BUILD)/libchipwise_kinematics.so
MODELS   = $(BUILD)/tests/support/fine_model.so $(BUILD)/tests/support/check_oracle.so $(BUILD)/tests/support/drop_oracle.so $(BUILD)/tests/support/judge.so $(BUILD)/tests/support/surface_judge.so $(BUILD)/tests/support/turning_cut.so $(BUILD)/tests/support/turning_oracle.so
PROGRAMS = $(CORE_TESTS:tests/core/%.c=$(BUILD)/tests/%) $(BENCHES:bench/%.c=build/bench/%)

# As in LinuxCNC's Makefile.modinc; the warnings are ours.  No products fused with sums: every processor computes the same figures.
IEEE := $(shell $(CC) -mieee-fp -S -o /dev/null -xc /dev/null 2>/dev/null && echo -mieee-fp)
ROUNDED = -ffp-contract=off
RTFLAGS = -Os -g -fno-fast-math -fno-unsafe-math-optimizations $(IEEE) $(ROUNDED) \
          -fno-builtin-sin -fno-builtin-cos -fno-builtin-sincos \
          -fPIC -Wframe-larger-than=2560
CFLAGS ?= -Wall -Wextra -Werror=implicit-function-declaration
WERROR ?=
override CFLAGS += $(WERROR)
# The folder of LinuxCNC's source, for a LinuxCNC that does not install the headers of its motion (2.10); the last one named counts.
MOTION = build/motion_headers
NAMED := $(shell cat build/motion_source 2>/dev/null)
LINUXCNC_SOURCE ?= $(NAMED)
export LINUXCNC_SOURCE        # through the environment: any character is allowed
# A distribution's own flags, before ours, which stay in force: debian/rules has dpkg-buildflags here, without its optimisation.
HARDENING ?=
LDFLAGS ?=
export LDFLAGS                # halcompile links with them
# What each module is stamped with; remap/chipwise/host/fit.py compares it before a module is loaded.
STAMP = $(BUILD)/stamp.h
NOW_STAMPED := $(shell tools/build_stamp 2>/dev/null)
IS_STAMPED := $(shell sed -n 's/^static.* = "\(.*\)";$$/\1/p' $(STAMP) 2>/dev/null)
# halcompile knows no warnings; its make takes the compiler from here.  The code it generates has unused parameters.
MODULE_CC = $(CC) $(HARDENING) $(ROUNDED) -Wall -Wextra -Wno-unused-parameter $(WERROR) @$(CURDIR)/$(MOTION) @$(CURDIR)/$(BUILD)/options.module
empty =
space = $(empty) $(empty)

CHIPWISE_VERSION = $(shell cat VERSION)

.PHONY: run test test-all test-long test-quick test-shipped test-cross sanitized sanitizers coverage lint bench build cross product install uninstall deb deps clean FORCE
.DELETE_ON_ERROR:

# The steps in their order, each a make of its own: what LinuxCNC's
# development package provides is asked for only once it is there.
run: deps
	@$(MAKE) --no-print-directory build
	@$(MAKE) --no-print-directory install
	@tools/run

test test-all test-long: deps
	-@tools/deps python3-distributed
	-@tools/deps chromium chromium-driver python3-selenium
	-@tools/deps gir1.2-webkit2-4.1
	-@tools/deps valgrind
	-@tools/deps python3-pyqt5 python3-pyqt5.qtsvg python3-pyqt5.qtopengl python3-pyqt5.qsci python3-pyqt5.qtwebengine \
		python3-dbus.mainloop.pyqt5 pyqt5-dev-tools
	@$(MAKE) --no-print-directory build
	@tools/test $(patsubst test-%,--%,$(filter-out test,$@))

test-shipped: deps
	@$(MAKE) --no-print-directory build
	@tools/test --shipped

test-quick: deps
	@$(MAKE) --no-print-directory build
	@tools/test --quick

test-cross: deps
	@tools/deps gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user
	@$(MAKE) --no-print-directory build
	@CHIPWISE_CROSS=all tools/test -n 0 tests/install/test_cross.py

lint:
	@tools/deps mypy clang-format
	@tools/lint

bench: deps
	@$(MAKE) --no-print-directory build
	@$(PYTHON) bench/run.py

build: product $(PROGRAMS) $(MODELS) build/bench/lib/cost

# What is installed.
product: $(LAYOUT) $(MODULES) $(MANPAGES) $(COMPLETIONS) $(CATALOGUES) $(LIBRARY)

# A file of compiler options.
$(MOTION): tools/motion_headers $(if $(filter-out x$(NAMED),x$(LINUXCNC_SOURCE)),FORCE)
	@mkdir -p $(@D)
	@tools/motion_headers "$$LINUXCNC_SOURCE" >$@.new || { rm -f $@.new; exit 1; }
	@mv $@.new $@
	@printf '%s\n' "$$LINUXCNC_SOURCE" >build/motion_source

$(STAMP): tools/build_stamp $(if $(filter-out x$(subst $(space),_,$(IS_STAMPED)),x$(subst $(space),_,$(NOW_STAMPED))),FORCE)
	@mkdir -p $(@D)
	@tools/build_stamp $@

FORCE:

# As the halcompile on the PATH reads it: 2.9 has other types of pins than 2.10.
$(BUILD)/components/%.comp: components/%.comp tools/make_component.py $(STAMP)
	@mkdir -p $(@D)
	@tools/make_component.py $< $@

# halcompile puts the result into the directory it is started in.
$(BUILD)/modules/%.so: $(BUILD)/components/%.comp $(CORE) components/linuxcnc_planner.c $(HEADERS) $(MOTION) $(STAMP) $(if $(CROSS),$(BUILD)/tools/ld $(BUILD)/tools/objcopy)
	@mkdir -p $(@D)
	cd $(@D) && PATH='$(if $(CROSS),$(CURDIR)/$(BUILD)/tools:)'"$$PATH" MAKEFLAGS='CC=$(subst $(space),\ ,$(strip $(MODULE_CC)))' $(HALCOMPILE) --compile $(CURDIR)/$<

.SECONDARY: $(COMPONENTS:%=$(BUILD)/%) $(BUILD)/tools/ld $(BUILD)/tools/objcopy
# halcompile's make calls these two by their plain names.
$(BUILD)/tools/%:
	@mkdir -p $(@D)
	@ln -sf "$$(command -v $(TRIPLET)$(@F))" $@

cross: $(MODULES) $(LIBRARY) $(CORE_TESTS:tests/core/%.c=$(BUILD)/tests/%)

build/man/%.9: $(BUILD)/components/%.comp VERSION
	@mkdir -p $(@D)
	@$(HALCOMPILE) --document --outfile=$@ $<
	@sed -i -E 's/^(\.TH [^"]*"9") "[^"]*" "[^"]*"/\1 "" "chipwise $(CHIPWISE_VERSION)"/' $@

PARSERS = VERSION $(wildcard remap/chipwise/__init__.py remap/chipwise/cli/*.py remap/chipwise/machine/sandbox.py \
                             remap/chipwise/headless/display.py)
build/man/%.1: tools/make_man.py $(PARSERS)
	@mkdir -p $(@D)
	@$(PYTHON) tools/make_man.py $@

build/completion/%: tools/make_completion.py $(PARSERS)
	@mkdir -p $(@D)
	@$(PYTHON) tools/make_completion.py $@

build/locale/%/LC_MESSAGES/chipwise.mo: remap/chipwise/locale/%.po
	@mkdir -p $(@D)
	@msgfmt --check -o $@ $<

$(BUILD)/core/%.o: components/core/%.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(HARDENING) $(RTFLAGS) $(CFLAGS) -Icomponents -c -o $@ $<

# Python's copy of the structures and constants, which is committed, and the table that confirms it: both anew from the headers.
$(LAYOUT) &: tools/make_layout.py $(HEADERS)
	@$(PYTHON) tools/make_layout.py

# Offline only, a million moves at a time: compiled for speed, so that its loops become vectors.
FAST = -O3 -fno-math-errno -fno-trapping-math -fno-signed-zeros -fassociative-math -ffinite-math-only

# Distances to the last bit as numpy has them (nearest_element.h).
$(BUILD)/offline/nearest_element.o: FAST = -O2

$(BUILD)/offline/%.o: components/offline/%.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(HARDENING) $(filter-out -Os -Wframe-larger-than=%,$(RTFLAGS)) $(FAST) $(CFLAGS) -Icomponents -c -o $@ $<

# chip_version of the library; the components have theirs in their man pages.
$(BUILD)/version.c: VERSION
	@mkdir -p $(@D)
	@echo 'const char chip_version[] = "$(CHIPWISE_VERSION)";' >$@

$(BUILD)/version.o: $(BUILD)/version.c
	$(CC) $(HARDENING) $(RTFLAGS) $(CFLAGS) -c -o $@ $<

$(BUILD)/layout_table.o: build/layout_table.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(HARDENING) $(RTFLAGS) $(CFLAGS) -Icomponents -c -o $@ $<

$(BUILD)/libchipwise.so: $(OBJECTS) $(OFFLINES) $(MADE)
	$(CC) -shared $(LDFLAGS) -o $@ $^ -lm

# Stands in for HAL when a kinematics module of LinuxCNC is used offline; a library of its own, because its functions have HAL's names.
$(BUILD)/libchipwise_kinematics.so: components/kinematics_host.c
	@mkdir -p $(@D)
	$(CC) $(HARDENING) -O2 -fPIC -shared $(CFLAGS) $(LDFLAGS) -o $@ $<

# Tests may use the stack as they like.
$(BUILD)/tests/%: tests/core/%.c $(OBJECTS) components/linuxcnc_planner.c $(HEADERS) $(wildcard tests/core/*.h) $(MOTION)
	@mkdir -p $(@D)
	$(CC) $(filter-out -Wframe-larger-than=%,$(RTFLAGS)) $(CFLAGS) -DULAPI -Icomponents @$(MOTION) -I/usr/include/linuxcnc -o $@ $< $(OBJECTS) -lm

build/bench/%: bench/%.c $(OBJECTS) $(HEADERS) $(wildcard tests/core/*.h)
	@mkdir -p $(@D)
	$(CC) $(RTFLAGS) $(CFLAGS) -Icomponents -o $@ $< $(OBJECTS) -lm

# Undefined behaviour of any kind ends the program.  Not -O3 and no target_clones' vectors: the checks are what counts here.
SANITIZE = -O1 -fno-omit-frame-pointer -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all \
           $(filter-out -Os -Wframe-larger-than=%,$(RTFLAGS))
SANITIZED_CORE = $(OBJECTS:build/%=build/sanitized/%)

sanitizers:
	@echo $(SANITIZE)

sanitized: build/sanitized/libchipwise.so $(CORE_TESTS:tests/core/%.c=build/sanitized/tests/%)

build/sanitized/%.o: components/%.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(SANITIZE) $(CFLAGS) -Icomponents -c -o $@ $<

build/sanitized/libchipwise.so: $(SANITIZED_CORE) $(OFFLINES:build/%=build/sanitized/%) $(MADE)
	$(CC) $(SANITIZE) -shared -o $@ $^ -lm

build/sanitized/tests/%: tests/core/%.c $(SANITIZED_CORE) components/linuxcnc_planner.c $(HEADERS) $(wildcard tests/core/*.h) $(MOTION)
	@mkdir -p $(@D)
	$(CC) $(SANITIZE) $(CFLAGS) -DULAPI -Icomponents @$(MOTION) -I/usr/include/linuxcnc -o $@ $< $(SANITIZED_CORE) -lm

# Each line and branch once, as it is written: no optimisation, no copies inlined, no clone for other processors.
COVERED = -O0 --coverage -Dalways_inline=unused -U__gnu_linux__ $(filter-out -Os -Wframe-larger-than=%,$(RTFLAGS))
COVERED_CORE = $(OBJECTS:build/%=build/coverage/%)

coverage: build/coverage/libchipwise.so $(CORE_TESTS:tests/core/%.c=build/coverage/tests/%)
	@tools/coverage

build/coverage/%.o: components/%.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(COVERED) $(CFLAGS) -Icomponents -c -o $@ $<

build/coverage/libchipwise.so: $(COVERED_CORE) $(OFFLINES:build/%=build/coverage/%) $(MADE)
	$(CC) --coverage -shared $(LDFLAGS) -o $@ $^ -lm

# The test program itself is not counted.
build/coverage/tests/%: tests/core/%.c $(COVERED_CORE) components/linuxcnc_planner.c $(HEADERS) $(wildcard tests/core/*.h) $(MOTION)
	@mkdir -p $(@D)
	$(CC) $(filter-out --coverage,$(COVERED)) $(CFLAGS) -DULAPI -Icomponents @$(MOTION) -I/usr/include/linuxcnc -c -o $@.o $<
	$(CC) --coverage -o $@ $@.o $(COVERED_CORE) -lm

# Models of the stock that judge runs, and the oracles of turned parts, depths and surfaces: nothing of the product is in them.
$(BUILD)/tests/support/%.so: tests/support/%.c
	@mkdir -p $(@D)
	$(CC) -O2 -fPIC -shared $(CFLAGS) -o $@ $(filter %.c,$^) -lm

$(BUILD)/tests/support/judge.so: $(sort $(wildcard tests/support/judge_*.[ch]))
$(BUILD)/tests/support/drop_oracle.so $(BUILD)/tests/support/surface_judge.so: tests/support/tool_profile.h

# The core as the components compile it: one unit, realtime flags.
build/bench/lib/cost: bench/lib/cost.c $(CORE) components/linuxcnc_planner.c $(HEADERS) $(MOTION)
	@mkdir -p $(@D)
	$(CC) $(RTFLAGS) $(CFLAGS) -DULAPI -Icomponents @$(MOTION) -I/usr/include/linuxcnc -o $@ $< -lm

install: build
	@$(PYTHON) tools/install.py install

uninstall:
	@$(PYTHON) tools/install.py uninstall

deb:
	@tools/deb $(CROSS)

deps:
	@tools/deps

# What tools/on-debian keeps in build/ is root's.
clean:
	@if [ "$$(id -u)" = 0 ] || [ ! -d build/debian ]; then rm -rf build; else sudo rm -rf build; fi
