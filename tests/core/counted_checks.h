/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Checks that are counted: what the C tests share. */
#ifndef CHIPWISE_TESTS_COUNTED_CHECKS_H
#define CHIPWISE_TESTS_COUNTED_CHECKS_H

#include <math.h>
#include <stdio.h>

#include "../../components/core/chip_math.h"

static int passed, failed;

#define CHECK(condition) check((condition) != 0, __FILE__, __LINE__, #condition)
#define NEAR(value, want, tolerance) near_to((value), (want), (tolerance), __FILE__, __LINE__, #value)

static void check(int ok, const char *file, int line, const char *text)
{
    if (ok) {
        passed++;
        return;
    }
    failed++;
    printf("%s:%d: %s\n", file, line, text);
}

static void near_to(double value, double want, double tolerance, const char *file, int line, const char *text)
{
    if (fabs(value - want) <= tolerance) {
        passed++;
        return;
    }
    failed++;
    printf("%s:%d: %s is %.9g, should be %.9g within %.3g\n", file, line, text, value, want, tolerance);
}

static int report(void)
{
    printf("%d passed, %d failed\n", passed, failed);
    return failed != 0;
}

#endif
