/* SPDX-License-Identifier: GPL-2.0-or-later */
/* inputs.h - values of other components' HAL pins, without connecting them.
 *
 * Who calls it: chipwise_inputs.comp.
 * Source: LinuxCNC src/hal/hal_lib.c and hal_priv.h, read in 2.9.0~pre1, 2.9.9 and master (2026-08): a component keeps
 * a pointer to its pin's value in HAL's shared memory; connecting the pin makes HAL change that pointer.
 * halpr_find_pin_by_name() is exported by HAL; what it returns is described in hal_priv.h, which is not installed.
 *
 * Principle of operation:
 *  1. Two pins of our own are made, so the addresses of their pointers are known. The field of HAL's pin record
 *     that holds such an address (as an offset into the shared memory) is the one whose difference between the two
 *     records is the difference between the two addresses; it gives the start of the shared memory as well. No layout
 *     is assumed,
 *     and a LinuxCNC that stores pins differently is refused.
 *  2. Motion's pins are found by name once, while loading.
 *  3. In every period each pointer is read, then what it points to, exactly as motion itself writes it. In the
 *     period in which a pointer has changed (somebody connected the pin) motion may have written to the old address:
 *     the last value is kept.
 *  4. iocontrol is a process of its own and sees the shared memory at another address. While its pin is on no signal
 *     its pointer points into the pin's record, as far from its beginning as with our own pins: that gives the
 *     difference.
 *     If the pin is on a signal already, that signal has to be read instead (`chipwise load` connects it).
 */
#ifndef CHIPWISE_INPUTS_H
#define CHIPWISE_INPUTS_H

#include <stdint.h>
#include <math.h>
#include <hal.h>

extern void *halpr_find_pin_by_name(const char *name) __attribute__((weak));

enum chip_input_name {
    CHIP_POS_X,
    CHIP_POS_Y,
    CHIP_POS_Z,
    CHIP_OFFSET_X,
    CHIP_OFFSET_Y,
    CHIP_OFFSET_Z,
    CHIP_TO_GO,
    CHIP_REQUESTED_VEL,
    CHIP_CURRENT_VEL,
    CHIP_SPINDLE_SPEED,
    CHIP_MOTION_TYPE,
    CHIP_PROGRAM_LINE,
    CHIP_COORD_MODE,
    CHIP_INDEX_ENABLE,
    CHIP_TOOL_NUMBER,
    CHIP_POS_A,
    CHIP_POS_B,
    CHIP_POS_C,
    CHIP_POS_U,
    CHIP_POS_V,
    CHIP_POS_W,
    CHIP_ENABLED,
    CHIP_INPUTS
};

static const char *const chip_input_pins[CHIP_INPUTS] = {
    "axis.x.pos-cmd",      "axis.y.pos-cmd",          "axis.z.pos-cmd",          "motion.tooloffset.x",
    "motion.tooloffset.y", "motion.tooloffset.z",     "motion.distance-to-go",   "motion.requested-vel",
    "motion.current-vel",  "spindle.0.speed-out-rps", "motion.motion-type",      "motion.program-line",
    "motion.coord-mode",   "spindle.0.index-enable",  "iocontrol.0.tool-number", "axis.a.pos-cmd",
    "axis.b.pos-cmd",      "axis.c.pos-cmd",          "axis.u.pos-cmd",          "axis.v.pos-cmd",
    "axis.w.pos-cmd",      "motion.motion-enabled"
};

_Static_assert(CHIP_INPUTS == 22, "the size of chipwise_inputs.comp's variable");

/* degrees or machine units an axis other than X Y Z may move and still count as at rest */
#define CHIP_TURN 1e-4
#define CHIP_HAL_BYTES (64L << 20) /* no HAL has more shared memory */
#define CHIP_PIN_FIELDS 64         /* bytes of a pin record looked through */

typedef struct chip_input {
    void *const volatile *address; /* address of motion's pointer to its value; null: there is no such pin */
    const void *at;                /* where it pointed in the last period */
    long shift;                    /* [4] bytes from the address in its process to that in ours */
    union {
        double real;
        int32_t whole;
        unsigned char bit;
    } last;
    double remembered; /* its value when the stock was defined */
} chip_input_t;

/* [1] Content of the field at `where` of a pin record, whose width is 4 or 8 bytes. */
static inline int64_t chip_pin_field(const char *record, int where, int width)
{
    int64_t wide;
    int32_t narrow;
    if (width == 8)
        memcpy(&wide, record + where, sizeof wide);
    else
        memcpy(&narrow, record + where, sizeof narrow), wide = narrow;
    return wide;
}

/* [1] Finds the field that holds a pointer's address, and the start of the shared memory; 0: none fits. */
static inline int chip_pin_layout(const char *first, const char *second, char *const addresses[2], int *where,
                                  int *width, char **base)
{
    for (*width = 8; *width >= 4; *width -= 4)
        for (*where = 0; *where + *width <= CHIP_PIN_FIELDS; *where += *width) {
            int64_t a = chip_pin_field(first, *where, *width), b = chip_pin_field(second, *where, *width);
            if (a <= 0 || b <= 0 || a > CHIP_HAL_BYTES || b > CHIP_HAL_BYTES) continue;
            if (b - a != addresses[1] - addresses[0]) continue;
            *base = addresses[0] - a;
            if (first < *base || first > *base + CHIP_HAL_BYTES) continue;
            return 1;
        }
    return 0;
}

/* [4] A pin of another process; `address` is null if the pin is on a signal already. */
static inline void chip_input_of_process(struct chip_input *input, const char *record, long within)
{
    input->shift = record + within - (const char *)input->at;
    if (input->shift % 4096 != 0) input->address = 0;
}

/* [1] Makes a pin of our own, which is TRUE. */
#ifdef HAL_API_VERSION /* HAL of LinuxCNC 2.10 (hal.h) */
typedef hal_bool_t chip_own_pin_t;

static inline int chip_own_pin(const char *name, chip_own_pin_t *pin, int comp_id)
{
    return hal_pin_new_bool(comp_id, HAL_OUT, pin, 1, "%s", name);
}
#else
typedef hal_bit_t *chip_own_pin_t;

static inline int chip_own_pin(const char *name, chip_own_pin_t *pin, int comp_id)
{
    int code = hal_pin_bit_new(name, HAL_OUT, pin, comp_id);
    if (code == 0) **pin = 1;
    return code;
}
#endif

/* [1], [2] Finds everything; called while loading. -> 0, or a negative error number. */
static inline int chip_inputs_setup(struct chip_input *input, const char *prefix, int comp_id)
{
    /* apart by an odd number of pointers, so that no other field of the records differs by as much */
    chip_own_pin_t *own = hal_malloc(8 * sizeof *own);
    char name[HAL_NAME_LEN + 1];
    char *addresses[2], *base;
    const char *records[2];
    int where, width, i;

    if (!own || !halpr_find_pin_by_name) return -38;
    addresses[0] = (char *)&own[0];
    addresses[1] = (char *)&own[7];
    for (i = 0; i < 2; i++) {
        int code;
        rtapi_snprintf(name, sizeof name, "%s.own-%d", prefix, i);
        code = chip_own_pin(name, &own[i * 7], comp_id);
        if (code < 0) return code;
        records[i] = halpr_find_pin_by_name(name);
        if (!records[i]) return -38;
    }
    if (!chip_pin_layout(records[0], records[1], addresses, &where, &width, &base)) return -38;
    for (i = 0; i < CHIP_INPUTS; i++) {
        const char *record = halpr_find_pin_by_name(chip_input_pins[i]);
        int64_t offset = record ? chip_pin_field(record, where, width) : 0;
        input[i].address = 0;
        input[i].at = 0;
        input[i].last.real = 0.0;
        input[i].remembered = 0.0;
        if (i == CHIP_ENABLED) input[i].last.bit = 1;
        if (!record) continue;
        if (offset <= 0 || offset > CHIP_HAL_BYTES || offset % (int)sizeof(void *)) return -38;
        input[i].address = (void *const volatile *)(base + offset);
        if (!*input[i].address) return -38;
        input[i].at = *input[i].address;
        input[i].shift = 0;
        if (i == CHIP_TOOL_NUMBER) chip_input_of_process(&input[i], record, (char *)own[0] - records[0]);
    }
    return 0;
}

/* [3] Reads every pin, once per period. */
static inline void chip_inputs_read(struct chip_input *input)
{
    int i;
    for (i = 0; i < CHIP_INPUTS; i++) {
        const void *at = input[i].address ? *input[i].address : 0;
        if (!at) continue;
        if (at != input[i].at) {
            input[i].at = at;
            continue;
        }
        at = (const char *)at + input[i].shift;
        if (i == CHIP_MOTION_TYPE || i == CHIP_PROGRAM_LINE || i == CHIP_TOOL_NUMBER)
            input[i].last.whole = *(const volatile int32_t *)at;
        else if (i == CHIP_COORD_MODE || i == CHIP_INDEX_ENABLE || i == CHIP_ENABLED)
            input[i].last.bit = *(const volatile unsigned char *)at != 0;
        else
            input[i].last.real = *(const volatile double *)at;
    }
}

static inline double chip_input_float(const struct chip_input *input) { return input->last.real; }

static inline int32_t chip_input_s32(const struct chip_input *input) { return input->last.whole; }

static inline int chip_input_bit(const struct chip_input *input) { return input->last.bit; }

/* Whether an axis other than X Y Z has left its position since the stock was defined; notes the position while
 * `defining`. */
static inline int chip_inputs_turned(struct chip_input *input, int defining, int turned)
{
    int i;
    for (i = CHIP_POS_A; i <= CHIP_POS_W; i++) {
        if (!input[i].address) continue;
        if (defining)
            input[i].remembered = input[i].last.real;
        else if (!(fabs(input[i].last.real - input[i].remembered) <= CHIP_TURN))
            turned = 1;
    }
    return turned && !defining;
}

#endif
