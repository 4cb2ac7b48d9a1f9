/* ahead.c - see ahead.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "ahead.h"

#define CW_OFF_COURSE 0.05      /* cells the tool may stray from its course */
#define CW_GRAIN 0.5            /* cells between the places the course is read from */
#define CW_SAME 0.04            /* cells between an old and a new place that are taken as one */
#define CW_NEAR 4.0             /* cells: an old sample this near may stand in for a new one */
#define CW_ONWARD 0.9           /* cosine between old and new course from which samples are carried over */
#define CW_TURNED (-0.5)        /* and from which the load at the tool stays a lower bound */
#define CW_GAP_RADII 0.0625     /* tool radii between samples; never below one cell nor above four */
#define CW_SAMPLE_NODES 8       /* work on a sample beside that on its nodes, in nodes */
#define CW_CARRY_NODES 2        /* and on carrying one over to a new course */
#define CW_RISE 1.1             /* a sample this much above the one before is a step of the load */
#define CW_SMEAR 3.0            /* cells a wall in the stock is smeared over */
#define CW_WALL_RISE 0.15       /* of a load, a rise within one sample that is a wall */
#define CW_MAIN 0.7             /* of the largest rise there, one that may be where the wall is */
#define CW_TURN 0.97            /* cosine between two samples from which the way turns */
#define CW_RISING 0.1           /* and the change of slope from which it turns up or down */
#define CW_REVERSED 0.5         /* length^2 of the sum of two directions below which the way is reversed */
#define CW_NOISE 0.08           /* of a load, a bend between samples that is none */
#define CW_BLUNT 0.5            /* of a bend, what interpolated heights lose */
#define CW_TOUCH 1e-3           /* mm2, less is no contact */
#define CW_MERGE 1.03           /* levels closer than this are given as one */

double cw_ahead_gap(const struct cw_stock *stock, const struct cw_tool *tool)
{
    return cw_clamp(CW_GAP_RADII * tool->radius, stock->cell, 4.0 * stock->cell);
}

void cw_ahead_reset(struct cw_ahead *ahead)
{
    cw_course_reset(&ahead->course);
    cw_way_reset(&ahead->way);
    ahead->first = ahead->count = ahead->stale = ahead->on_way = 0;
    ahead->held = ahead->at = ahead->gap = 0.0;
}

/* Area of a sample; the nearest one there is beyond the ends. */
static double sample(const struct cw_ahead *ahead, int i)
{
    int last = ahead->first + ahead->count - 1;
    i = i < ahead->first ? ahead->first : (i > last ? last : i);
    return ahead->area[i % CW_AHEAD_SAMPLES];
}

/* Area of a sample, never too low: what a peak or an edge loses where heights are interpolated is
 * given back, up to what can be there at all. */
static double bound(const struct cw_ahead *ahead, int i)
{
    double area = sample(ahead, i), edge = 2.0 * area - sample(ahead, i - 1) - sample(ahead, i + 1), most;
    if (i < ahead->first || i >= ahead->first + ahead->count) return area;
    if (ahead->peak[i % CW_AHEAD_SAMPLES] > area) return ahead->peak[i % CW_AHEAD_SAMPLES];
    edge -= CW_NOISE * area;
    most = ahead->most[i % CW_AHEAD_SAMPLES];
    return edge > 0.0 ? cw_max(area, cw_min(area + CW_BLUNT * edge, most)) : area;
}

/* Number of the sample the tool has passed last; *share: how far it is to the next, 0..1. */
static int passed(const struct cw_ahead *ahead, double *share)
{
    double s = ahead->at / ahead->gap;
    int i = (int)floor(s);
    *share = s - i;
    return i;
}

/* Load at the tool, as well as it is known: between the samples around it [3]. */
static double area_now(const struct cw_ahead *ahead)
{
    double share;
    int i;
    if (ahead->count == 0) return ahead->held;
    i = passed(ahead, &share);
    return sample(ahead, i) + share * (sample(ahead, i + 1) - sample(ahead, i));
}

/* Load at the tool, never too low: the larger of the samples around it, so that neither the noise
 * of the readings nor a slow rise is missed. Interpolated heights smear an edge of the stock over
 * a cell, and near an edge the load changes with the root of the way: a fall counts one sample
 * late, unless it comes of a turn of the way [3]. */
static double most_now(const struct cw_ahead *ahead)
{
    double past, a, b, share;
    int i;
    if (ahead->count == 0) return ahead->held;
    i = passed(ahead, &share);
    past = bound(ahead, i - 1);
    a = bound(ahead, i);
    b = bound(ahead, i + 1);
    if (i - 1 < ahead->first && ahead->at < ahead->gap) past = cw_max(a, ahead->held);
    else if (i >= 0 && ahead->turned[i % CW_AHEAD_SAMPLES]) past = a;
    return past > CW_RISE * cw_min(a, b) ? cw_max(past, b) : cw_max(a, b);
}

/* Cosine between the old course at `s` and the beginning of the new one. */
static double onward(const struct cw_course *old, const struct cw_course *new, double s)
{
    double at[3], was[3], is[3];
    cw_piece_at(&old->piece, s, at, was);
    cw_piece_at(&new->piece, 0.0, at, is);
    return was[0] * is[0] + was[1] * is[1] + was[2] * is[2];
}

/* What a tool meets that is in stock all round, mm2: a full slot and a full plunge. */
static double full_area(const struct cw_tool *tool, const double dir[3], double depth)
{
    double plunge = dir[2] < 0.0 ? -dir[2] * CW_PI * tool->radius * tool->radius : 0.0;
    return 2.0 * tool->radius * depth * cw_sqrt(dir[0] * dir[0] + dir[1] * dir[1]) + plunge;
}

/* [2] The samples of the old course as far as they serve on the new one. `old` is the
 * course before, whose `travelled` is where the new one begins. */
static void carry_over(struct cw_ahead *ahead, const struct cw_course *old, double step,
                       const struct cw_stock *stock, const struct cw_tool *tool)
{
    const double along[3] = { ahead->course.piece.level, 0.0, ahead->course.piece.slope };
    float area[CW_AHEAD_SAMPLES], depth[CW_AHEAD_SAMPLES];
    double gap = ahead->gap, begin = (old->travelled + step) / gap;
    int last = ahead->first + ahead->count - 1, n = 0, same = 0, i;

    if (onward(old, &ahead->course, begin * gap) < CW_ONWARD) last = ahead->first - 1;
    for (i = 0; i < CW_AHEAD_SAMPLES; i++) {
        double was[3], is[3], dir[3], off2, s = begin + i, share;
        int a = (int)floor(s), k;
        if (a < ahead->first || a + 1 > last) break;
        cw_piece_at(&old->piece, s * gap, was, dir);
        cw_piece_at(&ahead->course.piece, i * gap, is, dir);
        off2 = 0.0;
        for (k = 0; k < 3; k++) off2 += (was[k] - is[k]) * (was[k] - is[k]);
        if (off2 > CW_NEAR * CW_NEAR * stock->cell * stock->cell) break;
        if (same == n && a + 1 < ahead->stale
            && off2 < CW_SAME * CW_SAME * stock->cell * stock->cell) same++;
        share = s - a;
        area[n] = (float)(sample(ahead, a) + share * (sample(ahead, a + 1) - sample(ahead, a)));
        depth[n] = (float)cw_max(ahead->depth[a % CW_AHEAD_SAMPLES],
                                 ahead->depth[(a + 1) % CW_AHEAD_SAMPLES]);
        n++;
    }
    for (i = 0; i < n; i++) {
        ahead->area[i] = area[i];
        ahead->most[i] = (float)full_area(tool, along, depth[i]);
        ahead->turned[i] = 0;
        ahead->peak[i] = 0.0f;
        ahead->depth[i] = depth[i];
    }
    ahead->first = 0;
    ahead->count = n;
    ahead->stale = same;
}

/* Whether and how far the way turns between the sample before and i, whose direction is `dir`. Where
 * it turns up or down (from a plunge into a slot) more is met in between than at both ends: the
 * area is sublinear in the direction, so at most their sum over the length of the directions' sum. */
static void mark_turn(struct cw_ahead *ahead, const struct cw_tool *tool, int i, const double dir[3])
{
    double between[3], length2 = 0.0, rise = fabs(dir[2] - ahead->last_dir[2]), peak = 0.0;
    int k, n = i % CW_AHEAD_SAMPLES, follows = ahead->last == i - 1;
    for (k = 0; k < 3; k++) {
        between[k] = dir[k] + ahead->last_dir[k];
        length2 += between[k] * between[k];
        ahead->last_dir[k] = dir[k];
    }
    ahead->last = i;
    ahead->turned[n] = follows && length2 < 2.0 + 2.0 * CW_TURN;
    if (ahead->turned[n] && rise > CW_RISING && length2 > CW_REVERSED) {
        double length = cw_sqrt(length2);
        for (k = 0; k < 3; k++) between[k] /= length;
        peak = cw_min((sample(ahead, i - 1) + ahead->area[n]) / length,
                      full_area(tool, between, cw_max(ahead->depth[n], ahead->depth[(n + CW_AHEAD_SAMPLES - 1)
                                                                                  % CW_AHEAD_SAMPLES])));
    }
    ahead->peak[n] = (float)peak;
}

/* Takes sample i on the course; returns its work, in nodes. */
static int take(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                 int i)
{
    double at = i * ahead->gap, tip[3], dir[3], curvature = ahead->course.piece.curvature;
    int near = at - ahead->at < cw_section_reach(stock, tool);
    struct cw_section met;
    if (ahead->on_way) curvature = cw_way_at(&ahead->way, at, tip, dir);
    else cw_piece_at(&ahead->course.piece, at, tip, dir);
    met = cw_section_at(stock, tool, tip, dir, near ? cw_section_clear(stock) : 0.0, curvature);
    ahead->area[i % CW_AHEAD_SAMPLES] = (float)met.area;
    ahead->depth[i % CW_AHEAD_SAMPLES] = (float)met.depth;
    ahead->most[i % CW_AHEAD_SAMPLES] = (float)full_area(tool, dir, met.depth);
    mark_turn(ahead, tool, i, dir);
    return met.nodes + CW_SAMPLE_NODES;
}

/* [1] Drops samples that lie behind, takes stale ones again and new ones in front, nearest
 * first. */
static void take_samples(struct cw_ahead *ahead, const struct cw_stock *stock,
                         const struct cw_tool *tool, double horizon, int budget)
{
    double gap = ahead->gap;
    int oldest = (int)floor(ahead->at / gap) - 1;
    double far = ahead->at + horizon, wanted;
    if (ahead->on_way && far > ahead->way.end) far = ahead->way.end;
    wanted = far / gap + 1.0;
    while (ahead->count > 0 && ahead->first < oldest) {
        ahead->first++;
        ahead->count--;
    }
    if (ahead->count == 0)
        ahead->first = (int)ceil(cw_max(ahead->at / gap, 0.0));
    if (ahead->stale < ahead->first) ahead->stale = ahead->first;
    while (budget > 0 && ahead->stale <= wanted
           && ahead->stale - ahead->first < CW_AHEAD_SAMPLES) {
        budget -= take(ahead, stock, tool, ahead->stale++);
        if (ahead->stale > ahead->first + ahead->count) ahead->count = ahead->stale - ahead->first;
    }
}

/* [1] Changes between way and course, or begins anew on the way: nothing known counts. */
static void begin_on(struct cw_ahead *ahead, int on_way)
{
    ahead->on_way = on_way;
    ahead->first = ahead->count = ahead->stale = 0;
}

/* [2] The tool has left its course: what can be kept of the samples. */
static void change_course(struct cw_ahead *ahead, const struct cw_course *old, double now,
                          const struct cw_stock *stock, const struct cw_tool *tool)
{
    double step = ahead->course.last_step;
    int turned = !old->known || onward(old, &ahead->course, old->travelled + step) < CW_TURNED;
    carry_over(ahead, old, step, stock, tool);
    ahead->held = turned ? 0.0 : now;
}

void cw_ahead_step(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                   const double from[3], const double to[3], double period,
                   double horizon, int budget)
{
    struct cw_course old = ahead->course;
    double gap = cw_ahead_gap(stock, tool);
    double now = ahead->count && ahead->gap > 0.0 ? most_now(ahead) : 0.0;
    int on_way = ahead->way.known && ahead->way.count > 0;
    int new_course = cw_course_step(&ahead->course, from, to, period,
                                    CW_OFF_COURSE * stock->cell, CW_GRAIN * stock->cell);
    if (on_way != ahead->on_way || (on_way && ahead->way.fresh) || gap != ahead->gap) {
        ahead->held = on_way && ahead->on_way ? now : 0.0;
        begin_on(ahead, on_way);
        ahead->gap = gap;
    } else if (!on_way && new_course) {
        change_course(ahead, &old, now, stock, tool);
        budget -= CW_CARRY_NODES * ahead->count;
        if (budget < 1) budget = 1;
    }
    ahead->way.fresh = 0;
    ahead->at = on_way ? ahead->way.at : ahead->course.travelled;
    if (on_way || ahead->course.known) take_samples(ahead, stock, tool, horizon, budget);
}

/* Adds a level that lies above all before it; close ones become one, on the safe side [4]. */
static void add_level(struct cw_ahead_view *view, double distance, double area)
{
    struct cw_ahead_level *last = &view->level[view->levels - 1];
    if (area <= last->area) return;
    while (view->levels > 1 && last->distance >= distance) {    /* said by the new one */
        view->levels--;
        last--;
    }
    if (view->levels > 1 && (view->levels == CW_AHEAD_LEVELS || area <= CW_MERGE * last->base)) {
        last->area = area;
        return;
    }
    view->level[view->levels].distance = distance;
    view->level[view->levels].area = view->level[view->levels].base = area;
    view->levels++;
}

/* What the planner can brake with on the way to each level. */
static void add_braking(const struct cw_ahead *ahead, struct cw_ahead_view *view)
{
    int i;
    for (i = 0; i < view->levels; i++) {
        struct cw_ahead_level *level = &view->level[i];
        level->accel = 0.0;
        if (ahead->on_way && level->distance > 0.0)
            level->accel = cw_way_braking(&ahead->way, ahead->at + level->distance) / level->distance;
    }
}

/* The worst this tool can meet at its depth: a full slot and a full plunge. */
static double worst(const struct cw_ahead *ahead, const struct cw_stock *stock,
                    const struct cw_tool *tool, double s)
{
    double tip[3], dir[3];
    if (ahead->on_way) cw_way_at(&ahead->way, s, tip, dir);
    else cw_piece_at(&ahead->course.piece, s, tip, dir);
    return full_area(tool, dir, cw_max(0.0, stock->z_max - cw_max(tip[2], stock->z_min)));
}

/* How far, mm, before sample i its load has to be reckoned with. Heights are interpolated, so that a
 * wall is smeared over some cells: where the load has jumped a little while before, all that it
 * has risen since belongs to the jump. Any other rise may lie anywhere since the sample before. */
static double early(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double gap = ahead->gap, area = sample(ahead, i), before = sample(ahead, i - 1), most = 0.0;
    int back = (int)ceil(CW_SMEAR * stock->cell / gap), begin = 0, k;
    for (k = 1; k <= back; k++) {
        double rise = sample(ahead, i - k + 1) - sample(ahead, i - k);
        if (rise > most) most = rise;
        if (rise > CW_WALL_RISE * area && rise >= CW_MAIN * most) begin = k;
    }
    if (begin) return begin * gap;
    return gap * cw_clamp((area - before) / ((CW_RISE - 1.0) * before + CW_TOUCH), 0.0, 1.0);
}

void cw_ahead_look(const struct cw_ahead *ahead, const struct cw_stock *stock,
                   const struct cw_tool *tool, double horizon, struct cw_ahead_view *view)
{
    double gap = ahead->gap, reached = 0.0;
    int i;
    int known = ahead->on_way || ahead->course.known;
    view->area = known ? area_now(ahead) : 0.0;
    view->depth = 0.0;
    view->levels = 1;
    view->level[0].distance = view->level[0].accel = 0.0;
    view->level[0].area = view->level[0].base = known ? most_now(ahead) : 0.0;
    if (!known) return;
    for (i = ahead->first; i < ahead->first + ahead->count; i++) {
        double at = i * gap - ahead->at;
        double area = bound(ahead, i);
        if (at - gap <= 0.0 && view->depth < ahead->depth[i % CW_AHEAD_SAMPLES])
            view->depth = ahead->depth[i % CW_AHEAD_SAMPLES];
        if (at - gap > horizon) break;
        reached = cw_max(at, 0.0);
        if (at > 0.0 && area > view->level[view->levels - 1].area)
            add_level(view, cw_max(0.0, at - early(ahead, stock, i)), area);
    }
    if (ahead->on_way) horizon = cw_min(horizon, ahead->way.end - ahead->at);
    if (reached < horizon && tool->radius > 0.0)
        add_level(view, reached, worst(ahead, stock, tool, ahead->at + reached));
    add_braking(ahead, view);
}
