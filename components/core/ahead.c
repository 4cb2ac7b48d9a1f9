/* ahead.c - see ahead.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "ahead.h"

#define CW_STILL 1e-6           /* mm, a step below this has no heading */
#define CW_OFF_COURSE 0.25      /* cells the tool may stray from the prediction */
#define CW_OFF_HEADING 0.02     /* rad, likewise: 0.4 mm at 20 mm ahead */
#define CW_SHARP 0.2            /* rad in one step: a corner, not an arc */
#define CW_RISE 1.1             /* a sample this much above the one before is a step of the load */
#define CW_TOUCH 1e-3           /* mm2, less is no contact */
#define CW_GRAZE 2.0            /* cells, a strip of stock this wide is none: see touches() */
#define CW_MERGE 1.15           /* levels closer than this are given as one */

static double spacing(const struct cw_stock *stock) { return CW_AHEAD_SPACING * stock->cell; }

void cw_ahead_reset(struct cw_ahead *ahead)
{
    ahead->known = 0;
    ahead->first = ahead->count = 0;
    ahead->turn = ahead->curvature = 0.0;
    ahead->last_step = 0.0;
    ahead->held = 0.0;
    ahead->speed = 0.0;
}

static double wrap(double angle)
{
    while (angle > CW_PI) angle -= 2.0 * CW_PI;
    while (angle < -CW_PI) angle += 2.0 * CW_PI;
    return angle;
}

/* Place and direction on the predicted way, `s` mm of travel behind the origin [1]. */
static void predict(const struct cw_ahead *ahead, double s, double tip[3], double dir[3])
{
    double flat = s * ahead->level, bend = ahead->curvature * flat;
    double half = 0.5 * bend;
    double chord = flat * (fabs(half) < 1e-6 ? 1.0 : sin(half) / half);
    tip[0] = ahead->origin[0] + chord * cos(ahead->heading + half);
    tip[1] = ahead->origin[1] + chord * sin(ahead->heading + half);
    tip[2] = ahead->origin[2] + s * ahead->slope;
    dir[0] = ahead->level * cos(ahead->heading + bend);
    dir[1] = ahead->level * sin(ahead->heading + bend);
    dir[2] = ahead->slope;
}

/* Curvature is believed when two steps running agree about it. */
static double confirmed(const struct cw_ahead *ahead, double turn)
{
    double a = fabs(turn), b = fabs(ahead->turn);
    if (turn * ahead->turn <= 0.0) return 0.0;
    if (cw_max(a, b) > 1.5 * cw_min(a, b)) return 0.0;
    return 0.5 * (turn + ahead->turn);
}

/* Starts a new prediction at the tip [2]. */
static void new_origin(struct cw_ahead *ahead, const double tip[3], const double unit[3],
                       double heading, double step, double turn)
{
    int i;
    for (i = 0; i < 3; i++) ahead->origin[i] = tip[i];
    ahead->level = sqrt(unit[0] * unit[0] + unit[1] * unit[1]);
    ahead->slope = unit[2];
    ahead->curvature = confirmed(ahead, turn);
    ahead->heading = heading + 0.5 * ahead->curvature * step * ahead->level;
    ahead->travelled = 0.0;
    ahead->first = ahead->count = 0;
    ahead->known = 1;
}

/* Whether the step that ended at `tip` keeps to the prediction. */
static int on_course(const struct cw_ahead *ahead, const double cell, const double tip[3],
                     const double unit[3], double step)
{
    double at[3], dir[3], off2 = 0.0, aim2 = 0.0;
    int i;
    if (!ahead->known) return 0;
    predict(ahead, ahead->travelled + step, at, dir);
    for (i = 0; i < 3; i++) {
        off2 += (tip[i] - at[i]) * (tip[i] - at[i]);
        aim2 += (unit[i] - dir[i]) * (unit[i] - dir[i]);
    }
    return off2 < CW_OFF_COURSE * CW_OFF_COURSE * cell * cell
        && aim2 < CW_OFF_HEADING * CW_OFF_HEADING;
}

static double sample(const struct cw_ahead *ahead, int i)
{
    int last = ahead->first + ahead->count - 1;
    i = i < ahead->first ? ahead->first : (i > last ? last : i);
    return ahead->area[i % CW_AHEAD_SAMPLES];
}

/* Load at the tool: between the sample behind and the one in front. Interpolated heights
 * smear an edge of the stock over a cell, and near an edge the load changes with the root
 * of the way: a rise counts from the sample behind on, a fall one sample late [3]. */
static double area_now(const struct cw_ahead *ahead, const struct cw_stock *stock)
{
    double s = ahead->travelled / spacing(stock);      /* in samples */
    int i = (int)floor(s);
    double past, a, b;
    if (ahead->count == 0) return ahead->held;
    past = sample(ahead, i - 1);
    a = sample(ahead, i);
    b = sample(ahead, i + 1);
    if (i < ahead->first) past = cw_max(a, s < 1.0 ? ahead->held : 0.0);
    if (b > CW_RISE * a) return cw_max(b, past);
    if (past > CW_RISE * cw_min(a, b)) return past;
    return a + (s - i) * (b - a);
}

/* Drops samples that lie behind, takes new ones in front, nearest first [2]. */
static void take_samples(struct cw_ahead *ahead, const struct cw_stock *stock,
                         const struct cw_tool *tool, double horizon, int budget)
{
    double behind = ahead->travelled / spacing(stock);
    double wanted = (ahead->travelled + horizon) / spacing(stock) + 1.0;
    double untouched = cw_section_reach(stock, tool);
    int oldest = (int)floor(behind) - 1;
    if (oldest < 0) oldest = 0;
    while (ahead->count > 0 && ahead->first < oldest) {
        ahead->first++;
        ahead->count--;
    }
    if (ahead->count == 0) ahead->first = (int)ceil(cw_max(ahead->travelled / spacing(stock), 0.0));
    while (budget-- > 0 && ahead->count < CW_AHEAD_SAMPLES
           && ahead->first + ahead->count <= wanted) {
        int i = ahead->first + ahead->count;
        double at = i * spacing(stock), tip[3], dir[3];
        double clear = at - ahead->travelled < untouched ? cw_section_clear(stock) : 0.0;
        struct cw_section met;
        predict(ahead, at, tip, dir);
        met = cw_section_at(stock, tool, tip, dir, clear);
        ahead->area[i % CW_AHEAD_SAMPLES] = (float)met.area;
        ahead->depth[i % CW_AHEAD_SAMPLES] = (float)met.depth;
        ahead->count++;
    }
}

void cw_ahead_step(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                   const double from[3], const double to[3], double period,
                   double horizon, int budget)
{
    double unit[3], step = 0.0, heading, turn = 0.0, flat;
    int i;
    for (i = 0; i < 3; i++) step += (to[i] - from[i]) * (to[i] - from[i]);
    step = sqrt(step);
    ahead->speed = step / period;
    if (step > CW_STILL) {
        for (i = 0; i < 3; i++) unit[i] = (to[i] - from[i]) / step;
        flat = sqrt(unit[0] * unit[0] + unit[1] * unit[1]);
        heading = flat > 1e-9 ? atan2(unit[1], unit[0]) : ahead->last_heading;
        if (ahead->last_step > CW_STILL && flat > 1e-9) {
            double change = wrap(heading - ahead->last_heading);
            if (fabs(change) < CW_SHARP) turn = 2.0 * change / ((step + ahead->last_step) * flat);
        }
        if (on_course(ahead, stock->cell, to, unit, step)) {
            ahead->travelled += step;
        } else {
            if (ahead->known) ahead->held = area_now(ahead, stock);
            new_origin(ahead, to, unit, heading, step, turn);
        }
        ahead->turn = turn;
        ahead->last_heading = heading;
        ahead->last_step = step;
    }
    if (ahead->known) take_samples(ahead, stock, tool, horizon, budget);
}

/* Adds a level that lies above all before it; close ones become one, on the safe side [4]. */
static void add_level(struct cw_ahead_view *view, double distance, double area)
{
    struct cw_ahead_level *last = &view->level[view->levels - 1];
    if (area <= last->area) return;
    if (view->levels > 1 && (view->levels == CW_AHEAD_LEVELS || area <= CW_MERGE * last->base)) {
        last->area = area;
        return;
    }
    view->level[view->levels].distance = distance;
    view->level[view->levels].area = view->level[view->levels].base = area;
    view->levels++;
}

/* The worst this tool can meet at its depth: a full slot and a full plunge. */
static double worst(const struct cw_ahead *ahead, const struct cw_stock *stock,
                    const struct cw_tool *tool)
{
    double depth = cw_max(0.0, stock->z_max - ahead->origin[2]
                               - cw_min(0.0, ahead->slope) * ahead->travelled);
    double plunge = ahead->slope < 0.0 ? -ahead->slope * CW_PI * tool->radius * tool->radius : 0.0;
    return 2.0 * tool->radius * depth * ahead->level + plunge;
}

/* Whether a sample is contact. A wall the tool itself has cut is known to a part of a cell, and
 * on its way along it the tool seems to meet a strip at either side: measured, up to 1.9 cells
 * together. */
static int touches(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double graze = CW_GRAZE * stock->cell * ahead->depth[i % CW_AHEAD_SAMPLES];
    return ahead->area[i % CW_AHEAD_SAMPLES] > CW_TOUCH + graze;
}

void cw_ahead_look(const struct cw_ahead *ahead, const struct cw_stock *stock,
                   const struct cw_tool *tool, double horizon, struct cw_ahead_view *view)
{
    double gap = spacing(stock), reached = 0.0;
    int i;
    view->area = ahead->known ? area_now(ahead, stock) : 0.0;
    view->depth = 0.0;
    view->nearest = 1e30;
    view->levels = 1;
    view->level[0].distance = 0.0;
    view->level[0].area = view->level[0].base = view->area;
    if (!ahead->known) return;
    for (i = ahead->first; i < ahead->first + ahead->count; i++) {
        double at = i * gap - ahead->travelled;
        double area = ahead->area[i % CW_AHEAD_SAMPLES];
        if (at - gap <= 0.0 && view->depth < ahead->depth[i % CW_AHEAD_SAMPLES])
            view->depth = ahead->depth[i % CW_AHEAD_SAMPLES];
        if (at - gap > horizon) break;
        reached = cw_max(at, 0.0);
        if (touches(ahead, stock, i)) view->nearest = cw_min(view->nearest, cw_max(0.0, at - gap));
        if (at > 0.0) add_level(view, cw_max(0.0, at - gap), area);
    }
    if (reached < horizon && tool->radius > 0.0) add_level(view, reached, worst(ahead, stock, tool));
}
