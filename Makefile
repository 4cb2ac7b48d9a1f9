# chipwise: build, test, install.
#
#   make run        install what is missing, build, install, start the simulated mill
#   make test       install what is missing, build, run every test
#   make bench      the benchmarks; writes build/bench.json
#   make build      components, the C core as a library, C test programs
#   make install    DESTDIR and PREFIX honoured; make uninstall removes the same
#   make deps       the Debian packages needed, only those missing
#   make clean      remove build/
#
# The C core (components/core/*.c) is built three ways: into the components
# (which include it), into build/libchipwise.so for Python, and into the C test
# and benchmark programs.  LinuxCNC's own realtime flags apply to all three.

PREFIX ?= /usr/local
DESTDIR ?=
export PREFIX DESTDIR         # through the environment: any character is allowed
PYTHON = /usr/bin/python3
CC = gcc
HALCOMPILE = halcompile

COMPONENTS = $(sort $(wildcard components/*.comp))
CORE       = $(sort $(wildcard components/core/*.c))
HEADERS    = $(sort $(wildcard components/*.h components/core/*.h))
CORE_TESTS = $(sort $(wildcard tests/core/*.c))
BENCHES    = $(sort $(wildcard bench/*.c))

MODULES  = $(COMPONENTS:components/%.comp=build/modules/%.so)
MANPAGES = $(COMPONENTS:components/%.comp=build/man/%.9) build/man/chipwise.1
OBJECTS  = $(CORE:components/core/%.c=build/core/%.o)
LIBRARY  = $(if $(CORE),build/libchipwise.so)
PROGRAMS = $(CORE_TESTS:tests/core/%.c=build/tests/%) $(BENCHES:bench/%.c=build/bench/%)

# As in LinuxCNC's Makefile.modinc; the warnings are ours.
RTFLAGS = -Os -g -fno-fast-math -fno-unsafe-math-optimizations -mieee-fp \
          -fno-builtin-sin -fno-builtin-cos -fno-builtin-sincos \
          -fPIC -Wframe-larger-than=2560
ifeq ($(filter x86_64 i686,$(shell uname -m)),)
RTFLAGS := $(filter-out -mieee-fp,$(RTFLAGS))
endif
CFLAGS ?= -Wall -Wextra -Werror=implicit-function-declaration

.PHONY: run test bench build install uninstall deps clean
.DELETE_ON_ERROR:

# The steps in their order, each a make of its own: what LinuxCNC's
# development package provides is asked for only once it is there.
run: deps
	@$(MAKE) --no-print-directory build
	@$(MAKE) --no-print-directory install
	@tools/run

test: deps
	@$(MAKE) --no-print-directory build
	@tools/test

bench: deps
	@$(MAKE) --no-print-directory build
	@$(PYTHON) bench/run.py

build: $(MODULES) $(MANPAGES) $(LIBRARY) $(PROGRAMS) build/bench/lib/fine_model.so build/bench/lib/judge.so build/bench/lib/cost

# halcompile puts components/ on the include path, and the result into the
# directory it is started in.
build/modules/%.so: components/%.comp $(CORE) $(HEADERS)
	@mkdir -p $(@D)
	cd $(@D) && $(HALCOMPILE) --compile $(CURDIR)/$<

build/man/%.9: components/%.comp
	@mkdir -p $(@D)
	@$(HALCOMPILE) --document --outfile=$@ $<

build/man/chipwise.1: tools/make_man.py VERSION $(wildcard remap/chipwise/__init__.py remap/chipwise/cli/*.py)
	@mkdir -p $(@D)
	@$(PYTHON) tools/make_man.py $@

build/core/%.o: components/core/%.c $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(RTFLAGS) $(CFLAGS) -Icomponents -c -o $@ $<

# Offline only, a million moves at a time: compiled for speed, so that its loops become vectors.
build/core/height_sweep.o: RTFLAGS := $(filter-out -Os -Wframe-larger-than=%,$(RTFLAGS)) -O3 -fno-math-errno \
                                      -fno-trapping-math -fno-signed-zeros -fassociative-math -ffinite-math-only

build/libchipwise.so: $(OBJECTS)
	$(CC) -shared -o $@ $^ -lm

# Tests may use the stack as they like.
build/tests/%: tests/core/%.c $(OBJECTS) $(HEADERS) $(wildcard tests/core/*.h)
	@mkdir -p $(@D)
	$(CC) $(filter-out -Wframe-larger-than=%,$(RTFLAGS)) $(CFLAGS) -Icomponents -o $@ $< $(OBJECTS) -lm

build/bench/%: bench/%.c $(OBJECTS) $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(RTFLAGS) $(CFLAGS) -Icomponents -o $@ $< $(OBJECTS) -lm

# The benchmarks' own models of the stock: nothing of the core is in them.
build/bench/lib/%.so: bench/lib/%.c
	@mkdir -p $(@D)
	$(CC) -O2 -fPIC -shared $(CFLAGS) -o $@ $< -lm

# The core as the components compile it: one unit, realtime flags.
build/bench/lib/cost: bench/lib/cost.c $(CORE) $(HEADERS)
	@mkdir -p $(@D)
	$(CC) $(RTFLAGS) $(CFLAGS) -DULAPI -Icomponents -I/usr/include/linuxcnc -o $@ $< -lm

install: build
	@$(PYTHON) tools/install.py install

uninstall:
	@$(PYTHON) tools/install.py uninstall

deps:
	@tools/deps

# What tools/on-debian keeps in build/ is root's.
clean:
	@if [ "$$(id -u)" = 0 ] || [ ! -d build/debian ]; then rm -rf build; else sudo rm -rf build; fi
