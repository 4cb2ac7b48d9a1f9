/* SPDX-License-Identifier: GPL-2.0-or-later */
/* version.h - the version of the core's interface to Python.
 *
 * Raise it when a function of the shared library changes its meaning or its arguments; changed structures are
 * detected by themselves (tools/make_layout.py).
 */
#ifndef CHIPWISE_VERSION_H
#define CHIPWISE_VERSION_H

#define CHIP_CORE_VERSION 1

#endif
