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
#define CW_GUARD_BLIND 20.0     /* mm, braking distance where the acceleration is unknown */

void cw_guard_reset_line(struct cw_guard *guard)
{
    guard->periods = 0;
    guard->gone = guard->clear = guard->speed = guard->distance = 0.0;
    guard->slowing = guard->slowing_before = guard->to_go = 0.0;
    guard->hit_near = 0.0;
    guard->hit_far = -1.0;
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
    double speed = step / in->period, dir[3], off2 = 0.0, aim = 0.0;
    int i, whole;
    guard->slowing_before = guard->slowing;
    guard->slowing = (guard->speed - speed) / in->period;
    guard->speed = speed;
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
    guard->gone = guard->clear = 0.0;
    guard->hit_far = -1.0;
    guard->periods = 1;
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

static void place_on(const struct cw_guard *guard, double s, double tip[3])
{
    int i;
    for (i = 0; i < 3; i++) tip[i] = guard->origin[i] + s * guard->dir[i];
}

/* Way to a stand at acceleration `accel`, and that of the periods until it begins, mm. */
static double stopping(const struct cw_guard *guard, const struct cw_guard_in *in, double accel)
{
    double late = CW_GUARD_LATE * guard->speed * in->period;
    if (!(accel > 0.0)) return CW_GUARD_BLIND;
    return 0.5 * guard->speed * guard->speed / accel + late;
}

/* Halves the step in which stock was met. */
static void narrow(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool, long *work)
{
    double a[3], b[3], middle = 0.5 * (guard->hit_near + guard->hit_far), enough;
    place_on(guard, guard->hit_near, a);
    place_on(guard, middle, b);
    enough = ignored(stock, cw_min(a[2], b[2]), middle - guard->hit_near);
    if (cw_sweep_meets(stock, tool, a, b, 1, enough, work) >= enough) guard->hit_far = middle;
    else guard->hit_near = middle;
}

/* Sends the probe one step on; its steps end where the segment does. */
static void send_on(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool,
                    double end, long *work)
{
    double next = guard->clear + cw_max(CW_GUARD_STEP * stock->cell, CW_GUARD_RADII * tool->radius);
    double a[3], b[3], enough;
    if (end > guard->clear + CW_GUARD_LEAST && end < next) next = end;
    place_on(guard, guard->clear, a);
    place_on(guard, next, b);
    if (!misses(stock, tool->radius, a, b)) {
        enough = ignored(stock, cw_min(a[2], b[2]), next - guard->clear);
        if (cw_sweep_meets(stock, tool, a, b, 1, enough, work) >= enough) {
            guard->hit_near = guard->clear;
            guard->hit_far = next;
            return;
        }
    }
    guard->clear = next;
}

/* [2] The probe's work of a period: on, up to `wanted` mm on the line, then to where stock begins. */
static void probe(struct cw_guard *guard, const struct cw_stock *stock, const struct cw_tool *tool,
                  const struct cw_guard_in *in, double wanted, long bound, long *work)
{
    double end = in->to_go > 0.0 ? guard->gone + in->to_go : 1e30;
    int steps = CW_GUARD_FREE;
    if (guard->clear < guard->gone) guard->clear = guard->gone;
    while (guard->hit_far < 0.0 && guard->clear < wanted && *work < bound && steps-- > 0)
        send_on(guard, stock, tool, end, work);
    while (guard->hit_far - guard->hit_near > CW_GUARD_FINE * stock->cell && *work < bound)
        narrow(guard, stock, tool, work);
}

/* [3], [4] */
static int must_stop(const struct cw_guard *guard, const struct cw_stock *stock,
                     const struct cw_guard_in *in, double accel)
{
    double near = guard->hit_near - guard->gone, far = guard->hit_far - guard->gone;
    double way = 0.5 * guard->speed * guard->speed, travel = guard->speed * in->period;
    double slowing = cw_max(guard->slowing, guard->slowing_before), thin = CW_GUARD_STRIP * stock->cell;
    if (far <= -thin) return 1;
    if (in->to_go > 0.0 && far + thin <= in->to_go)
        return near <= stopping(guard, in, 0.5 * accel);
    if (!(accel > 0.0)) return near <= CW_GUARD_BLIND;
    if (cw_min(guard->slowing, guard->slowing_before) > CW_GUARD_BRAKING * accel)
        return far <= way / slowing - travel;
    if (in->to_go > 0.0) return far <= way / accel - travel;
    return near <= way / accel + travel;
}

int cw_guard_traverse(struct cw_guard *guard, const struct cw_stock *stock,
                      const struct cw_tool *tool, const struct cw_guard_in *in, long bound, long *work)
{
    double step = 0.0, wanted, accel;
    int i;
    for (i = 0; i < 3; i++) step += (in->to[i] - in->from[i]) * (in->to[i] - in->from[i]);
    step = sqrt(step);
    guard->distance = 0.0;
    if (!cw_finite(step)) return 0;
    follow(guard, stock, in, step);
    if (step < CW_GUARD_STILL || !in->trail) return 0;
    accel = accel_along(guard, in);
    wanted = guard->gone + cw_max(stopping(guard, in, 0.5 * accel), 2.0 * stock->cell);
    probe(guard, stock, tool, in, wanted + guard->speed * in->period, bound, work);
    if (guard->hit_far < 0.0 || guard->periods < CW_GUARD_STEADY) return 0;
    guard->distance = cw_max(guard->hit_near - guard->gone, 0.0);
    return must_stop(guard, stock, in, accel);
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
