/* guard.c - see guard.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "guard.h"

#define CW_GUARD_STILL 1e-6     /* mm, a step below this is none */
#define CW_GUARD_STRAY 0.02     /* cells the tool may stray from its line */
#define CW_GUARD_AIM 1e-4       /* rad between step and line; the probe is up to 20 mm ahead */
#define CW_GUARD_SHARE 0.01     /* of a step the way to go may fall by more or less [5] */
#define CW_GUARD_ROUND 1e-5     /* mm, the same where the step is small */
#define CW_GUARD_STEADY 3       /* periods on a line before it is judged [5] */
#define CW_GUARD_STEP 4.0       /* cells the probe goes on at once, or */
#define CW_GUARD_RADII 0.0625   /* this share of the tool's radius: each step costs the tool's outline */
#define CW_GUARD_FINE 0.0625    /* cells between which the beginning of stock is found */
#define CW_GUARD_FREE 16        /* steps of the probe in a period, about */
#define CW_GUARD_LEAST 1e-3     /* mm2, contact below this is none */
#define CW_GUARD_LATE 3.0       /* periods of travel until the planner brakes, and one to spare */
#define CW_GUARD_BRAKING 0.3    /* share of the acceleration from which on it is braking [4] */
#define CW_GUARD_GROWING 1.02   /* braking that has become more by this factor in a period is only beginning [4] */
#define CW_GUARD_BLIND 20.0     /* mm, braking distance where the acceleration is unknown */
#define CW_GUARD_DRIFT 0.2      /* cells the tool may be beside the bend foreseen: it is foreseen anew then [5b] */
#define CW_GUARD_BENT 12        /* halvings of a step in a bend at most */
#define CW_GUARD_SURE 0.8       /* of the braking the planner is capable of on its way, in arcs less than half the acceleration */
#define CW_GUARD_LOST 0.05      /* of a step the place on the way may differ by: it is another way then [5a] */

/* Nothing is known from `s` on. */
static void begin_probe(struct cw_guard_probe *probe, double s)
{
    probe->clear = s;
    probe->hit_near = 0.0;
    probe->hit_far = -1.0;
}

static int found(const struct cw_guard_probe *probe) { return probe->hit_far > probe->hit_near; }

void cw_guard_reset_line(struct cw_guard *guard)
{
    guard->periods = guard->bend.on = 0;
    guard->gone = guard->speed = guard->distance = 0.0;
    guard->slowing = guard->slowing_before = guard->to_go = 0.0;
    guard->place = -1e30;
    begin_probe(&guard->line, 0.0);
    begin_probe(&guard->course, 0.0);
}

void cw_guard_reset(struct cw_guard *guard)
{
    cw_guard_reset_line(guard);
    guard->excess = 0;
}

/* Contact on a way `length` mm long that is none: a thin strip, as high as the stock can be. */
static double ignored(const struct cw_stock *stock, double low, double length)
{
    double height = cw_max(0.0, stock->z_max - low);
    return length * (CW_GUARD_LEAST + CW_GUARD_STRIP * stock->cell * height);
}

/* Whether a leg is above or beside the stock, as can be said without looking at a cell. */
static int misses(const struct cw_stock *stock, double radius, const double a[3], const double b[3])
{
    return cw_min(a[2], b[2]) >= stock->z_max
        || cw_min(a[0], b[0]) - radius >= stock->x_max || cw_max(a[0], b[0]) + radius <= stock->x0
        || cw_min(a[1], b[1]) - radius >= stock->y_max || cw_max(a[1], b[1]) + radius <= stock->y0;
}

/* Follows the tool: speed, and the line it is on [1]. */
static void follow(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_guard_in *in,
                   double step)
{
    double dir[3], off2 = 0.0, aim = 0.0;
    int i, whole;
    whole = !(in->to_go > 0.0) || fabs(guard->to_go - in->to_go - step) < CW_GUARD_SHARE * step + CW_GUARD_ROUND;
    guard->to_go = in->to_go;
    if (step < CW_GUARD_STILL) return;
    for (i = 0; i < 3; i++) {
        double off = in->to[i] - guard->origin[i] - guard->dir[i] * (guard->gone + step);
        dir[i] = (in->to[i] - in->from[i]) / step;
        off2 += off * off;
        aim += (dir[i] - guard->dir[i]) * (dir[i] - guard->dir[i]);
    }
    if (whole && guard->periods > 0 && aim < CW_GUARD_AIM * CW_GUARD_AIM
        && off2 < CW_GUARD_STRAY * CW_GUARD_STRAY * stock->cell * stock->cell) {
        guard->gone += step;
        guard->periods++;
        return;
    }
    for (i = 0; i < 3; i++) {
        guard->origin[i] = in->to[i];
        guard->dir[i] = dir[i];
    }
    guard->gone = 0.0;
    guard->bend.on = 0;
    begin_probe(&guard->line, 0.0);
    guard->periods = 1;
}

/* Speed, and how fast it falls, mm/s2. */
static void measure_speed(struct cw_guard *guard, double speed, double period)
{
    guard->slowing_before = guard->slowing;
    guard->slowing = (guard->speed - speed) / period;
    guard->speed = speed;
}

/* Share of bend->off left when the tool is `s` mm on the line: the way left of the first segment falls with the
 * square of the time left, the speed on the line rises evenly. */
static double bend_share(const struct cw_guard_bend *bend, double s)
{
    double gone = s - bend->from, root, left;
    if (!bend->on || s >= bend->end || !(bend->time > 0.0)) return 0.0;
    if (gone <= 0.0) return 1.0;
    root = bend->speed + sqrt(bend->speed * bend->speed + 2.0 * bend->rise / bend->time * gone);
    left = root > 0.0 ? 1.0 - 2.0 * gone / (root * bend->time) : 0.0;
    return left > 0.0 ? left * left : 0.0;
}

static void place_on(const struct cw_guard *guard, double s, double tip[3])
{
    double share = bend_share(&guard->bend, s);
    int i;
    for (i = 0; i < 3; i++) tip[i] = guard->origin[i] + s * guard->dir[i] + share * guard->bend.off[i];
}

/* [5b] Takes the line of the next segment for the tool's, with the bend that leads to it. */
static void enter_bend(struct cw_guard *guard, const struct cw_corner *corner, const double tip[3])
{
    struct cw_guard_bend *bend = &guard->bend;
    int i;
    for (i = 0; i < 3; i++) {
        guard->origin[i] = corner->start[i];
        guard->dir[i] = corner->dir[i];
        bend->off[i] = tip[i] - corner->start[i] - corner->done * corner->dir[i];
    }
    bend->on = 1;
    bend->time = corner->slow > CW_GUARD_STILL ? 2.0 * corner->left / corner->slow : 0.0;
    bend->from = corner->done;
    bend->speed = corner->speed;
    bend->rise = cw_max(0.0, corner->top - corner->speed);
    bend->end = bend->from + (bend->speed + 0.5 * bend->rise) * bend->time;
    begin_probe(&guard->line, corner->done);
}

/* [5b] Follows the tool through a parabolic blend. */
static void follow_bend(struct cw_guard *guard, const struct cw_corner *corner, const struct cw_stock *stock,
                        const struct cw_guard_in *in)
{
    double there[3], off2 = 0.0, aim = 0.0;
    int i;
    place_on(guard, corner->done, there);
    for (i = 0; i < 3; i++) {
        off2 += (in->to[i] - there[i]) * (in->to[i] - there[i]);
        aim += (corner->dir[i] - guard->dir[i]) * (corner->dir[i] - guard->dir[i]);
    }
    if (!guard->bend.on || aim > CW_GUARD_AIM * CW_GUARD_AIM
        || off2 > CW_GUARD_DRIFT * CW_GUARD_DRIFT * stock->cell * stock->cell)
        enter_bend(guard, corner, in->to);
    guard->gone = corner->done;
    guard->to_go = in->to_go;
    guard->periods = CW_GUARD_STEADY;
}

/* What the planner uses along the line, mm/s2; 0: unknown. */
static double accel_along(const struct cw_guard *guard, const struct cw_guard_in *in)
{
    double least = 1e30;
    int i;
    if (!cw_finite(in->accel) || !(in->accel > 0.0)) return 0.0;
    for (i = 0; i < 3; i++) {
        if (!cw_finite(in->axis_accel[i]) || !(in->axis_accel[i] > 0.0)) return in->accel;
        if (fabs(guard->dir[i]) > 1e-9) least = cw_min(least, in->axis_accel[i] / fabs(guard->dir[i]));
    }
    return least;
}

/* Way to a stand at acceleration `accel`, and that of the periods until it begins, mm. */
static double stopping(const struct cw_guard *guard, const struct cw_guard_in *in, double accel)
{
    double late = CW_GUARD_LATE * guard->speed * in->period;
    if (!(accel > 0.0)) return CW_GUARD_BLIND;
    if (cw_finite(in->jerk) && in->jerk > 0.0) late += 1.5 * guard->speed * accel / in->jerk;
    return 0.5 * guard->speed * guard->speed / accel + late;
}

/* Where a probe goes: on the program's way, or on the line. */
struct track {
    const struct cw_guard *guard;
    const struct cw_way *way;   /* null: the line */
    long bound;                 /* of the work */
};

static void place(const struct track *track, double s, double tip[3])
{
    double dir[3];
    if (track->way) cw_way_at(track->way, s, tip, dir);
    else place_on(track->guard, s, tip);
}

/* Halves the step in which stock was met. */
static void narrow(struct cw_guard_probe *probe, const struct track *track, const struct cw_stock *stock,
                   const struct cw_tool *tool, long *work)
{
    double a[3], b[3], middle = 0.5 * (probe->hit_near + probe->hit_far), enough;
    place(track, probe->hit_near, a);
    place(track, middle, b);
    enough = ignored(stock, cw_min(a[2], b[2]), middle - probe->hit_near);
    if (cw_sweep_meets(stock, tool, a, b, 1, enough, work) >= enough) probe->hit_far = middle;
    else probe->hit_near = middle;
}

/* The next place of a probe, no further from the last than a step. */
static double next_place(const struct track *track, const struct cw_guard_probe *probe, double step, double end,
                         const double a[3], double b[3])
{
    double next = probe->clear + step;
    int i;
    if (end > probe->clear + CW_GUARD_LEAST && end < next) next = end;
    for (i = 0; i < CW_GUARD_BENT; i++) {
        double dx, dy, dz;
        place(track, next, b);
        dx = b[0] - a[0];
        dy = b[1] - a[1];
        dz = b[2] - a[2];
        if (dx * dx + dy * dy + dz * dz <= 1.01 * step * step) break;
        next = 0.5 * (next + probe->clear);         /* in a bend the tool goes further than the line does */
    }
    return next;
}

/* Sends a probe one step on; one of its steps ends at `end`. */
static void send_on(struct cw_guard_probe *probe, const struct track *track, const struct cw_stock *stock,
                    const struct cw_tool *tool, double end, long *work)
{
    double step = cw_max(CW_GUARD_STEP * stock->cell, CW_GUARD_RADII * tool->radius);
    double a[3], b[3], next, enough;
    place(track, probe->clear, a);
    next = next_place(track, probe, step, end, a, b);
    if (!misses(stock, tool->radius, a, b)) {
        enough = ignored(stock, cw_min(a[2], b[2]), next - probe->clear);
        if (cw_sweep_meets(stock, tool, a, b, 1, enough, work) >= enough) {
            probe->hit_near = probe->clear;
            probe->hit_far = next;
            return;
        }
    }
    probe->clear = next;
}

/* [2] A probe's work of a period: on, up to `wanted` mm, then to where stock begins. */
static void send(struct cw_guard_probe *probe, const struct track *track, const struct cw_stock *stock,
                 const struct cw_tool *tool, double wanted, double end, long *work)
{
    int steps = CW_GUARD_FREE;
    while (!found(probe) && probe->clear < wanted && *work < track->bound && steps-- > 0)
        send_on(probe, track, stock, tool, end, work);
    while (found(probe) && probe->hit_far - probe->hit_near > CW_GUARD_FINE * stock->cell && *work < track->bound)
        narrow(probe, track, stock, tool, work);
}

/* Whether the traverse the tool is on goes over into another one without a stop [5a]. (Where no more is known
 * the next one is beyond the braking distance.) */
static int goes_over(const struct cw_way *way)
{
    return way && way->count > 0 && way->piece[way->first].join == CW_JOIN_TANGENT
        && way->piece[way->first].rapid
        && (way->count == 1 || way->piece[(way->first + 1) % CW_WAY_PIECES].rapid);
}

/* [3], [4] */
static int must_stop(const struct cw_guard *guard, const struct cw_stock *stock,
                     const struct cw_guard_in *in, double accel)
{
    double near = guard->line.hit_near - guard->gone, far = guard->line.hit_far - guard->gone;
    double way = 0.5 * guard->speed * guard->speed, travel = guard->speed * in->period;
    double slowing = cw_max(guard->slowing, guard->slowing_before), thin = CW_GUARD_STRIP * stock->cell;
    int begins = guard->slowing > CW_GUARD_GROWING * guard->slowing_before;
    if (far <= -thin) return 1;
    if (in->to_go > 0.0 && far + thin <= in->to_go)
        return near <= stopping(guard, in, 0.5 * accel);
    if (goes_over(in->way)) return 0;                     /* the way is judged instead of the line */
    if (!(accel > 0.0)) return near <= CW_GUARD_BLIND;
    if (cw_min(guard->slowing, guard->slowing_before) > CW_GUARD_BRAKING * accel)
        return far <= way / (begins ? accel : slowing) - travel;
    if (in->to_go > 0.0) return far <= way / accel - travel;
    return near <= way / accel + travel;
}

/* [5a] Place on the way up to which the tool goes exactly there, by traverses and without a stop. A blend takes
 * half of a piece at most. */
static double certain_until(const struct cw_way *way)
{
    double begin = way->begin;
    int n;
    for (n = 0; n < way->count; n++) {
        const struct cw_piece *piece = &way->piece[(way->first + n) % CW_WAY_PIECES];
        if (!piece->rapid) break;
        if (piece->join == CW_JOIN_PARABOLIC) return begin + 0.5 * piece->length;
        begin += piece->length;
        if (piece->join == CW_JOIN_STOP) break;
    }
    return begin;
}

/* [5a] Probes the program's way; 1 when the tool has to stop. The straight piece it is on is the line's. */
static int judge_way(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool,
                     const struct cw_guard_in *in, double step, long bound, long *work)
{
    const struct cw_way *way = in->way;
    struct cw_guard_probe *probe = &guard->course;
    struct track track = { guard, way, bound };
    double near, far = stopping(guard, in, 0.5 * in->accel), last = guard->place;
    double until, brakes;
    if (!way || way->count == 0) {
        guard->place = -1e30;
        return 0;
    }
    guard->place = way->at;
    if (fabs(way->at - last - step) > CW_GUARD_LOST * step + CW_GUARD_LEAST) begin_probe(probe, way->at);
    if (!goes_over(way) && !found(probe)) return 0;
    if (probe->clear < way->at) probe->clear = way->at;
    if (way->piece[way->first].curvature == 0.0 && guard->periods >= CW_GUARD_STEADY)
        probe->clear = cw_max(probe->clear, way->begin + way->piece[way->first].length);
    until = certain_until(way);
    send(probe, &track, stock, tool, cw_min(until - CW_GUARD_LEAST, way->at + far / CW_GUARD_SURE + step), until, work);
    if (!found(probe)) return 0;
    near = cw_max(probe->hit_near - way->at, 0.0);
    if (guard->distance == 0.0 || near < guard->distance) guard->distance = near;
    brakes = cw_way_braking(way, probe->hit_near - CW_GUARD_LATE * guard->speed * in->period);
    return near <= far || 0.5 * guard->speed * guard->speed >= CW_GUARD_SURE * brakes;
}

/* [2]..[4] on the line; 1 when the tool has to stop. */
static int judge_line(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool,
                      const struct cw_guard_in *in, long bound, long *work)
{
    struct track track = { guard, 0, bound };
    double accel = accel_along(guard, in);
    double end = in->to_go > 0.0 ? guard->gone + in->to_go : 1e30;
    double wanted = guard->gone + cw_max(stopping(guard, in, 0.5 * accel), 2.0 * stock->cell);
    if (guard->line.clear < guard->gone) guard->line.clear = guard->gone;
    send(&guard->line, &track, stock, tool, wanted + guard->speed * in->period, end, work);
    if (found(&guard->line) && guard->gone > guard->line.hit_far) {     /* it was let go on: what comes behind? */
        begin_probe(&guard->line, guard->gone);
        send(&guard->line, &track, stock, tool, wanted + guard->speed * in->period, end, work);
    }
    if (!found(&guard->line) || guard->periods < CW_GUARD_STEADY) return 0;
    guard->distance = cw_max(guard->line.hit_near - guard->gone, 0.0);
    return must_stop(guard, stock, in, accel);
}

/* [5b] As judge_line(), in a parabolic blend: only what the line meets before its end is judged. */
static int judge_bend(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool,
                      const struct cw_guard_in *in, long bound, long *work)
{
    const struct cw_corner *corner = &in->way->corner;
    struct cw_guard_in on_line = *in;
    on_line.to_go = corner->length - corner->done;
    follow_bend(guard, corner, stock, in);
    return judge_line(guard, stock, tool, &on_line, bound, work)
        && guard->line.hit_far - guard->gone + CW_GUARD_STRIP * stock->cell <= on_line.to_go;
}

int cw_guard_traverse(struct cw_guard *guard, const struct cw_stock *stock,
                      const struct cw_tool *tool, const struct cw_guard_in *in, long bound, long *work)
{
    double step = 0.0;
    int i, hit, bends = in->way && in->way->corner.on;
    for (i = 0; i < 3; i++) step += (in->to[i] - in->from[i]) * (in->to[i] - in->from[i]);
    step = sqrt(step);
    guard->distance = 0.0;
    if (!cw_finite(step)) return 0;
    measure_speed(guard, bends ? in->way->corner.speed : step / in->period, in->period);
    if (bends && in->trail) return judge_bend(guard, stock, tool, in, bound, work);
    follow(guard, stock, in, step);
    if (step < CW_GUARD_STILL || !in->trail) return 0;
    hit = judge_line(guard, stock, tool, in, bound, work);
    return judge_way(guard, stock, tool, in, step, bound, work) || hit;
}

int cw_guard_shank(struct cw_guard *guard, const struct cw_stock *stock,
                   const struct cw_tool *tool, const double from[3], const double to[3], int trail,
                   long *work)
{
    double a[3], b[3], step = 0.0, enough;
    int i;
    for (i = 0; i < 3; i++) {
        a[i] = from[i] + (i == 2 ? tool->flute : 0.0);
        b[i] = to[i] + (i == 2 ? tool->flute : 0.0);
        step += (b[i] - a[i]) * (b[i] - a[i]);
    }
    step = sqrt(step);
    if (!(tool->flute > 0.0) || misses(stock, tool->radius, a, b)) return guard->excess = 0;
    if (step < CW_GUARD_STILL) return guard->excess;
    if (guard->shank.radius != tool->radius)
        cw_tool_init(&guard->shank, 2.0 * tool->radius, 0.0, 0.0, 0.0);
    enough = ignored(stock, cw_min(a[2], b[2]), step);
    guard->excess = cw_sweep_meets(stock, &guard->shank, a, b, trail, enough, work) >= enough;
    return guard->excess;
}
