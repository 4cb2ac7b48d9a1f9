/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer_sensor.c - see tracer_sensor.h; the numbers in brackets are those of tracer.h's principle. */
#include "chip_math.h"
#include "tracer.h"
#include "tracer_law.h"
#include "tracer_sensor.h"

#define CHIP_TRACER_FALL 0.3        /* of eps0: noise, stick and slip in a period */
#define CHIP_TRACER_FALL_TRAVEL 2.0 /* of the head's travel in the period: a hollow model can turn it into more */
#define CHIP_TRACER_KNOWN 60        /* periods from which the noise of an axis is known */
#define CHIP_TRACER_OLD 4096        /* periods after which what is known counts half */
#define CHIP_TRACER_RARE 4          /* a run of equal readings this much longer than any before */
#define CHIP_TRACER_RUN 3           /* and this many periods besides */
#define CHIP_TRACER_UNMOVED 0.1     /* of eps0: the head moves along n by so much, and no reading changes */
#define CHIP_TRACER_LIFT 2.0        /* eps0 / s more in each period in which no reading changes */
#define CHIP_TRACER_SUMS_S 0.05     /* s over which expected and seen are compared */
#define CHIP_TRACER_OFF 0.3         /* of eps0: noise, and a head whose axes are not quite square */
#define CHIP_TRACER_OFF_PATH 0.2    /* of the ball's path: friction that changes */
#define CHIP_TRACER_OFF_CHANGE 0.15 /* of the change of the deflection: its scale */
#define CHIP_TRACER_DOUBT 0.6       /* of what is a contradiction */
#define CHIP_TRACER_CYCLE 64        /* periods of a swing */
#define CHIP_TRACER_BLOCK 256       /* periods over which the answer to the swing is judged */
#define CHIP_TRACER_SETTLED_S 0.3   /* s of a line from which friction is known */
#define CHIP_TRACER_TURNED 0.01     /* change of n, squared, from which a block is not judged */
#define CHIP_TRACER_LEVELS 4

static const double swing_share[CHIP_TRACER_LEVELS] = { 0.001, 0.003, 0.01, 0.03 }; /* of eps0 */

static double inner(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
static double size_of(const double v[3]) { return chip_sqrt(inner(v, v)); }

static int in_contact(const struct chip_tracer *tracer)
{
    return tracer->state == CHIP_TRACER_TRACE || tracer->state == CHIP_TRACER_PICK;
}

const double *chip_tracer_late(const struct chip_tracer *tracer, double period_s)
{
    double sensor_s = tracer->settings.dead_time_s - tracer->settings.drive_time_s;
    int late = (int)chip_min(sensor_s / period_s + 0.5, CHIP_TRACER_DELAY - 1);
    CHIP_FAULT(DRIVE_AS_SENSOR, late = (int)(tracer->settings.dead_time_s / period_s + 0.5));
    if (late > tracer->stored - 1) late = tracer->stored - 1;
    CHIP_FAULT(POSITION_NOT_LATE, late = 0);
    return tracer->position_mm[(tracer->newest + CHIP_TRACER_DELAY - late) % CHIP_TRACER_DELAY];
}

int chip_tracer_fell(const struct chip_tracer *tracer, const double e[3], const double before[3], double period_s)
{
    double step[3], now = size_of(e), was = size_of(before), travel = size_of(tracer->velocity_mm_s) * period_s;
    double late = size_of(tracer->sensor.moved_mm), eps0 = tracer->settings.deflection_mm;
    int i;
    for (i = 0; i < 3; i++) step[i] = e[i] - before[i];
    if (CHIP_FAULTY(FALL_FOLLOWED) || (now > 0.9 * was && inner(e, before) > 0.0)) return 0;
    return size_of(step) > CHIP_TRACER_FALL * eps0 + CHIP_TRACER_FALL_TRAVEL * chip_max(travel, late);
}

/* What is known of an axis' noise, in the air (where 0) and in contact (where 1). */
static void learn(struct chip_tracer_sensor *sensor, int where, int axis, int run_before)
{
    int changed = sensor->run[axis] == 0;
    sensor->periods[axis][where]++;
    sensor->changes[axis][where] += changed;
    if (sensor->periods[axis][where] % 256 == 0) sensor->longest[axis] -= (sensor->longest[axis] + 7) / 8;
    if (changed && run_before > sensor->longest[axis]) sensor->longest[axis] = run_before;
    if (sensor->periods[axis][where] > CHIP_TRACER_OLD) {
        sensor->periods[axis][where] /= 2;
        sensor->changes[axis][where] /= 2;
    }
}

/* The reading of an axis changes in at least this many of ten periods. */
static int changes_in(const struct chip_tracer_sensor *sensor, int where, int axis, int tenths)
{
    return sensor->periods[axis][where] >= CHIP_TRACER_KNOWN
        && 10 * sensor->changes[axis][where] >= tenths * sensor->periods[axis][where];
}

/* The axis has noise: in nearly all periods in the air, or in a third of them in the air and in contact. */
static int has_noise(const struct chip_tracer_sensor *sensor, int contact, int axis)
{
    if (changes_in(sensor, 0, axis, 9)) return 1;
    return changes_in(sensor, 0, axis, 3) && (!contact || changes_in(sensor, 1, axis, 3));
}

/* An axis with noise is frozen [8]. */
static int stands_still(struct chip_tracer *tracer, const double before[3], double eps)
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    int i, found = 0, contact = in_contact(tracer), still = inner(sensor->moved_mm, sensor->moved_mm) == 0.0;
    int air = eps < CHIP_TRACER_CONTACT * tracer->settings.deflection_mm
           && (tracer->state == CHIP_TRACER_APPROACH || tracer->state == CHIP_TRACER_RETURN);
    for (i = 0; i < 3; i++) {
        int run_before = sensor->run[i];
        sensor->run[i] = tracer->deflection_mm[i] == before[i] ? (int)chip_min(run_before + 1, 1000000) : 0;
        if (air || contact || (tracer->state == CHIP_TRACER_IDLE && still)) learn(sensor, contact, i, run_before);
        found |=
            sensor->run[i] >= CHIP_TRACER_RARE * sensor->longest[i] + CHIP_TRACER_RUN && has_noise(sensor, contact, i);
    }
    return found && !CHIP_FAULTY(NOISE_NOT_MISSED);
}

/* No reading changes although the head moves along n [8]. */
static int is_unmoved(struct chip_tracer *tracer, const double late[3])
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    double along = 0.0;
    int i, run = sensor->run[0] < sensor->run[1] ? sensor->run[0] : sensor->run[1];
    run = sensor->run[2] < run ? sensor->run[2] : run;
    sensor->held_periods = run;
    if (run == 0)
        for (i = 0; i < 3; i++) sensor->held_mm[i] = late[i];
    for (i = 0; i < 3; i++) along += (late[i] - sensor->held_mm[i]) * tracer->normal[i];
    if (along < 0.0) along = -along;
    return run > CHIP_TRACER_RUN && along > CHIP_TRACER_UNMOVED * tracer->settings.deflection_mm
        && !CHIP_FAULTY(FROZEN_FOLLOWED);
}

/* The ball moves along the surface, to which e is perpendicular but for friction: its path has no part along e [8]. */
static int contradicts(struct chip_tracer *tracer, const double before[3], double period_s)
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    double keep = 1.0 - chip_min(1.0, period_s / CHIP_TRACER_SUMS_S), middle[3], ball[3], step[3], size, most, along;
    double eps0 = tracer->settings.deflection_mm, friction = tracer->law.friction_share + CHIP_TRACER_OFF_PATH;
    int i;
    for (i = 0; i < 3; i++) {
        middle[i] = 0.5 * (tracer->deflection_mm[i] + before[i]);
        step[i] = tracer->deflection_mm[i] - before[i];
        ball[i] = sensor->moved_mm[i] + step[i];
    }
    size = size_of(middle);
    if (size < CHIP_TRACER_CONTACT * eps0 || tracer->state == CHIP_TRACER_IDLE) {
        sensor->off_mm = sensor->path_mm = sensor->change_mm = sensor->doubt_share = 0.0;
        return 0;
    }
    along = inner(middle, ball) / size;
    sensor->off_mm = keep * sensor->off_mm + along;
    sensor->path_mm = keep * sensor->path_mm + chip_sqrt(chip_max(0.0, inner(ball, ball) - along * along));
    sensor->change_mm = keep * sensor->change_mm + size_of(step);
    most = CHIP_TRACER_OFF * eps0 + CHIP_TRACER_OFF_CHANGE * sensor->change_mm;
    sensor->doubt_share = sensor->off_mm < 0.0 ? -sensor->off_mm / (most + friction * sensor->path_mm)
                                               : sensor->off_mm / (most + CHIP_TRACER_OFF_PATH * sensor->path_mm);
    return sensor->doubt_share > 1.0 && !CHIP_FAULTY(CONTRADICTION_FOLLOWED);
}

static void begin_block(struct chip_tracer *tracer)
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    int i;
    for (i = 0; i < 3; i++) sensor->block_normal[i] = tracer->normal[i];
    sensor->block_periods = 0;
    sensor->noise_mm2 = 0.0;
    for (i = 0; i < 2; i++) sensor->asked_mm[i] = sensor->answer_mm[i] = 0.0;
}

/* The answer of a whole block: a larger swing if it is missing; -> whether the largest is not answered. */
static int has_no_answer(struct chip_tracer_sensor *sensor, double eps0)
{
    const double *a = sensor->asked_mm, *b = sensor->answer_mm;
    double asked = a[0] * a[0] + a[1] * a[1], answer = b[0] * b[0] + b[1] * b[1];
    double least = 0.2 * swing_share[sensor->level] * eps0 * CHIP_PI * CHIP_TRACER_BLOCK / CHIP_TRACER_CYCLE;
    if (asked < least * least || asked < 32.0 * sensor->noise_mm2 / CHIP_TRACER_BLOCK) return 0;
    if (answer > 0.25 * asked) {
        if (sensor->level > 0) sensor->level--;
        return 0;
    }
    if (sensor->level < CHIP_TRACER_LEVELS - 1) {
        sensor->level++;
        return 0;
    }
    return answer < 0.1 * asked && !CHIP_FAULTY(SWING_UNHEARD);
}

/* The deflection has to follow the swing of the head along n [8]. */
static int does_not_answer(struct chip_tracer *tracer, const double before[3], double eps)
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    double was = size_of(before), turn[3], expected, phase, base[2];
    int i;
    for (i = 0; i < 3; i++) turn[i] = tracer->normal[i] - sensor->block_normal[i];
    if (!in_contact(tracer) || tracer->law.since_s < CHIP_TRACER_SETTLED_S || inner(turn, turn) > CHIP_TRACER_TURNED
        || eps < CHIP_TRACER_CONTACT * tracer->settings.deflection_mm) {
        begin_block(tracer);
        return 0;
    }
    phase = 2.0 * CHIP_PI * sensor->phase / CHIP_TRACER_CYCLE;
    base[0] = sin(phase);
    base[1] = cos(phase);
    expected =
        -inner(sensor->moved_mm, tracer->normal) * inner(tracer->deflection_mm, tracer->normal) / chip_max(eps, 1e-9);
    for (i = 0; i < 2; i++) {
        sensor->asked_mm[i] += expected * base[i];
        sensor->answer_mm[i] += (eps - was) * base[i];
    }
    sensor->noise_mm2 += (eps - was) * (eps - was);
    if (++sensor->block_periods < CHIP_TRACER_BLOCK) return 0;
    i = has_no_answer(sensor, tracer->settings.deflection_mm);
    begin_block(tracer);
    return i;
}

double chip_tracer_swing(const struct chip_tracer *tracer)
{
    double phase = 2.0 * CHIP_PI * tracer->sensor.phase / CHIP_TRACER_CYCLE;
    return swing_share[tracer->sensor.level] * tracer->settings.deflection_mm * sin(phase);
}

double chip_tracer_lift(const struct chip_tracer *tracer)
{
    int run = tracer->sensor.held_periods - 2;
    double vel = CHIP_TRACER_LIFT * tracer->settings.deflection_mm * run;
    return run > 0 ? chip_min(vel, tracer->settings.approach_vel_mm_s) : 0.0;
}

/* In doubt of where the deflection points to, its length counts: it rises so fast that the head, which may have become
 * faster since it was read, cannot stop within its range [8]. */
static int is_hopeless(struct chip_tracer *tracer, double eps, double period_s)
{
    const struct chip_tracer_settings *s = &tracer->settings;
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    double rise = (eps - sensor->eps_mm[sensor->newest]) / (CHIP_TRACER_RISES * period_s), late, speed;
    sensor->eps_mm[sensor->newest] = eps;
    sensor->newest = (sensor->newest + 1) % CHIP_TRACER_RISES;
    late = s->dead_time_s + period_s;
    speed = rise + s->acceleration_mm_s2 * (late + 0.5 * CHIP_TRACER_RISES * period_s);
    speed = chip_min(speed, size_of(tracer->velocity_mm_s));
    return sensor->doubt_share > CHIP_TRACER_DOUBT && rise > 0.0 && eps < s->range_mm
        && eps + speed * late + 0.5 * speed * speed / s->acceleration_mm_s2 > s->range_mm;
}

int chip_tracer_sensor(struct chip_tracer *tracer, const double before[3], double eps, double period_s)
{
    struct chip_tracer_sensor *sensor = &tracer->sensor;
    const double *late = chip_tracer_late(tracer, period_s);
    int i, still, unmoved, wrong = 0, deaf, hopeless;
    for (i = 0; i < 3; i++) {
        sensor->moved_mm[i] = sensor->has_late ? late[i] - sensor->late_mm[i] : 0.0;
        sensor->late_mm[i] = late[i];
    }
    sensor->has_late = 1;
    sensor->phase = (sensor->phase + 1) % CHIP_TRACER_CYCLE;
    still = stands_still(tracer, before, eps);
    unmoved = is_unmoved(tracer, late);
    deaf = does_not_answer(tracer, before, eps);
    wrong = contradicts(tracer, before, period_s);
    hopeless = is_hopeless(tracer, eps, period_s);
    if (tracer->state == CHIP_TRACER_IDLE || tracer->state > CHIP_TRACER_LOST) return CHIP_TRACER_NO_FAULT;
    if (hopeless) return CHIP_TRACER_TOO_FAR;
    if (still || (in_contact(tracer) && (unmoved || deaf))) return CHIP_TRACER_FROZEN;
    return wrong ? CHIP_TRACER_CONTRADICTS : CHIP_TRACER_NO_FAULT;
}
