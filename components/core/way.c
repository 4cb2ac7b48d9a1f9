/* way.c - see way.h; the numbers in brackets are those of its principle. */
#include "cw_math.h"
#include "way.h"

#define CW_SHORTEST 1e-7        /* mm, a piece shorter than this is none */
#define CW_SAME_LENGTH 1e-5     /* mm: the planner has not changed a piece */
#define CW_SAME_AIM 1e-6        /* the same of its direction */
#define CW_KINK 0.02            /* rad, pieces that join at less go on smoothly [5] */
#define CW_SHARP_KINK 0.25      /* rad, a corner however short its pieces are */
#define CW_KINK_APART 0.5       /* of the step: a lesser one only so far from the last place */
#define CW_NEVER 1e300          /* mm, nothing has changed */

void cw_piece_at(const struct cw_piece *piece, double s, double tip[3], double dir[3])
{
    double flat = s * piece->level, half = 0.5 * piece->curvature * flat;
    double sine = 0.0, cosine = 1.0, chord = flat, mx, my;
    if (half != 0.0) {
        sine = sin(half);
        cosine = cos(half);
        if (fabs(half) > 1e-6) chord = flat * sine / half;
    }
    mx = piece->aim[0] * cosine - piece->aim[1] * sine;     /* of the chord: half way round */
    my = piece->aim[1] * cosine + piece->aim[0] * sine;
    tip[0] = piece->origin[0] + chord * mx;
    tip[1] = piece->origin[1] + chord * my;
    tip[2] = piece->origin[2] + s * piece->slope;
    dir[0] = piece->level * (mx * cosine - my * sine);
    dir[1] = piece->level * (my * cosine + mx * sine);
    dir[2] = piece->slope;
}

int cw_piece_line(struct cw_piece *piece, const double start[3], const double end[3])
{
    double dx = end[0] - start[0], dy = end[1] - start[1], dz = end[2] - start[2];
    double flat = sqrt(dx * dx + dy * dy);
    int i;
    piece->length = sqrt(flat * flat + dz * dz);
    if (!(piece->length > CW_SHORTEST) || !cw_finite(piece->length)) return 0;
    for (i = 0; i < 3; i++) piece->origin[i] = start[i];
    piece->aim[0] = flat > 0.0 ? dx / flat : 1.0;
    piece->aim[1] = flat > 0.0 ? dy / flat : 0.0;
    piece->level = flat / piece->length;
    piece->slope = dz / piece->length;
    piece->curvature = 0.0;
    piece->accel = 0.0;
    piece->rapid = piece->join = 0;
    return 1;
}

int cw_piece_arc(struct cw_piece *piece, const double centre[2], const double start[3],
                 double angle, double rise)
{
    double rx = start[0] - centre[0], ry = start[1] - centre[1];
    double radius = sqrt(rx * rx + ry * ry), flat = radius * fabs(angle);
    int i;
    piece->length = sqrt(flat * flat + rise * rise);
    if (!(flat > CW_SHORTEST) || !cw_finite(piece->length)) return 0;
    for (i = 0; i < 3; i++) piece->origin[i] = start[i];
    piece->aim[0] = (angle > 0.0 ? -ry : ry) / radius;
    piece->aim[1] = (angle > 0.0 ? rx : -rx) / radius;
    piece->level = flat / piece->length;
    piece->slope = rise / piece->length;
    piece->curvature = (angle > 0.0 ? 1.0 : -1.0) / radius;
    piece->accel = 0.0;
    piece->rapid = piece->join = 0;
    return 1;
}

void cw_way_reset(struct cw_way *way)
{
    way->known = way->fresh = 0;
    way->at = way->begin = way->end = 0.0;
    way->first = way->count = 0;
    way->corner.on = 0;
    way->changed = CW_NEVER;
}

static int slot(const struct cw_way *way, int n)
{
    return (way->first + n) % CW_WAY_PIECES;
}

void cw_way_follow(struct cw_way *way, long key, double length, double progress)
{
    while (way->count > 0 && way->key[slot(way, 0)] != key) {
        way->begin += way->piece[slot(way, 0)].length;
        way->first = slot(way, 1);
        way->count--;
    }
    if (way->count == 0 || fabs(way->piece[slot(way, 0)].length - length) > CW_SAME_LENGTH) {
        way->fresh = 1;
        way->count = 0;
        way->begin = way->end = 0.0;
    }
    way->at = way->begin + progress;
    way->known = 1;
}

/* Whether a piece appended in the place of one taken off is that one again. */
static int same_piece(const struct cw_piece *a, const struct cw_piece *b)
{
    return fabs(a->length - b->length) <= CW_SAME_LENGTH && fabs(a->slope - b->slope) <= CW_SAME_AIM
        && fabs(a->aim[0] - b->aim[0]) <= CW_SAME_AIM && fabs(a->aim[1] - b->aim[1]) <= CW_SAME_AIM
        && fabs(a->curvature - b->curvature) <= CW_SAME_AIM;
}

void cw_way_append(struct cw_way *way, long key, const struct cw_piece *piece)
{
    int n;
    if (way->count >= CW_WAY_PIECES) return;
    if (way->count == 0) way->end = way->begin;
    n = slot(way, way->count++);
    if (way->key[n] != key || !same_piece(&way->piece[n], piece)) way->changed = cw_min(way->changed, way->end);
    way->key[n] = key;
    way->piece[n] = *piece;
    way->end += piece->length;
}

void cw_way_retract(struct cw_way *way)
{
    if (way->count == 0) return;
    way->end -= way->piece[slot(way, --way->count)].length;
}

double cw_way_at(const struct cw_way *way, double s, double tip[3], double dir[3])
{
    double begin = way->begin;
    int n = 0;
    while (n + 1 < way->count && s > begin + way->piece[slot(way, n)].length)
        begin += way->piece[slot(way, n++)].length;
    cw_piece_at(&way->piece[slot(way, n)], s - begin, tip, dir);
    return way->piece[slot(way, n)].curvature;
}

double cw_way_braking(const struct cw_way *way, double s)
{
    double begin = way->begin, sum = 0.0;
    int n;
    for (n = 0; n < way->count && begin < s; n++) {
        const struct cw_piece *piece = &way->piece[slot(way, n)];
        double end = begin + piece->length;
        if (!(piece->accel > 0.0)) return 0.0;
        sum += piece->accel * cw_max(0.0, cw_min(end, s) - cw_max(begin, way->at));
        begin = end;
    }
    return sum;
}

/* Angle between two unit vectors, rad. */
static double angle_between(const double a[3], const double b[3])
{
    double chord2 = 0.0, half;
    int i;
    for (i = 0; i < 3; i++) chord2 += (a[i] - b[i]) * (a[i] - b[i]);
    half = 0.5 * sqrt(chord2);
    return half < 0.1 ? 2.0 * half : 2.0 * asin(cw_min(half, 1.0));
}

/* Angle by which the way turns where a piece ends and the next one begins, rad. */
static double kink(const struct cw_piece *piece, const struct cw_piece *next)
{
    double tip[3], before[3], after[3];
    cw_piece_at(piece, piece->length, tip, before);
    cw_piece_at(next, 0.0, tip, after);
    return angle_between(before, after);
}

static int place_at(const struct cw_piece *piece, double begin, double s, double turn, int corner,
                    struct cw_way_place *place)
{
    cw_piece_at(piece, s - begin, place->tip, place->dir);
    place->s = s;
    place->curvature = piece->curvature;
    place->turn = turn;
    place->corner = corner;
    return 1;
}

int cw_way_next(const struct cw_way *way, double s, double step, double turn, struct cw_way_place *next)
{
    double begin = way->begin, turned = 0.0;
    int n = 0;
    if (way->count == 0 || s >= way->end) return 0;
    while (n + 1 < way->count && s > begin + way->piece[slot(way, n)].length)
        begin += way->piece[slot(way, n++)].length;
    for (;;) {
        const struct cw_piece *piece = &way->piece[slot(way, n)];
        double end = begin + piece->length, from = cw_max(s, begin), goal = s + step, angle;
        double bend = fabs(piece->curvature) * piece->level;
        if (bend * (goal - from) > turn - turned) goal = from + cw_max(0.0, turn - turned) / bend;
        if (goal < end || n + 1 >= way->count)
            return place_at(piece, begin, cw_min(goal, end), turned + bend * (cw_min(goal, end) - from), 0, next);
        turned += bend * cw_max(0.0, end - from);
        angle = kink(piece, &way->piece[slot(way, n + 1)]);
        if (s >= end - CW_WAY_BEYOND && angle > CW_KINK)
            return place_at(&way->piece[slot(way, n + 1)], end, end + CW_WAY_BEYOND, angle, 1, next);
        if (angle > CW_SHARP_KINK || turned + angle > turn || (angle > CW_KINK && end - s >= CW_KINK_APART * step))
            return place_at(piece, begin, end, turned, 0, next);
        turned += angle;
        begin = end;
        n++;
    }
}

double cw_way_stop(const struct cw_way *way, double speed, double accel)
{
    double begin = way->begin, energy = 0.5 * speed * speed;
    int n;
    for (n = 0; n < way->count; n++) {
        const struct cw_piece *piece = &way->piece[slot(way, n)];
        double from = cw_max(begin, way->at), end = begin + piece->length;
        double brake = piece->accel > 0.0 ? piece->accel : accel;
        if (!(brake > 0.0)) return CW_NEVER;
        if (end > from) {
            if (energy <= brake * (end - from)) return from + energy / brake;
            energy -= brake * (end - from);
        }
        begin = end;
    }
    return way->end;
}
