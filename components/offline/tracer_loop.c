/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_loop.c - see tracer_loop.h. */
#include "offline/tracer_loop.h"

void chip_tracer_loop(struct chip_tracer *tracer, const struct chip_tracer_settings *settings,
                      struct chip_stylus *stylus, const struct chip_stylus_settings *model, double p[3],
                      double period_s, int is_enabled, double feed_share, long count, struct chip_tracer_row *rows)
{
    struct chip_tracer_in in = { .is_enabled = is_enabled, .feed_share = feed_share, .period_s = period_s };
    struct chip_tracer_out out;
    long k;
    int i;
    for (k = 0; k < count; k++) {
        struct chip_tracer_row *row = rows + k;
        chip_stylus_step(stylus, model, p, in.deflection_mm, row->deflection_mm);
        for (i = 0; i < 3; i++) in.position_mm[i] = row->position_mm[i] = p[i];
        chip_tracer_step(tracer, settings, &in, &out);
        for (i = 0; i < 3; i++) {
            row->ball_mm[i] = stylus->ball_mm[i];
            row->velocity_mm_s[i] = out.velocity_mm_s[i];
            row->seen_ball_mm[i] = out.ball_mm[i];
            row->normal[i] = out.normal[i];
            p[i] += period_s * out.velocity_mm_s[i];
        }
        row->measured_mm = out.deflection_mm;
        row->velocity_limit_mm_s = out.velocity_limit_mm_s;
        row->tangential_vel_mm_s = out.tangential_vel_mm_s;
        row->friction_share = out.friction_share;
        row->gain_hz = out.gain_hz;
        row->state = out.state_number;
        row->fault = out.fault_number;
        row->limited_by = out.limit_number;
        row->lines = out.line_count;
    }
}
