/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The judge's straight chords that stay within a tolerance of all samples of a log (1 in judge.c).
 *
 * Called by tests/support/judge.py.  Units: mm.
 */
#include <math.h>

#define BACK 3e-5          /* mm: the log's rounding along the path (6 decimals, of an inch at worst) */

/* whether samples a..b lie within `tolerance` of the chord from a to b, in order */
static int straight(const double *p, long a, long b, double tolerance)
{
    double d[3], l2 = 0.0, last = 0.0, back;
    long i;
    int k;

    for (k = 0; k < 3; k++) {
        d[k] = p[3 * b + k] - p[3 * a + k];
        l2 += d[k] * d[k];
    }
    if (l2 < 1e-18)
        return b == a + 1;
    back = BACK / sqrt(l2);
    for (i = a + 1; i < b; i++) {
        double t = 0.0, off = 0.0;
        for (k = 0; k < 3; k++)
            t += (p[3 * i + k] - p[3 * a + k]) * d[k];
        t /= l2;
        if (t < last - back || t > 1.0 + back)      /* turns back; BACK is the log's own rounding */
            return 0;
        last = fmax(t, last);
        for (k = 0; k < 3; k++) {
            double e = p[3 * i + k] - p[3 * a + k] - t * d[k];
            off += e * e;
        }
        if (off > tolerance * tolerance)
            return 0;
    }
    return 1;
}

/* Number of the last sample, from a + 1 on, to which the samples are straight from a. */
static long furthest(long n, const double *p, const unsigned char *apart, double tolerance, long a)
{
    long good = a + 1, top = n - 1, step = 1, i;

    for (i = a + 1; i <= a + 8192 && i < n; i++)
        if (apart[i]) {
            top = i - 1;
            break;
        }
    if (top > a + 8192)
        top = a + 8192;
    while (good < top) {
        long next = good + step > top ? top : good + step;
        if (straight(p, a, next, tolerance)) {
            good = next;
            step *= 2;
        } else if (step == 1) {
            break;
        } else {
            step = step / 4 > 1 ? step / 4 : 1;
            top = next - 1;
        }
    }
    return good;
}

/* Chords over the samples p (n, 3).  apart[i]: nothing is swept between i - 1 and i.
 * first, last (n,): sample numbers of the chord's ends; path (n,): mm travelled at each sample.  -> chords */
long judge_chords(long n, const double *p, const unsigned char *apart, double tolerance, long *first, long *last,
                  double *path)
{
    long a = 0, made = 0, i;
    double total = 0.0;

    path[0] = 0.0;
    while (a < n - 1) {
        long good;
        double d[3], l2 = 0.0, length;
        int k;
        if (apart[a + 1]) {
            path[++a] = total;
            continue;
        }
        good = furthest(n, p, apart, tolerance, a);
        for (k = 0; k < 3; k++) {
            d[k] = p[3 * good + k] - p[3 * a + k];
            l2 += d[k] * d[k];
        }
        length = sqrt(l2);
        for (i = a + 1; i <= good; i++) {
            double t = 0.0;
            for (k = 0; k < 3; k++)
                t += (p[3 * i + k] - p[3 * a + k]) * d[k];
            path[i] = total + (l2 > 1e-18 ? t / length : 0.0);
            if (path[i] < path[i - 1])
                path[i] = path[i - 1];
        }
        total += length;
        if (l2 > 1e-18) {
            first[made] = a;
            last[made] = good;
            made++;
        } else {
            total -= length;
        }
        a = good;
    }
    return made;
}
