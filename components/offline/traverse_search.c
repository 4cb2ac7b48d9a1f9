/* SPDX-License-Identifier: GPL-2.0-or-later */
/* traverse_search.c - see height_sweep.h: chip_traverse_improve. */
#include <string.h>

#include "core/chip_math.h"

#include "height_sweep.h"

#define SAME 1e-9 /* mm */
#define CORNERS (CHIP_ROUTE_POINTS + 1)
#define ROUNDS 6
#define TOGETHER 2                                          /* points that are moved at a time, at most */
#define SAVED 1e-5                                          /* s by a step */
#define ENOUGH 5e-4                                         /* s by all steps of a size: else the next size is tried */
static const double SIZES[] = { 4.0, 1.5, 0.5, 0.2, 0.07 }; /* mm */

/* Height of a path over a distance, the highest one where it is straight up. */
static double height_at(long n, const double (*path)[2], double at)
{
    double high = -1e9;
    long k;
    for (k = 0; k + 1 < n; k++) {
        double run = path[k + 1][0] - path[k][0], share;
        if (at < path[k][0] - SAME || at > path[k + 1][0] + SAME) continue;
        if (run < SAME) {
            high = chip_max(high, chip_max(path[k][1], path[k + 1][1]));
            continue;
        }
        share = chip_max(0.0, chip_min(1.0, (at - path[k][0]) / run));
        high = chip_max(high, path[k][1] + share * (path[k + 1][1] - path[k][1]));
    }
    return high;
}

/* Whether a path is nowhere below a limit, but for its ends where it goes straight up or down there. */
static int is_over(long n, const double (*path)[2], long m, const double (*limit)[2])
{
    long k, first = path[1][0] - path[0][0] < SAME, last = n - (path[n - 1][0] - path[n - 2][0] < SAME);
    for (k = 0; k < m; k++)
        if (height_at(n, path, limit[k][0]) < limit[k][1] - CHIP_ROUTE_SAME) return 0;
    for (k = first; k < last; k++)
        if (path[k][1] < height_at(m, limit, path[k][0]) - CHIP_ROUTE_SAME) return 0;
    return 1;
}

/* The points of a route with the one over the corner of its lane, and where they are. Returns their number. */
static long on_lane(const struct chip_lane *c, long n, const double (*route)[2], double (*path)[2], double (*points)[3])
{
    long k, count = 0;
    for (k = 0; k < n; k++) {
        if (k && route[k - 1][0] < c->corner - CHIP_ROUTE_SAME && route[k][0] > c->corner + CHIP_ROUTE_SAME) {
            path[count][0] = c->corner;
            path[count++][1] = height_at(2, route + k - 1, c->corner);
        }
        path[count][0] = route[k][0];
        path[count++][1] = route[k][1];
    }
    for (k = 0; k < count; k++) {
        int beyond = path[k][0] > c->corner || c->corner < CHIP_ROUTE_SAME, a;
        double begin = beyond ? c->corner : 0.0, end = beyond ? c->length : c->corner;
        double share = (path[k][0] - begin) / (end - begin);
        const double *from = c->place + 2 * beyond;
        for (a = 0; a < 2; a++) points[k][a] = from[a] + share * (from[a + 2] - from[a]);
        points[k][2] = path[k][1];
    }
    return count;
}

/* Distance and height of the path with the arcs at its corners: two chords of each, from side to side. Returns their number. */
static long with_arcs(double blend, long n, const double (*path)[2], const double (*points)[3], double (*found)[2])
{
    long k, count = 0;
    int a;
    memcpy(found[count++], path[0], sizeof(path[0]));
    for (k = 1; k + 1 < n; k++) {
        double before = 0.0, after = 0.0, cosine = 0.0, near, reach, off;
        for (a = 0; a < 3; a++) {
            double u = points[k][a] - points[k - 1][a], v = points[k + 1][a] - points[k][a];
            before += u * u;
            after += v * v;
            cosine += u * v;
        }
        before = sqrt(before);
        after = sqrt(after);
        if (before < SAME || after < SAME) continue;
        cosine = chip_max(-1.0, chip_min(1.0, cosine / before / after));
        near = sqrt(0.5 * (1.0 + cosine)); /* cosine of half the turn */
        if (near > 1.0 - 1e-12) continue;
        near = chip_max(near, 1e-6);
        reach = chip_min(blend * sqrt(1.0 - near * near) / (1.0 - near), 0.5 * chip_min(before, after));
        if (reach < SAME) continue;
        off = reach * (1.0 - near) / sqrt(1.0 - near * near);
        off = 0.5 * (off / (reach * sqrt(1.0 - near * near))); /* share of the triangle's height that is cut off */
        for (a = 0; a < 2; a++) {
            double from = path[k][a] + (path[k - 1][a] - path[k][a]) * reach / before;
            double to = path[k][a] + (path[k + 1][a] - path[k][a]) * reach / after;
            found[count][a] = from;
            found[count + 1][a] = path[k][a] + off * (from + to - 2.0 * path[k][a]);
            found[count + 2][a] = to;
        }
        count += 3;
    }
    memcpy(found[count++], path[n - 1], sizeof(path[0]));
    return count;
}

/* The time of a route if it is below `best` and the route may be taken, or CHIP_ROUTE_BAD. */
static double seconds_of(const struct chip_lane *c, long n, const double (*route)[2], double best)
{
    double path[CORNERS][2] = { { 0.0 } }, points[CORNERS][3], arcs[3 * CORNERS][2], seconds;
    long k, count;
    for (k = 1; k < n; k++)
        if (route[k][0] < route[k - 1][0] || route[k][1] > c->top + CHIP_ROUTE_SAME) return CHIP_ROUTE_BAD;
    count = on_lane(c, n, route, path, points);
    seconds = chip_traverse_seconds(count, points, c->speed, c->accel, c->blend);
    if (!(seconds < best)) return CHIP_ROUTE_BAD;
    if (!is_over(count, path, c->limits, (const double(*)[2])c->limit)) return CHIP_ROUTE_BAD;
    k = with_arcs(c->blend, count, path, points, arcs);
    return is_over(k, arcs, c->lowers, (const double(*)[2])c->lower) ? seconds : CHIP_ROUTE_BAD;
}

/* Moves `count` points of a route from k on by a step as often as that saves time. Returns the time. */
static double moved(const struct chip_lane *c, long n, double (*route)[2], long k, long count, const double step[2],
                    double best)
{
    double was[CHIP_ROUTE_POINTS][2], now;
    long i;
    for (;;) {
        memcpy(was, route, sizeof(was[0]) * n);
        for (i = k; i < k + count; i++) {
            route[i][0] += step[0];
            route[i][1] += step[1];
        }
        now = seconds_of(c, n, route, best - SAVED);
        if (now >= CHIP_ROUTE_BAD) break;
        best = now;
    }
    memcpy(route, was, sizeof(was[0]) * n);
    return best;
}

/* Moves each point of a route, but for both ends, then each two and so on, by steps of a size. Returns the time. */
static double all_moved(const struct chip_lane *c, long n, double (*route)[2], double size, double best)
{
    const double steps[4][2] = { { 0.0, size }, { 0.0, -size }, { size, 0.0 }, { -size, 0.0 } };
    int rises = route[1][0] < CHIP_ROUTE_SAME, s; /* straight up: it stays so */
    long k, count;
    for (count = 1; count <= TOGETHER; count++)
        for (k = 1; k + count < n; k++)
            for (s = 0; s < (k == 1 && rises ? 2 : 4); s++) best = moved(c, n, route, k, count, steps[s], best);
    return best;
}

double chip_traverse_improve(const struct chip_lane *c, long n, double (*route)[2], int search)
{
    double best, before;
    unsigned size, round;
    if (n < 2 || n > CHIP_ROUTE_POINTS) return CHIP_ROUTE_BAD;
    best = seconds_of(c, n, route, CHIP_ROUTE_BAD);
    if (best >= CHIP_ROUTE_BAD || !search) return best;
    for (size = 0; size < sizeof(SIZES) / sizeof(SIZES[0]); size++)
        for (round = 0; round < ROUNDS; round++) {
            before = best;
            best = all_moved(c, n, route, SIZES[size], best);
            if (best > before - ENOUGH) break;
        }
    return best;
}
