/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The lower edge of a tool, as drop_oracle.profile() has it, for surface_judge.c and drop_oracle.c.  Units: mm. */
#ifndef TOOL_PROFILE_H
#define TOOL_PROFILE_H
#include <math.h>

struct tool {
    double radius, corner;
    double touch;               /* radius at which the corner's round becomes the cone; below 0: no cone */
    double foot, tangent;       /* of the cone: height that it would have on the axis, mm across per mm up */
};

/* Height of the edge above the tip at r from the axis; rises with r. */
static double above_tip(const struct tool *t, double r)
{
    double inner = fmax(r - (t->radius - t->corner), 0.0);

    if (t->touch >= 0.0) {
        if (r > t->touch)
            return t->foot + r / t->tangent;
        inner = r;
    }
    return t->corner - sqrt(fmax(t->corner * t->corner - inner * inner, 0.0));
}

#endif
