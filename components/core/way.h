/* way.h - the way the tool is going, as far ahead as the braking distance and further.
 *
 * Who calls it: ahead.c, tracker.c; planner.h (HAL side) hands in the program's own pieces.
 * Source: none.
 *
 * Principle:
 *  1. A piece of way is an origin, a heading, a curvature in XY, a slope and a length: a
 *     line, an arc or a helix.
 *  2. The program's own way is a chain of pieces as the motion planner has them queued, blend
 *     arcs included. Places on it are counted in mm from where the chain began; pieces the
 *     tool has left are dropped, new ones appended, and the count goes on.
 *  3. Where the planner cannot be read the way is one endless piece, the course (course.h).
 *  4. A parabolic blend leaves the chain: `corner` says where the tool is in it.
 *  5. At a corner of the way (two pieces that do not join smoothly) there are two places: one at the
 *     end of the first piece, and one CW_WAY_BEYOND behind it, with the direction of the next.
 */
#ifndef CHIPWISE_WAY_H
#define CHIPWISE_WAY_H

#define CW_WAY_PIECES 160       /* pieces known ahead at most */
#define CW_WAY_BEYOND 1e-7      /* mm behind a corner the next piece counts from [5] */

enum cw_join {
    CW_JOIN_STOP = 0,           /* the tool stands at the end of the piece */
    CW_JOIN_TANGENT = 1,        /* the next piece begins where it ends, without a stop */
    CW_JOIN_PARABOLIC = 2       /* a blend leaves it before its end [4], or may do so yet */
};

struct cw_piece {
    double origin[3];           /* mm, where it begins */
    double aim[2];              /* cosine and sine of the heading in XY at the origin */
    double level, slope;        /* horizontal and vertical part of a unit step */
    double curvature;           /* rad per mm of horizontal travel, counter-clockwise positive */
    double length;              /* mm of travel; not used by a course */
    double accel;               /* mm/s2 the planner may brake with along it; 0: not known */
    int rapid;                  /* a traverse */
    int join;                   /* cw_join: how its end is left */
};

/* While the planner blends one piece into the next by a parabola the tool is on neither of them: it
 * moves on both at once, slower and slower on the first, faster and faster on the next [4]. */
struct cw_corner {
    int on;                     /* this is so now, and the next piece is a straight traverse */
    double start[3], dir[3];    /* mm, the next piece; unit vector */
    double length, done;        /* mm of it, and gone of it so far */
    double speed, top;          /* mm/s on it, now and at the end of the blend */
    double left, slow;          /* mm left of the first piece, mm/s on it */
};

struct cw_way {
    int known;                  /* the planner's queue is being followed */
    int fresh;                  /* the chain is a new one; cleared by who has seen it */
    double at;                  /* mm, place of the tool */
    double begin;               /* mm, place where the first piece begins */
    long key[CW_WAY_PIECES];    /* the reader's names of the pieces */
    struct cw_piece piece[CW_WAY_PIECES];       /* ring, `first` is the one the tool is on */
    int first, count;
    double end;                 /* mm, place where the last piece ends */
    double changed;             /* mm, from this place on the way is another than it was; cleared by who has seen it */
    struct cw_corner corner;
};

/* Tip (mm) and direction (unit vector) `s` mm behind the beginning of a piece. */
void cw_piece_at(const struct cw_piece *piece, double s, double tip[3], double dir[3]);

/* Fills a piece from a line: start and end, mm. Returns 0 when it has no length. */
int cw_piece_line(struct cw_piece *piece, const double start[3], const double end[3]);

/* Fills a piece from an arc or helix in XY: centre, start, angle (rad, counter-clockwise
 * positive) and rise (mm). Returns 0 when it has no length. */
int cw_piece_arc(struct cw_piece *piece, const double centre[2], const double start[3],
                 double angle, double rise);

/* Forgets the way. */
void cw_way_reset(struct cw_way *way);

/* The tool is `progress` mm into the piece named `key`, of `length` mm. Drops what lies behind;
 * begins a new chain when the piece is not one of those known. */
void cw_way_follow(struct cw_way *way, long key, double length, double progress);

/* Appends a piece; ignored when there is no room. */
void cw_way_append(struct cw_way *way, long key, const struct cw_piece *piece);

/* Takes the last piece off again. */
void cw_way_retract(struct cw_way *way);

/* Tip and direction at the place `s` (mm, counted as `at` is), before and behind the ends too;
 * returns the curvature there, rad/mm. */
double cw_way_at(const struct cw_way *way, double s, double tip[3], double dir[3]);

/* A place on the way. */
struct cw_way_place {
    double s;                   /* mm, counted as `at` is */
    double tip[3], dir[3];      /* mm; unit vector */
    double curvature;           /* rad/mm */
    double turn;                /* rad the way turns by since the place before */
    int corner;                 /* it turns by that at once: the place before is at the same spot */
};

/* The place `step` mm behind `s`, or nearer: where the way has turned by `turn` rad, at a corner [5], at its end.
 * Returns 0 where there is none. */
int cw_way_next(const struct cw_way *way, double s, double step, double turn, struct cw_way_place *next);

/* The place from which on the tool, going `speed` mm/s, can no longer reach a stand, mm; braking
 * is taken as `accel` (mm/s2) where a piece's own is not known. */
double cw_way_stop(const struct cw_way *way, double speed, double accel);

/* Sum of accel x length from the tool to the place `s`, mm2/s2: half of what braking takes off
 * the square of the velocity. 0 where a piece's acceleration is not known. */
double cw_way_braking(const struct cw_way *way, double s);

#endif
