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
#define CW_CLOSEST 0.25         /* cells between samples where the load jumps [5] */
#define CW_LOAD_JUMP 0.15       /* of a load, a change from one sample to the next that is a jump */
#define CW_EDGE 0.025           /* of the mean of the load and all that can be met, by which the change from cell to cell changes at an edge */
#define CW_SLIGHT 0.01          /* of all that can be met, a change that is none */
#define CW_LATE_RISE 0.5        /* cells [6] */
#define CW_LATE_STEEP 1.0       /* the same where within a cell it rises by */
#define CW_STEEP_RISE 0.28           /* of all that can be met */
#define CW_LATE_STEP 0.5        /* the same where it comes at once (a tool that meets a wall of its own radius) */
#define CW_AT_ONCE 0.45         /* of all that can be met, a rise within a cell that is so */
#define CW_SMEAR 2.5            /* cells over which that is read */
#define CW_LATE_FALL 1.0        /* cells [6] */
#define CW_STILL_MET 0.5           /* cells behind the tool whose load it may still meet: a fall is smeared to both sides [6] */
#define CW_UNSEEN 0.33          /* cells of width a reading beside a wall or a rim lacks at most (0.22, 0.29, 0.33 were found) */
#define CW_SAG 0.05             /* a rise by this share between two samples: the velocity's line hangs through there */
#define CW_PEAK 1.0             /* of what a sample stands above its neighbours' line, added to it [6] */
#define CW_BLUNT 1.0            /* of what it stands above the line between those a cell away: cells blunt a peak */
#define CW_DIP 0.5              /* of what it lies below it */
#define CW_NEAR_BACK 2          /* samples before one read further on that count for it too */
#define CW_TURN_STEP 0.35       /* rad the way turns by between two samples at most */
#define CW_TIGHT_TURN 2.0       /* tool radius over the way's, from which the way turns round a corner (a blend) */
#define CW_ROUND 0.35           /* rad, a sample further round than this is taken again [2] */
#define CW_TIGHT 1.05           /* tool radius over the way's, above which a sample near the tool reads low: none is taken again there */
#define CW_TOUCH 1e-3           /* mm2, less is no contact */
#define CW_BRAKE_MORE 1.2       /* of the braking distance: no level beyond it binds */
#define CW_BRAKE_PERIODS 6.0    /* and of the speed, what a period's acceleration may add to it */
#define CW_LATENCY 2.0          /* periods until what is told now takes effect */

double cw_ahead_gap(const struct cw_stock *stock, const struct cw_tool *tool)
{
    return cw_clamp(CW_GAP_RADII * tool->radius, stock->cell, 4.0 * stock->cell);
}

void cw_ahead_reset(struct cw_ahead *ahead)
{
    cw_course_reset(&ahead->course);
    cw_way_reset(&ahead->way);
    ahead->first = ahead->count = ahead->stale = ahead->on_way = 0;
    ahead->held = ahead->at = ahead->gap = ahead->step = ahead->origin = ahead->lead = ahead->build_up = ahead->gaining = 0.0;
}

/* Index of sample i. */
static int slot_of(int i) { return i % CW_AHEAD_SAMPLES; }

/* Area and place of a sample; the nearest one there is beyond the ends. */
static int held_in(const struct cw_ahead *ahead, int i)
{
    int last = ahead->first + ahead->count - 1;
    return slot_of(i < ahead->first ? ahead->first : (i > last ? last : i));
}

static double sample(const struct cw_ahead *ahead, int i) { return ahead->area[held_in(ahead, i)]; }

static double station(const struct cw_ahead *ahead, int i) { return ahead->s[held_in(ahead, i)]; }

static int corner(const struct cw_ahead *ahead, int i) { return ahead->corner[held_in(ahead, i)]; }

/* Whether the way goes round a corner, sharp or blended, on from sample i to sample k: there the load changes with the
 * direction, which no cell blunts [7]. */
static int rounds(const struct cw_ahead *ahead, int i, int k)
{
    int n;
    for (n = i + 1; n <= k; n++)
        if (corner(ahead, n)) return 1;
    return ahead->bend[held_in(ahead, k)] > ahead->bend[held_in(ahead, i)];
}

/* How far the load stands above the line between sample `before` and sample `behind` at sample i, mm2. */
static double off_line(const struct cw_ahead *ahead, int before, int i, int behind)
{
    double a = station(ahead, i) - station(ahead, before), b = station(ahead, behind) - station(ahead, i);
    return sample(ahead, i) - (sample(ahead, before) * b + sample(ahead, behind) * a) / (a + b);
}

/* How far the load may stand above a sample: as far as that leaves the line between its neighbours, or, where the cells blunt
 * a peak or the end of a rise, by a share of what it stands above the line between the samples a cell away, mm2 [6]. */
static double bent(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double off, plain, blunt, higher, s = station(ahead, i);
    int last = ahead->first + ahead->count - 1, before = i - 1, behind = i + 1;
    if (i <= ahead->first || i + 1 >= ahead->first + ahead->count) return 0.0;
    if (rounds(ahead, before, behind)) return 0.0;
    off = off_line(ahead, before, i, behind);
    plain = off > 0.0 ? CW_PEAK * off : -CW_DIP * off;
    if (s - station(ahead, before) >= stock->cell && station(ahead, behind) - s >= stock->cell) return plain;
    while (before > ahead->first && !corner(ahead, before) && s - station(ahead, before) < stock->cell) before--;
    while (behind < last && !corner(ahead, behind + 1) && station(ahead, behind) - s < stock->cell) behind++;
    blunt = CW_BLUNT * off_line(ahead, before, i, behind);
    higher = cw_max(sample(ahead, before), sample(ahead, behind)) - sample(ahead, i);
    if (higher > 0.0) blunt = cw_min(blunt, higher);
    return cw_max(plain, blunt);
}

/* Area of a sample, never too low [6]. */
static double bound(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double area = sample(ahead, i), most = ahead->most[held_in(ahead, i)];
    int k;
    if (ahead->near[held_in(ahead, i)])
        for (k = 1; k <= CW_NEAR_BACK && i - k >= ahead->first && !rounds(ahead, i - k, i); k++)
            area = cw_max(area, sample(ahead, i - k));
    return area >= most ? area : cw_max(area, cw_min(area + bent(ahead, stock, i), most));
}

/* Number of the sample the tool has passed last; one less than the first where there is none. */
static int passed(const struct cw_ahead *ahead)
{
    int i = ahead->first, last = ahead->first + ahead->count - 1;
    while (i <= last && ahead->s[slot_of(i)] <= ahead->at) i++;
    return i - 1;
}

/* Load at the tool, as well as it is known: between the samples around it [3]. */
static double area_now(const struct cw_ahead *ahead)
{
    double a, b;
    int i;
    if (ahead->count == 0) return ahead->held;
    i = passed(ahead);
    a = station(ahead, i);
    b = station(ahead, i + 1);
    if (b <= a) return sample(ahead, i);
    return sample(ahead, i) + (ahead->at - a) / (b - a) * (sample(ahead, i + 1) - sample(ahead, i));
}

/* What is between sample i - 1 and sample i [6] [7]. */
struct between {
    double from, to;            /* mm, where it counts */
    double a, b;                /* mm2 at its ends; straight between them, or the larger all along */
    int jump;                   /* 1: up, -1: down */
};

/* Whether the slope of the load changes at sample i as it does where an edge of the stock is reached [6]. */
static int kinks(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double closest = CW_CLOSEST * stock->cell, a = sample(ahead, i - 1), m = sample(ahead, i), b = sample(ahead, i + 1);
    double before, behind;
    if (i <= ahead->first || i + 1 >= ahead->first + ahead->count || corner(ahead, i) || corner(ahead, i + 1)) return 0;
    before = (m - a) / cw_max(closest, station(ahead, i) - station(ahead, i - 1));
    behind = (b - m) / cw_max(closest, station(ahead, i + 1) - station(ahead, i));
    return fabs(behind - before) * stock->cell > CW_EDGE * 0.5 * (ahead->most[held_in(ahead, i)] + cw_max(m, cw_max(a, b))) + CW_TOUCH;
}

/* Whether the load jumps from sample i - 1 to i. */
static int jumps(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double a = sample(ahead, i - 1), b = sample(ahead, i), change = fabs(b - a), slope;
    double most = ahead->most[held_in(ahead, i)], least = CW_CLOSEST * stock->cell;
    if (corner(ahead, i) || i <= ahead->first) return 0;
    if (change > CW_LOAD_JUMP * cw_max(a, b) + CW_SLIGHT * most + CW_TOUCH) return 1;
    slope = change * stock->cell / cw_max(least, station(ahead, i) - station(ahead, i - 1));
    return slope > CW_SLIGHT * most + CW_TOUCH && (kinks(ahead, stock, i - 1) || kinks(ahead, stock, i));
}

/* How far along the way the cells may shift what is read at sample i, mm [6]. */
static double smear(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    return ahead->smear[held_in(ahead, i)] * stock->cell;
}

/* Where the load that sample i shows may begin, if it comes at once: what it rises to within CW_SMEAR cells then belongs to
 * that step. Else the place of the sample before [6]. */
static double step_begin(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    double once = CW_AT_ONCE * ahead->most[held_in(ahead, i)] + CW_TOUCH, begin = station(ahead, i - 1);
    double reach = station(ahead, i) - CW_SMEAR * smear(ahead, stock, i);
    int k, up = i;
    if (sample(ahead, i) < once || sample(ahead, i) <= sample(ahead, i - 1)) return begin;
    for (k = i - 1; k >= ahead->first && station(ahead, k) > reach && !corner(ahead, k + 1); k--) {
        while (up - 1 > k && station(ahead, up - 1) - station(ahead, k) >= stock->cell) up--;
        if (sample(ahead, up) - sample(ahead, k) > once) begin = station(ahead, k) - CW_LATE_STEP * smear(ahead, stock, i);
    }
    return begin;
}

/* How far, mm, before the jump up from sample i - 1 to i it may begin [6]. */
static double late_rise(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    int k = i - 1;
    while (k > ahead->first && !corner(ahead, k) && station(ahead, i) - station(ahead, k) < stock->cell) k--;
    return (sample(ahead, i) - sample(ahead, k) > CW_STEEP_RISE * ahead->most[held_in(ahead, i)] ? CW_LATE_STEEP : CW_LATE_RISE)
        * smear(ahead, stock, i);
}

static struct between stretch(const struct cw_ahead *ahead, const struct cw_stock *stock, int i)
{
    struct between part;
    double begin, half = 0.5 * ahead->turn[held_in(ahead, i)];
    part.from = station(ahead, i - 1);
    part.to = station(ahead, i);
    part.a = bound(ahead, stock, i - 1);
    part.b = bound(ahead, stock, i);
    part.jump = !jumps(ahead, stock, i) ? 0 : (sample(ahead, i) > sample(ahead, i - 1) ? 1 : -1);
    if (half > 0.0 && !corner(ahead, i)) {          /* 1 / cos of a small angle */
        part.a *= 1.0 + 0.55 * half * half;
        part.b *= 1.0 + 0.55 * half * half;
    }
    begin = corner(ahead, i) ? part.from : step_begin(ahead, stock, i);
    if (begin < part.from) part.jump = 1;
    if (part.jump) {
        if (part.jump > 0) part.from = cw_min(begin, part.from - late_rise(ahead, stock, i));
        else part.to += CW_LATE_FALL * smear(ahead, stock, i);
        part.a = part.b = cw_max(part.a, part.b);
    }
    return part;
}

/* Largest load from `from` to `to`, which overlap the part. */
static double largest(const struct between *part, double from, double to)
{
    double length = part->to - part->from, slope = length > 0.0 ? (part->b - part->a) / length : 0.0;
    double u = cw_clamp(from - part->from, 0.0, length), v = cw_clamp(to - part->from, 0.0, length);
    return part->a + cw_max(slope * u, slope * v);
}

/* Load at the tool and as far ahead as it gets before it can be told anything else, never too
 * low [3] [6]. Where it falls without a jump that of CW_STILL_MET cells back counts, as far as cells may hide it. */
static double most_now(const struct cw_ahead *ahead, const struct cw_stock *stock)
{
    double to = ahead->at + ahead->lead, most = 0.0, behind = 0.0, deepest = 0.0;
    int i, last = ahead->first + ahead->count - 1;
    if (ahead->count == 0) return ahead->held;
    if (station(ahead, ahead->first) > ahead->at) most = bound(ahead, stock, ahead->first);
    if (ahead->at < ahead->origin + ahead->gap) most = cw_max(most, ahead->held);
    if (station(ahead, last) <= to) most = cw_max(most, bound(ahead, stock, last));
    for (i = ahead->first + 1; i <= last; i++) {
        struct between part;
        double back;
        if (station(ahead, i - 1) - (CW_SMEAR + CW_LATE_STEP) * stock->cell > to) break;
        part = stretch(ahead, stock, i);
        if (part.from > to) continue;
        if (part.to > ahead->at) most = cw_max(most, largest(&part, ahead->at, to));
        back = ahead->at - (part.jump ? 0.0 : CW_STILL_MET * smear(ahead, stock, i));
        if (part.to <= back) continue;
        behind = cw_max(behind, largest(&part, back, to));
        deepest = cw_max(deepest, ahead->depth[held_in(ahead, i)]);
    }
    return cw_max(most, cw_min(behind, most + CW_UNSEEN * stock->cell * deepest));
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

/* Cells along the way by which the cells may shift what is read: one across them, none where a flat end goes straight
 * down, as heights are known; a sloping end meets slopes, and what lies a cell beside is by the slope higher [6]. */
static double shift(const struct cw_tool *tool, double level)
{
    return tool->corner > 0.0 ? 1.0 : cw_max(level, cw_min(1.0, tool->slope));
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
        ahead->s[i] = i * gap;
        ahead->area[i] = area[i];
        ahead->most[i] = (float)full_area(tool, along, depth[i]);
        ahead->smear[i] = (float)shift(tool, along[0]);
        ahead->turn[i] = 0.0f;
        ahead->bend[i] = 0.0;
        ahead->corner[i] = ahead->near[i] = 0;
        ahead->depth[i] = depth[i];
    }
    ahead->first = 0;
    ahead->count = n;
    ahead->stale = same;
}

/* How far clear of the tool's outline a place `ahead` mm in front of the tool has to be read: so far that to the side of the
 * path, where outlines part last, what is read lies cw_section_clear outside the outline of the tool where it is now, mm [2]. */
static double clear_of_cut(const struct cw_stock *stock, const struct cw_tool *tool, double ahead)
{
    double left = cw_section_reach(stock, tool) - cw_max(0.0, ahead);
    return left > 0.0 ? cw_sqrt(tool->radius * tool->radius + left * left) - tool->radius : 0.0;
}

/* Reads the load at a place into sample i; returns its work, in nodes. */
static int read_at(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                   int i, const struct cw_way_place *at)
{
    double clear = clear_of_cut(stock, tool, at->s - ahead->at);
    const double *tip = at->tip, *dir = at->dir;
    struct cw_section met;
    int n = slot_of(i);
    met = cw_section_at(stock, tool, tip, dir, clear, at->curvature);
    ahead->area[n] = (float)met.area;
    ahead->depth[n] = (float)met.depth;
    ahead->most[n] = (float)full_area(tool, at->dir, met.depth);
    ahead->near[n] = (unsigned char)(clear > 0.0);
    ahead->smear[n] = (float)shift(tool, cw_sqrt(dir[0] * dir[0] + dir[1] * dir[1]));
    return met.nodes + CW_SAMPLE_NODES;
}

/* The place `s` on what the samples lie on. */
static void find_place(const struct cw_ahead *ahead, double s, struct cw_way_place *at)
{
    at->s = s;
    at->curvature = ahead->course.piece.curvature;
    if (ahead->on_way) at->curvature = cw_way_at(&ahead->way, s, at->tip, at->dir);
    else cw_piece_at(&ahead->course.piece, s, at->tip, at->dir);
}

/* Takes sample i again where it is; returns its work. */
static int take_again(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool, int i)
{
    struct cw_way_place at;
    find_place(ahead, ahead->s[slot_of(i)], &at);
    if (ahead->on_way && fabs(at.curvature) * tool->radius > CW_TIGHT) return 1;
    return read_at(ahead, stock, tool, i, &at);
}

/* Where the sample behind the last one belongs; 0: nowhere. */
static int next_station(const struct cw_ahead *ahead, struct cw_way_place *at)
{
    double last = station(ahead, ahead->first + ahead->count - 1);
    at->turn = 0.0;
    at->corner = 0;
    if (ahead->count == 0) {
        find_place(ahead, ahead->on_way ? ahead->at : ahead->gap * ceil(cw_max(ahead->at / ahead->gap, 0.0)), at);
        return 1;
    }
    if (ahead->on_way) return cw_way_next(&ahead->way, last, ahead->step, CW_TURN_STEP, at);
    find_place(ahead, last + ahead->gap, at);
    return 1;
}

/* Adds a sample at the far end; where the load jumps, closer first [5]. Returns its work. */
static int take_next(struct cw_ahead *ahead, const struct cw_stock *stock, const struct cw_tool *tool,
                     const struct cw_way_place *at)
{
    int i = ahead->first + ahead->count, n = slot_of(i), work, jump;
    double closest = CW_CLOSEST * stock->cell, before = ahead->count ? at->s - station(ahead, i - 1) : 0.0;
    double bend = ahead->count ? ahead->bend[slot_of(i - 1)] : 0.0;
    int sharp = at->corner ? at->turn > CW_ROUND : fabs(at->curvature) * tool->radius > CW_TIGHT_TURN;
    work = read_at(ahead, stock, tool, i, at);
    ahead->s[n] = at->s;
    ahead->turn[n] = (float)at->turn;
    ahead->bend[n] = bend + (sharp ? at->turn : 0.0);
    ahead->corner[n] = (unsigned char)at->corner;
    ahead->count++;
    jump = ahead->on_way && ahead->count > 1 && jumps(ahead, stock, i);
    if (jump && before > 1.01 * closest) {
        ahead->count--;
        ahead->step = closest;
        return work;
    }
    ahead->step = jump ? closest : cw_min(2.0 * cw_max(ahead->step, closest), ahead->gap);
    return work;
}

/* Drops what lies behind the tool, but for one place and what still counts at the tool [6], and what the
 * program's way has been changed under. */
static void drop_samples(struct cw_ahead *ahead, const struct cw_stock *stock)
{
    double back = ahead->at - (CW_LATE_FALL + 0.01) * stock->cell, end = 1e300;
    while (ahead->count > 2 + CW_NEAR_BACK && station(ahead, ahead->first + 1 + CW_NEAR_BACK) < back) {
        ahead->first++;
        ahead->count--;
    }
    if (ahead->on_way) end = cw_min(ahead->way.changed, ahead->way.end) + 2.0 * CW_WAY_BEYOND;
    while (ahead->count > 0 && station(ahead, ahead->first + ahead->count - 1) > end) ahead->count--;
    if (ahead->stale < ahead->first) ahead->stale = ahead->first;
    if (ahead->stale > ahead->first + ahead->count) ahead->stale = ahead->first + ahead->count;
}

/* [1] [2] Takes stale samples again, nearest first, and new ones in front. */
static void take_samples(struct cw_ahead *ahead, const struct cw_stock *stock,
                         const struct cw_tool *tool, double horizon, int budget)
{
    double far = ahead->at + horizon, bend;
    struct cw_way_place at;
    int here;
    drop_samples(ahead, stock);
    here = passed(ahead);
    bend = ahead->count ? ahead->bend[held_in(ahead, here)] + CW_ROUND : 0.0;
    while (budget > 0 && ahead->stale < ahead->first + ahead->count
           && (!ahead->on_way || ahead->bend[slot_of(ahead->stale)] <= bend)) {
        if (ahead->stale >= here) budget -= take_again(ahead, stock, tool, ahead->stale);
        ahead->stale++;
    }
    while (budget > 0 && ahead->count < CW_AHEAD_SAMPLES && next_station(ahead, &at)) {
        int fresh = ahead->stale == ahead->first + ahead->count;
        if (ahead->count && station(ahead, ahead->first + ahead->count - 1) > far) break;
        if (ahead->count == 0) bend = CW_ROUND;
        budget -= take_next(ahead, stock, tool, &at);
        if (fresh && ahead->stale < ahead->first + ahead->count
            && (!ahead->on_way || ahead->bend[slot_of(ahead->stale)] <= bend)) ahead->stale++;
    }
}

/* [1] Changes between way and course, or begins anew on the way: nothing known counts. */
static void begin_on(struct cw_ahead *ahead, int on_way)
{
    ahead->on_way = on_way;
    ahead->first = ahead->count = ahead->stale = 0;
    ahead->step = ahead->gap;
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
    double now = ahead->count && ahead->gap > 0.0 ? most_now(ahead, stock) : 0.0;
    int on_way = ahead->way.known && ahead->way.count > 0, begun = 1;
    int new_course = cw_course_step(&ahead->course, from, to, period,
                                    CW_OFF_COURSE * stock->cell, CW_GRAIN * stock->cell);
    if (on_way != ahead->on_way || (on_way && ahead->way.fresh) || gap != ahead->gap) {
        ahead->held = on_way && ahead->on_way ? now : 0.0;
        ahead->gap = gap;
        begin_on(ahead, on_way);
    } else if (!on_way && new_course) {
        change_course(ahead, &old, now, stock, tool);
        budget -= CW_CARRY_NODES * ahead->count;
        if (budget < 1) budget = 1;
    } else {
        begun = 0;
    }
    ahead->at = on_way ? ahead->way.at : ahead->course.travelled;
    ahead->lead = CW_LATENCY * ahead->course.speed * period;
    if (begun) ahead->origin = ahead->at;
    if (on_way || ahead->course.known) take_samples(ahead, stock, tool, horizon, budget);
    ahead->way.fresh = 0;
    ahead->way.changed = 1e300;
}

/* Makes room for a level: of all pairs of neighbours the one becomes one, on the safe side, whose loss (length
 * times how much slower) is least [4]. Returns 1 when that is the last one and the new one. */
static int merge_levels(struct cw_ahead_view *view, double distance, double area)
{
    int i, best = CW_AHEAD_LEVELS - 1;
    double least = 1e300;
    for (i = 1; i < CW_AHEAD_LEVELS; i++) {
        const struct cw_ahead_level *level = &view->level[i];
        double next = i + 1 < CW_AHEAD_LEVELS ? level[1].area : area;
        double far = i + 1 < CW_AHEAD_LEVELS ? level[1].distance : distance;
        double cost = (next / cw_max(level->area, CW_TOUCH) - 1.0) * (far - level->distance);
        if (cost < least) {
            least = cost;
            best = i;
        }
    }
    if (best == CW_AHEAD_LEVELS - 1) {
        view->level[best].area = area;
        return 1;
    }
    view->level[best].area = view->level[best + 1].area;
    for (i = best + 1; i + 1 < CW_AHEAD_LEVELS; i++) view->level[i] = view->level[i + 1];
    view->levels--;
    return 0;
}

/* Adds a level that lies above all before it [4]. */
static void add_level(struct cw_ahead_view *view, double distance, double area)
{
    struct cw_ahead_level *last = &view->level[view->levels - 1];
    if (area <= last->area) return;
    while (view->levels > 1 && last->distance >= distance) {    /* said by the new one */
        view->levels--;
        last--;
    }
    if (view->levels == CW_AHEAD_LEVELS && merge_levels(view, distance, area)) return;
    view->level[view->levels].distance = distance;
    view->level[view->levels].area = area;
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

/* How far, mm, before sample i its load has to be reckoned with [6]: a jump from where it may begin; another rise so far
 * that the velocity that falls evenly to it stays below what the line between the samples allows. */
static double early(const struct cw_ahead *ahead, const struct between *part, int i)
{
    double length = station(ahead, i) - station(ahead, i - 1);
    if (corner(ahead, i) || i <= ahead->first) return 0.0;
    if (part->jump > 0) return station(ahead, i) - part->from;
    if (ahead->turn[held_in(ahead, i)] > 0.0) return length;
    return length * cw_clamp((part->b / cw_max(part->a, CW_TOUCH) - 1.0 - CW_SAG) / CW_SAG, 0.0, 1.0);
}

/* From where on no load can bind the tool any more before it has gone on, mm. */
static double binding(const struct cw_ahead *ahead, double horizon)
{
    double speed = ahead->course.speed, accel, most;
    if (!ahead->on_way || ahead->way.count == 0) return ahead->at + horizon;
    accel = ahead->way.piece[ahead->way.first].accel;
    if (!(accel > 0.0)) return ahead->at + horizon;
    most = ahead->lead > 0.0 && speed > 0.0 ? accel * ahead->lead / speed * CW_BRAKE_PERIODS : accel * 0.01;
    return ahead->at + CW_BRAKE_MORE * (cw_way_stop(&ahead->way, speed + most + ahead->gaining, 0.0) - ahead->at) + ahead->gap
        + 2.0 * ahead->lead + ahead->build_up;
}

void cw_ahead_look(const struct cw_ahead *ahead, const struct cw_stock *stock,
                   const struct cw_tool *tool, double horizon, struct cw_ahead_view *view)
{
    double reached = 0.0, until;
    int i, now, last = ahead->first + ahead->count - 1, known = ahead->on_way || ahead->course.known;
    view->area = known ? area_now(ahead) : 0.0;
    view->depth = 0.0;
    view->levels = 1;
    view->level[0].distance = view->level[0].accel = 0.0;
    view->level[0].area = known ? most_now(ahead, stock) : 0.0;
    if (!known) return;
    now = passed(ahead);
    for (i = now; i <= now + 1; i++)
        if (i >= ahead->first && i <= last) view->depth = cw_max(view->depth, ahead->depth[slot_of(i)]);
    until = cw_min(ahead->at + horizon, binding(ahead, horizon));
    for (i = now + 1; i <= last; i++) {
        struct between part = stretch(ahead, stock, i);
        double at = station(ahead, i) - ahead->at, area = part.b;
        if (station(ahead, i - 1) > until && i > ahead->first) break;
        reached = at;
        if (part.jump < 0 || i == ahead->first) area = bound(ahead, stock, i);
        else if (ahead->turn[slot_of(i)] > 0.0 && !corner(ahead, i) && station(ahead, i - 1) > ahead->at)
            area = cw_max(part.a, part.b);
        if (area > view->level[view->levels - 1].area)
            add_level(view, cw_max(0.0, at - early(ahead, &part, i)), area);
    }
    if (i <= last) reached = horizon;               /* there are more, which do not bind */
    if (ahead->on_way) horizon = cw_min(horizon, ahead->way.end - ahead->at);
    if (reached < horizon - 1e-9 && tool->radius > 0.0)
        add_level(view, reached, worst(ahead, stock, tool, ahead->at + reached));
    add_braking(ahead, view);
}
