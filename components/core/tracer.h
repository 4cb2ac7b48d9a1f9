/* SPDX-License-Identifier: GPL-2.0-or-later */
/* tracer.h - profiling control: the deflection of a tracer head becomes the velocity of the axes, so that the stylus
 * follows a model.
 *
 * Who calls it: tracer.comp, once per servo period; offline/tracer_loop.c for tests and the bench.
 * Source: the abstract on profiling control of a master-slave system (tracer head TC1, speed commands Vx, Vy, Vz from its
 * detection signals). It does not say how; normal and tangential velocity, friction estimate, heading and limits are ours.
 *
 * Principle:
 *  1. p is the position of the head, e the deflection of the stylus: the ball's centre is c = p + e. eps = |e|. Without
 *     friction e is along the normal n of the surface, away from the model.
 *  2. The law acts in the trace plane with the unit vectors a and b. Normal velocity: gain x (eps - eps0) along n;
 *     tangential velocity: the feed along t, which is n turned by 90 degrees, so that t = a if n = b.
 *  3. Friction turns e from n against the direction of travel by an angle phi. c itself moves along the surface, so a
 *     chord of c shows t, and the angle between chord and e shows phi. Its sine times (part of e in the plane) / eps is the
 *     same at every slope; this number is averaged while the stylus slides, and turns e back into n. After a change of
 *     direction it sticks first: the force of friction turns with the travel of the head, as far as its largest value.
 *  4. n is known late, by the dead time. The rate of the heading, by a filter without lag at a constant rate, turns t
 *     ahead by the dead time and half a period. In a bend e turns with the surface, and its part along the surface moves
 *     the head along n: p = c - e. That is added to the normal velocity.
 *  5. Limits, whatever the settings ask: the velocity from which the head stops at acceleration A, after the dead time,
 *     within a share of range - eps0, which is less than sqrt(2 A (range - eps0)); gain x (dead time + period) <= 0.75;
 *     in a bend, feed x rate of heading <= A; at the beginning of a line the rate is not known yet, so the feed rises
 *     over ten dead times; the feed falls as eps leaves eps0. The velocity changes with A at most, and
 *     its part along n first.
 *  6. A state ends the others: contact lost -> LOST, which goes back along n until there is contact; eps >= range ->
 *     OVER_RANGE; a value that cannot be -> FAULT. In these two the head brakes with A and rests until `enable` is FALSE.
 *  7. Every output is finite, and no velocity is above `velocity_limit_mm_s` unless it is falling with A.
 *  8. The sensor has to show what the head does, else it is a fault: (a) the deflection cannot fall faster than the head
 *     moves; (b) the reading of an axis that has noise cannot freeze; (c) a reading cannot stay the same while the head moves
 *     along n; (d) c moves along the surface, and e is perpendicular to that but for friction, so the path of c has no part
 *     along e; (e) the deflection asked for swings by a thousandth, which a deaf sensor does not answer: the swing grows,
 *     as far as 3 %, before it is a fault; (f) in doubt by (d), a deflection that rises faster than A can end
 *     within the range is over-range. While no reading changes the head moves away from the model, so that (c) decides, and
 *     the feed falls as far as the head can stop within its range.
 */
#ifndef CHIPWISE_TRACER_H
#define CHIPWISE_TRACER_H

#define CHIP_TRACER_DELAY 64  /* positions kept: longest dead time, periods */
#define CHIP_TRACER_CHORD 8   /* periods before and after the middle of a chord [3] */
#define CHIP_TRACER_WINDOW 17 /* 2 x CHIP_TRACER_CHORD + 1 */
#define CHIP_TRACER_RISES 4   /* periods over which the deflection is seen to rise */

enum chip_tracer_state {
    CHIP_TRACER_IDLE = 0,
    CHIP_TRACER_APPROACH = 1, /* towards the model until there is contact */
    CHIP_TRACER_TRACE = 2,
    CHIP_TRACER_PICK = 3,    /* pick feed: in contact, to the next line */
    CHIP_TRACER_RETRACT = 4, /* away from the model */
    CHIP_TRACER_RETURN = 5,  /* above the model to the beginning of the next line */
    CHIP_TRACER_LOST = 6,    /* back towards the model */
    CHIP_TRACER_OVER_RANGE = 7,
    CHIP_TRACER_FAULT = 8,
    CHIP_TRACER_DONE = 9
};

enum chip_tracer_mode {
    CHIP_TRACER_ONE_WAY = 1,   /* lines along the scan axis, each from the same side */
    CHIP_TRACER_BOTH_WAYS = 2, /* lines along the scan axis, to and fro */
    CHIP_TRACER_CONTOUR = 3,   /* round the model in XY at a height, 360 degrees; pick feed along Z */
    CHIP_TRACER_PARTIAL = 4    /* the same between the window's sides, to and fro */
};

enum chip_tracer_limit {
    CHIP_TRACER_BY_NOTHING = 0,
    CHIP_TRACER_BY_RANGE = 1,      /* braking within the head's range */
    CHIP_TRACER_BY_MAX_VEL = 2,    /* max_vel_mm_s */
    CHIP_TRACER_BY_BEND = 3,       /* rate of the heading */
    CHIP_TRACER_BY_DEFLECTION = 4, /* eps away from eps0 */
    CHIP_TRACER_BY_WINDOW = 5,     /* braking before the end of a line */
    CHIP_TRACER_BY_GAIN = 6        /* the gain is held below what was asked for; the feed is not */
};

enum chip_tracer_fault {
    CHIP_TRACER_NO_FAULT = 0,
    CHIP_TRACER_SETTINGS = 1,   /* a setting is not finite or out of its range */
    CHIP_TRACER_NOT_FINITE = 2, /* deflection or position */
    CHIP_TRACER_SENSOR_JUMP =
        3, /* the deflection changed by more than max_jump_mm, or fell faster than the head moves */
    CHIP_TRACER_POSITION_JUMP = 4, /* the position changed by more than max_jump_mm in a period */
    CHIP_TRACER_NO_CONTACT = 5,    /* nothing met within search_mm */
    CHIP_TRACER_SOFT_LIMIT = 6,    /* at min_mm or max_mm of an axis */
    CHIP_TRACER_COLLISION = 7,     /* contact on the return above the model */
    CHIP_TRACER_TOO_FAR = 8,       /* eps >= range: with the state OVER_RANGE */
    CHIP_TRACER_BELOW = 9,         /* a line has gone round to the underside of the model */
    CHIP_TRACER_FROZEN = 10,       /* the deflection does not change as the head moves [8] */
    CHIP_TRACER_CONTRADICTS = 11   /* it changes otherwise than the head moves [8] */
};

struct chip_tracer_settings {
    int mode_number;           /* chip_tracer_mode */
    int scan_axis_number;      /* 0 X, 1 Y: of the lines; the pick feed is along the other */
    int direction_sign;        /* 1 or -1: first line towards + or -; contour: model on the right or on the left */
    double feed_mm_s;          /* along the surface */
    double approach_vel_mm_s;  /* approach, and back to the model when contact is lost */
    double return_vel_mm_s;    /* retract and return */
    double max_vel_mm_s;       /* of the head, in any direction */
    double acceleration_mm_s2; /* of the head, in any direction: A */
    double gain_hz;            /* normal velocity per deflection error, mm/s per mm */
    double deflection_mm;      /* to hold: eps0 */
    double range_mm;           /* the head's range: eps is below it */
    double dead_time_s;        /* from velocity to measured deflection, without the period itself */
    double drive_time_s;       /* part of it from velocity to position; the rest is the sensor's */
    double max_jump_mm;        /* a larger change in a period is a fault */
    double friction_share;     /* sine of the friction angle to begin with, 0..0.6 */
    double pick_mm;            /* pick feed; its sign is its direction */
    double retract_mm;         /* clearance of retract and return */
    double search_mm;          /* longest approach */
    double lost_mm;            /* longest travel back to the model when contact is lost */
    double approach_dir[3];    /* direction of the approach; any length */
    double window_min_mm[3];   /* lines end here, and the pick feed ends all */
    double window_max_mm[3];
    double soft_min_mm[3]; /* the axes' own limits */
    double soft_max_mm[3];
};

struct chip_tracer_in {
    int is_enabled;
    int wants_retract; /* leave the model and end */
    double feed_share; /* override of every movement, 0..1 */
    double period_s;
    double position_mm[3];   /* p */
    double deflection_mm[3]; /* e */
};

struct chip_tracer_out {
    int state_number; /* chip_tracer_state */
    int fault_number; /* chip_tracer_fault */
    int limit_number; /* chip_tracer_limit */
    int line_count;   /* lines or laps completed */
    double velocity_mm_s[3];
    double velocity_limit_mm_s; /* in force [5] */
    double gain_hz;             /* in force [5] */
    double deflection_mm;       /* eps */
    double error_mm;            /* eps - eps0 */
    double normal_vel_mm_s;     /* asked for along n */
    double tangential_vel_mm_s; /* asked for along t */
    double friction_share;      /* estimate [3] */
    double normal[3];           /* n, friction removed */
    double ball_mm[3];          /* c: the position of then and the deflection of now; 0 until there is one */
};

/* What a chord needs of one period [3]. */
struct chip_tracer_point {
    double ball_a_mm, ball_b_mm; /* c in the plane */
    double angle_rad;            /* of e in the plane */
    double share;                /* part of e in the plane / eps */
};

/* What is known of the surface in the trace plane. */
struct chip_tracer_law {
    double a[3], b[3]; /* the plane */
    double sense;      /* 1 or -1: t to the right or to the left of n */
    double friction_share;
    double heading_rad; /* of n, filtered [4] */
    double rate_rad_s;
    double turned_rad; /* heading's change since the plane was set */
    int periods;       /* since the plane was set, up to CHIP_TRACER_WINDOW */
    double since_s;    /* since the plane was set */
    int sliding;       /* periods for which the stylus has slid along the tangent [3] */
    int has_head;      /* head_mm and normal are known */
    double head_mm[3]; /* of the period before, when the deflection was measured */
    double normal[3];  /* of the period before */
    double drag[3];    /* force of friction over that of the spring: it lags behind the travel [3] */
    int newest;
    struct chip_tracer_point point[CHIP_TRACER_WINDOW];
};

/* What is known of the sensor [8]; [2]: in the air, in contact. */
struct chip_tracer_sensor {
    int run[3];        /* periods for which the reading has been the same, per axis */
    int longest[3];    /* longest of these, lately */
    int periods[3][2]; /* seen */
    int changes[3][2]; /* of them with another reading than the one before */
    int held_periods;  /* since any axis has changed */
    double held_mm[3]; /* the head then */
    int has_late;
    double late_mm[3];  /* of the period before */
    double moved_mm[3]; /* the head, between the last two readings */
    double off_mm;      /* the ball's path along the deflection */
    double path_mm;     /* the ball's path */
    double change_mm;   /* change of the deflection */
    double doubt_share; /* of what is a contradiction */
    int phase, level;   /* of the swing */
    int block_periods;
    double block_normal[3];
    double asked_mm[2], answer_mm[2]; /* parts in and out of phase: of the head along n, of the deflection */
    double noise_mm2;
    int newest;
    double eps_mm[CHIP_TRACER_RISES];
};

struct chip_tracer {
    struct chip_tracer_settings settings; /* the last sound ones */
    struct chip_tracer_law law;
    struct chip_tracer_sensor sensor;
    int state, fault, lines;
    int has_settings;
    int stored; /* positions kept, up to CHIP_TRACER_DELAY */
    int newest;
    double position_mm[CHIP_TRACER_DELAY][3];
    double deflection_mm[3]; /* of the period before */
    double velocity_mm_s[3]; /* given in the period before */
    double normal[3];        /* last known n */
    double from_mm[3];       /* where this state began */
    double line_mm;          /* of the trace plane, along its own normal */
    double pick_to_mm;       /* the pick feed's end */
    double highest_mm;       /* of the line, against the approach */
    double start_mm[3];      /* of a lap */
    double start_tangent[3];
    int has_left_start;
    int returns;      /* a line follows the retract */
    int lost_in_pick; /* contact was lost in PICK, not in TRACE */
    int periods_out;  /* periods without contact */
    double sense;     /* of the next line */
};

void chip_tracer_init(struct chip_tracer *tracer);

/* One period. */
void chip_tracer_step(struct chip_tracer *tracer, const struct chip_tracer_settings *settings,
                      const struct chip_tracer_in *in, struct chip_tracer_out *out);

#endif
