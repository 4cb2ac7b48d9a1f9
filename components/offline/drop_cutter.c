/* SPDX-License-Identifier: GPL-2.0-or-later */
/* drop_cutter.c - the bins, and the tool at points; see drop_cutter.h. Compiled without infinities: CHIP_DROP_NOTHING takes their place. */

#include "drop_parts.h"

/* ---- bins [3] ---------------------------------------------------------------------------------------------------- */

/* The bins that a triangle's box touches: low x, high x, low y, high y. */
static void bins_of(const struct chip_drop_mesh *mesh, const float *t, int32_t range[4])
{
    range[0] = chip_drop_bin_of(chip_min(t[0], chip_min(t[3], t[6])), mesh->bin, mesh->nx);
    range[1] = chip_drop_bin_of(chip_max(t[0], chip_max(t[3], t[6])), mesh->bin, mesh->nx);
    CHIP_FAULT(BINS_SHORT, range[1] = range[0])
    range[2] = chip_drop_bin_of(chip_min(t[1], chip_min(t[4], t[7])), mesh->bin, mesh->ny);
    range[3] = chip_drop_bin_of(chip_max(t[1], chip_max(t[4], t[7])), mesh->bin, mesh->ny);
}

int64_t chip_drop_entries(const struct chip_drop_mesh *mesh)
{
    int64_t sum = 0;
    int32_t k, r[4];
    for (k = 0; k < mesh->n; k++) {
        bins_of(mesh, mesh->triangle + 9 * (int64_t)k, r);
        sum += (int64_t)(r[1] - r[0] + 1) * (r[3] - r[2] + 1);
    }
    return sum;
}

void chip_drop_fill(struct chip_drop_mesh *mesh)
{
    int64_t bins = (int64_t)mesh->nx * mesh->ny, b;
    int32_t k, i, j, r[4], pass;
    for (b = 0; b <= bins; b++) mesh->first[b] = 0;
    for (pass = 0; pass < 2; pass++) {
        for (k = 0; k < mesh->n; k++) {
            bins_of(mesh, mesh->triangle + 9 * (int64_t)k, r);
            for (j = r[2]; j <= r[3]; j++)
                for (i = r[0]; i <= r[1]; i++) {
                    b = (int64_t)j * mesh->nx + i;
                    if (pass)
                        mesh->member[mesh->first[b]++] = k;
                    else
                        mesh->first[b + 1]++;
                }
        }
        if (!pass)
            for (b = 0; b < bins; b++) mesh->first[b + 1] += mesh->first[b];
    }
    for (b = bins; b > 0; b--) mesh->first[b] = mesh->first[b - 1]; /* filling moved each to its end */
    mesh->first[0] = 0;
    for (b = 0; b < bins; b++)
        mesh->bin_top[b] =
            mesh->first[b] < mesh->first[b + 1] ? mesh->top[mesh->member[mesh->first[b]]] : (float)CHIP_DROP_NOTHING;
}

/* How far v is from bin k. */
static double off_bin(double v, int32_t k, double bin)
{
    return chip_max(0.0, chip_max(k * bin - v, v - (k + 1) * bin));
}


/* ---- at points --------------------------------------------------------------------------------------------------- */

static double in_bin(struct chip_drop_mesh *mesh, const struct chip_tool *tool, int32_t i, int32_t j, double x,
                     double y, double z, int32_t *touched)
{
    int64_t b = (int64_t)j * mesh->nx + i;
    double dx, dy, d2, found;
    int32_t m;
    if (mesh->bin_top[b] <= z) return z;
    dx = off_bin(x, i, mesh->bin);
    dy = off_bin(y, j, mesh->bin);
    d2 = dx * dx + dy * dy;
    if (d2 > (tool->radius + CHIP_DROP_RIM) * (tool->radius + CHIP_DROP_RIM)) return z;
    if (mesh->bin_top[b] - chip_tool_height(tool, chip_min(sqrt(d2), tool->radius)) <= z) return z;
    for (m = mesh->first[b]; m < mesh->first[b + 1]; m++) {
        int32_t k = mesh->member[m];
        if (mesh->top[k] <= z) break;
        if (mesh->seen[k] == mesh->stamp) continue;
        mesh->seen[k] = mesh->stamp;
        found = chip_drop_over_triangle(tool, mesh->triangle + 9 * (int64_t)k, x, y, z);
        if (found > z) {
            z = found;
            *touched = k;
        }
    }
    return z;
}

void chip_drop_points(struct chip_drop_mesh *mesh, const struct chip_drop_tool *tool, long n, const double (*xy)[2],
                      double *z)
{
    struct chip_tool profile;
    int32_t i, j, at_i, at_j, i0, i1, j0, j1, touched = 0;
    long k;
    chip_drop_profile_of(&profile, tool);
    for (k = 0; k < n; k++) {
        double x = xy[k][0], y = xy[k][1], found = z[k];
        chip_drop_new_stamp(mesh);
        if (mesh->n > 0) /* the one that was touched last, as points are mostly neighbours */
            found =
                chip_max(found, chip_drop_over_triangle(&profile, mesh->triangle + 9 * (int64_t)touched, x, y, found));
        at_i = chip_drop_bin_of(x, mesh->bin, mesh->nx);
        at_j = chip_drop_bin_of(y, mesh->bin, mesh->ny);
        i0 = chip_drop_bin_of(x - profile.radius - CHIP_DROP_RIM, mesh->bin, mesh->nx);
        i1 = chip_drop_bin_of(x + profile.radius + CHIP_DROP_RIM, mesh->bin, mesh->nx);
        j0 = chip_drop_bin_of(y - profile.radius - CHIP_DROP_RIM, mesh->bin, mesh->ny);
        j1 = chip_drop_bin_of(y + profile.radius + CHIP_DROP_RIM, mesh->bin, mesh->ny);
        found = in_bin(mesh, &profile, at_i, at_j, x, y, found, &touched); /* most often the contact is near */
        for (j = j0; j <= j1; j++)
            for (i = i0; i <= i1; i++) found = in_bin(mesh, &profile, i, j, x, y, found, &touched);
        z[k] = found;
    }
}
