/* SPDX-License-Identifier: GPL-2.0-or-later */
/* path.h - the programmed path ahead of the tool, as far as the braking distance and beyond.
 *
 * Who calls it: tracker.c owns it; lookahead.c and guard.c read it; linuxcnc_planner.c (HAL side) fills it with the
 * program's own segments.
 * Source: none.
 *
 * Principle:
 *  1. A segment has an origin, a heading, a curvature in XY, a slope and a length: it is a
 *     line, an arc or a helix.
 *  2. The programmed path is a chain of segments as the motion planner has them queued, blend
 *     arcs included. Positions on it are arc lengths s, mm, counted from where the chain began. Segments the
 *     tool has left are dropped, new ones are appended, and s goes on.
 *  3. If the planner cannot be read the path is one endless segment, the predicted path (predicted_path.h).
 *  4. A parabolic blend leaves the chain: `blend` says where the tool is in it.
 *  5. A corner (two segments that do not join smoothly) has two points: one at the
 *     end of the first segment, and one CHIP_PATH_BEYOND behind it, with the direction of the next. The beginning and the
 *     end of a blend arc have one: the load is largest or smallest there.
 */
#ifndef CHIPWISE_PATH_H
#define CHIPWISE_PATH_H

#define CHIP_PATH_SEGMENTS 160 /* segments known ahead at most */
#define CHIP_PATH_DESCENT 1e-4 /* mm a unit step falls by from which on the path goes down */
#define CHIP_PATH_BEYOND 1e-7  /* mm behind a corner at which the next segment counts [5] */

enum chip_join {
    CHIP_JOIN_STOP = 0,     /* the tool stops at the end of the segment */
    CHIP_JOIN_TANGENT = 1,  /* the next segment begins where it ends, without a stop */
    CHIP_JOIN_PARABOLIC = 2 /* a blend leaves it before its end [4], or may still do so */
};

struct chip_segment {
    double origin[3];            /* mm, where it begins */
    double heading[2];           /* cosine and sine of the heading in XY at the origin */
    double horizontal, vertical; /* horizontal and vertical part of a unit step */
    double curvature;            /* rad per mm of horizontal travel, counter-clockwise positive */
    double length;               /* mm of travel; not used by a predicted path */
    double accel;                /* mm/s2 the planner may brake with along it; 0: unknown */
    double overlap[2]; /* mm at its beginning and end along which it brakes with half of that, in a parabolic blend */
    double feed;       /* mm/s, F of the program on it; 0: the planner has F itself, or it is unknown */
    int rapid;         /* it is a traverse */
    int join;          /* chip_join: how its end is left */
};

/* While the planner blends one segment into the next by a parabola the tool is on neither of them: it
 * moves on both at once, slower and slower on the first, faster and faster on the next [4]. */
struct chip_blend {
    int active;                     /* the tool is in a blend now, and the next segment is a straight traverse */
    double start[3], dir[3];        /* mm, start of the next segment; its unit vector */
    double length, travelled;       /* mm, length of the next segment, and travelled on it so far */
    double speed, end_speed;        /* mm/s on the next segment, now and at the end of the blend */
    double first_left, first_speed; /* mm left of the first segment, mm/s on it */
};

struct chip_path {
    int known;                                       /* the planner's queue is being followed */
    int new_chain;                                   /* the chain is a new one; until chip_path_mark_read() */
    double s;                                        /* mm, position of the tool */
    double begin_s;                                  /* mm, where the first segment begins */
    long key[CHIP_PATH_SEGMENTS];                    /* names of the segments, given by the planner's reader */
    struct chip_segment segment[CHIP_PATH_SEGMENTS]; /* ring, `first` is the one the tool is on */
    int first, count;
    double end_s;     /* mm, where the last segment ends */
    double changed_s; /* mm, the path differs from here on from what it was; until chip_path_mark_read() */
    struct chip_blend blend;
};

/* Index of the n-th segment from the one the tool is on: without a division, it is asked for every segment of every period. */
static inline int chip_path_slot(const struct chip_path *path, int n)
{
    n += path->first;
    return n < CHIP_PATH_SEGMENTS ? n : n - CHIP_PATH_SEGMENTS;
}

/* Tip (mm) and direction (unit vector) `s` mm behind the beginning of a segment. */
void chip_segment_at(const struct chip_segment *segment, double s, double tip[3], double dir[3]);

/* Makes a line from start to end, mm. Returns 0 if it has no length. */
int chip_segment_line(struct chip_segment *segment, const double start[3], const double end[3]);

/* Makes an arc or helix in XY from centre, start, angle (rad, counter-clockwise
 * positive) and rise (mm). Returns 0 if it has no length. */
int chip_segment_arc(struct chip_segment *segment, const double centre[2], const double start[3], double angle,
                     double rise);

/* Clears the path. */
void chip_path_reset(struct chip_path *path);

/* The tool is `progress` mm into the segment named `key`, of `length` mm. Drops what lies behind;
 * begins a new chain if the segment is not a known one. */
void chip_path_follow(struct chip_path *path, long key, double length, double progress);

/* The look-ahead has read the path: clears new_chain and changed_s. */
void chip_path_mark_read(struct chip_path *path);

/* Appends a segment; ignored if there is no room. */
void chip_path_append(struct chip_path *path, long key, const struct chip_segment *segment);

/* Removes the last segment. */
void chip_path_retract(struct chip_path *path);

/* Tip and direction at `s` (mm), beyond the ends too; returns the curvature there, rad/mm. */
double chip_path_at(const struct chip_path *path, double s, double tip[3], double dir[3]);

/* A point on the path. */
struct chip_path_point {
    double s;              /* mm */
    double tip[3], dir[3]; /* mm; unit vector */
    double curvature;      /* rad/mm */
    double turn;           /* rad the path turns by since the point before */
    int corner;            /* it turns by that at once: the point before has the same position */
};

/* The point `step` mm behind `s`, or nearer: where the path has turned by `turn` rad, at a corner [5], at its end.
 * Returns 0 if there is none. */
int chip_path_next(const struct chip_path *path, double s, double step, double turn, struct chip_path_point *next);

/* The position from which on the tool, going `speed` mm/s, can no longer stop, mm; `accel` (mm/s2) is used for
 * braking on segments whose own acceleration is unknown. */
double chip_path_stop(const struct chip_path *path, double speed, double accel);

/* Travel until the tool goes down by a feed, mm, and in *accel the mean it may brake with until there, mm/s2 (0: unknown); negative if
 * that is not in sight, or the tool stops before. */
double chip_path_descent(const struct chip_path *path, double *accel);

/* Sum of accel x length of a segment from `from` to `to`, mm behind its beginning, mm2/s2. */
double chip_segment_braking(const struct chip_segment *segment, double from, double to);

/* mm/s2 the planner brakes with on a segment in the parabolic blend at its beginning (0) or end (1). */
static inline double chip_segment_blend_accel(const struct chip_segment *segment, int end)
{
    return segment->overlap[end] > 0.0 ? 0.5 * segment->accel : segment->accel;
}

/* Sum of accel x length from the tool to `s`, mm2/s2: half of what braking takes off
 * the square of the velocity. 0 if a segment's acceleration is unknown. */
double chip_path_braking(const struct chip_path *path, double s);

#endif
