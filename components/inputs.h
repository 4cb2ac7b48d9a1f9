/* inputs.h - values of other components' HAL pins, without connecting them.
 *
 * Who calls it: chipwise_inputs.comp.
 * Source: LinuxCNC src/hal/hal_lib.c and hal_priv.h, read in 2.9.0~pre1, 2.9.9 and master (2026-08): a component keeps
 * a pointer to its pin's value in HAL's shared memory; connecting the pin makes HAL change that pointer.
 * halpr_find_pin_by_name() is exported by HAL; what it returns is described in hal_priv.h, which is not installed.
 *
 * Principle of operation:
 *  1. Two pins of our own are made, so the places of their pointers are known. The field of HAL's pin record
 *     that holds such a place (as an offset into the shared memory) is the one whose difference between the two records
 *     is the difference between the two places; it gives the start of the shared memory as well. No layout is assumed,
 *     and a LinuxCNC of another kind is refused.
 *  2. motion's pins are found by name once, while loading.
 *  3. In every period each pointer is read, then what it points to, exactly as motion itself writes it. In the
 *     period in which a pointer has changed (somebody connected the pin) motion may have written to the old place:
 *     the last value is kept.
 *  4. iocontrol is a process of its own and sees the shared memory at another address. While its pin is on no signal its
 *     pointer points into the pin's record, as far from its beginning as with our own pins: that gives the difference.
 *     Where the pin is on a signal already, that signal is the one to be read (`chipwise load` does it).
 */
#ifndef CHIPWISE_INPUTS_H
#define CHIPWISE_INPUTS_H

#include <stdint.h>
#include <math.h>
#include <hal.h>

extern void *halpr_find_pin_by_name(const char *name) __attribute__((weak));

enum cw_input_name {
    CW_POS_X, CW_POS_Y, CW_POS_Z, CW_OFFSET_X, CW_OFFSET_Y, CW_OFFSET_Z, CW_TO_GO, CW_REQUESTED_VEL,
    CW_CURRENT_VEL, CW_SPINDLE_SPEED, CW_MOTION_TYPE, CW_PROGRAM_LINE, CW_COORD_MODE, CW_INDEX_ENABLE,
    CW_TOOL_NUMBER, CW_POS_A, CW_POS_B, CW_POS_C, CW_POS_U, CW_POS_V, CW_POS_W,
    CW_ENABLED,
    CW_INPUTS
};

static const char *const cw_input_pins[CW_INPUTS] = {
    "axis.x.pos-cmd", "axis.y.pos-cmd", "axis.z.pos-cmd", "motion.tooloffset.x", "motion.tooloffset.y",
    "motion.tooloffset.z", "motion.distance-to-go", "motion.requested-vel", "motion.current-vel",
    "spindle.0.speed-out-rps", "motion.motion-type", "motion.program-line", "motion.coord-mode",
    "spindle.0.index-enable", "iocontrol.0.tool-number", "axis.a.pos-cmd", "axis.b.pos-cmd", "axis.c.pos-cmd", "axis.u.pos-cmd",
    "axis.v.pos-cmd", "axis.w.pos-cmd", "motion.motion-enabled"
};

_Static_assert(CW_INPUTS == 22, "the size of chipwise_inputs.comp's variable");

#define CW_TURN 1e-4                /* degrees or machine units an axis beside X Y Z may move and still count as at rest */
#define CW_HAL_BYTES (64L << 20)    /* no HAL has more shared memory */
#define CW_PIN_FIELDS 64            /* bytes of a pin record looked through */

typedef struct cw_input {
    void *const volatile *place;    /* of motion's pointer to its value; null: there is no such pin */
    const void *at;                 /* what it pointed to in the last period */
    long shift;                     /* [4] bytes from the address in its process to that in ours */
    union { double real; int32_t whole; unsigned char bit; } last;
    double remembered;              /* its value when the stock was defined */
} cw_input_t;

/* [1] Content of the field at `where` of a pin record, whose width is 4 or 8 bytes. */
static inline int64_t cw_pin_field(const char *record, int where, int width)
{
    int64_t wide;
    int32_t narrow;
    if (width == 8) memcpy(&wide, record + where, sizeof wide);
    else memcpy(&narrow, record + where, sizeof narrow), wide = narrow;
    return wide;
}

/* [1] Which field holds a pointer's place, and where the shared memory starts; 0: none fits. */
static inline int cw_pin_layout(const char *first, const char *second, char *const places[2],
                                int *where, int *width, char **base)
{
    for (*width = 8; *width >= 4; *width -= 4)
        for (*where = 0; *where + *width <= CW_PIN_FIELDS; *where += *width) {
            int64_t a = cw_pin_field(first, *where, *width), b = cw_pin_field(second, *where, *width);
            if (a <= 0 || b <= 0 || a > CW_HAL_BYTES || b > CW_HAL_BYTES) continue;
            if (b - a != places[1] - places[0]) continue;
            *base = places[0] - a;
            if (first < *base || first > *base + CW_HAL_BYTES) continue;
            return 1;
        }
    return 0;
}

/* [4] A pin of another process; without a place where the pin is on a signal already. */
static inline void cw_input_of_process(struct cw_input *input, const char *record, long within)
{
    input->shift = record + within - (const char *)input->at;
    if (input->shift % 4096 != 0) input->place = 0;
}

/* [1], [2] Finds everything; called while loading. -> 0, or a negative error number. */
static inline int cw_inputs_setup(struct cw_input *input, const char *prefix, int comp_id)
{
    /* apart by an odd number of pointers, so that no other field of the records differs by as much */
    hal_bit_t **own = hal_malloc(8 * sizeof *own);
    char name[2][HAL_NAME_LEN + 1];
    char *places[2], *base;
    const char *records[2];
    int where, width, i;

    if (!own || !halpr_find_pin_by_name) return -38;
    places[0] = (char *)&own[0];
    places[1] = (char *)&own[7];
    for (i = 0; i < 2; i++) {
        int code;
        rtapi_snprintf(name[i], sizeof name[i], "%s.own-%d", prefix, i);
        code = hal_pin_bit_new(name[i], HAL_OUT, &own[i * 7], comp_id);
        if (code < 0) return code;
        *own[i * 7] = 1;
        records[i] = halpr_find_pin_by_name(name[i]);
        if (!records[i]) return -38;
    }
    if (!cw_pin_layout(records[0], records[1], places, &where, &width, &base)) return -38;
    for (i = 0; i < CW_INPUTS; i++) {
        const char *record = halpr_find_pin_by_name(cw_input_pins[i]);
        int64_t offset = record ? cw_pin_field(record, where, width) : 0;
        input[i].place = 0;
        input[i].at = 0;
        input[i].last.real = 0.0;
        input[i].remembered = 0.0;
        if (i == CW_ENABLED) input[i].last.bit = 1;
        if (!record) continue;
        if (offset <= 0 || offset > CW_HAL_BYTES || offset % (int)sizeof(void *)) return -38;
        input[i].place = (void *const volatile *)(base + offset);
        if (!*input[i].place) return -38;
        input[i].at = *input[i].place;
        input[i].shift = 0;
        if (i == CW_TOOL_NUMBER) cw_input_of_process(&input[i], record, (char *)own[0] - records[0]);
    }
    return 0;
}

/* [3] One period's look at every pin. */
static inline void cw_inputs_read(struct cw_input *input)
{
    int i;
    for (i = 0; i < CW_INPUTS; i++) {
        const void *at = input[i].place ? *input[i].place : 0;
        if (!at) continue;
        if (at != input[i].at) {
            input[i].at = at;
            continue;
        }
        at = (const char *)at + input[i].shift;
        if (i == CW_MOTION_TYPE || i == CW_PROGRAM_LINE || i == CW_TOOL_NUMBER) input[i].last.whole = *(const volatile int32_t *)at;
        else if (i == CW_COORD_MODE || i == CW_INDEX_ENABLE || i == CW_ENABLED) input[i].last.bit = *(const volatile unsigned char *)at != 0;
        else input[i].last.real = *(const volatile double *)at;
    }
}

static inline double cw_input_float(const struct cw_input *input)
{
    return input->last.real;
}

static inline int32_t cw_input_s32(const struct cw_input *input)
{
    return input->last.whole;
}

static inline int cw_input_bit(const struct cw_input *input)
{
    return input->last.bit;
}

/* Whether an axis beside X Y Z has left the place it had when the stock was defined; remembers it while `defining`. */
static inline int cw_inputs_turned(struct cw_input *input, int defining, int turned)
{
    int i;
    for (i = CW_POS_A; i <= CW_POS_W; i++) {
        if (!input[i].place) continue;
        if (defining) input[i].remembered = input[i].last.real;
        else if (!(fabs(input[i].last.real - input[i].remembered) <= CW_TURN)) turned = 1;
    }
    return turned && !defining;
}

#endif
