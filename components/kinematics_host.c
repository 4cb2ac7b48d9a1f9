// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A host for a kinematics module of LinuxCNC, without HAL and without realtime: build/libchipwise_kinematics.so.
 *
 * Opened by remap/chipwise/machine/kinematics.py in a process of its own, before the module (pumakins.so ..): the functions here are
 * those of HAL and RTAPI that the module calls.  So the module itself, the one that motion runs, computes joints offline.
 *
 *  1. A pin is memory of this process; its name is kept, so that a value can be given to it.
 *  2. chip_host_follow() does what motion does in each period (control.c, 2.9): inverse kinematics of the next pose with the flags of
 *     the joints before, then forward kinematics of the new joints, which gives the next flags.
 *
 * Read in LinuxCNC 2.9 and 2.10: hal.h, kinematics.h, switchkins.c, control.c.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MAX_PINS = 128, NAME_BYTES = 48, POSE = 9, JOINTS = 16 };

struct host_pin {
    char name[NAME_BYTES];
    char kind; // 'f' double, 'i' 32 bits, 'b' one byte
    void *value;
};

static struct host_pin pins[MAX_PINS];
static int pin_count;

// ---- what the module calls ----------------------------------------------------------------------------------------

int hal_init(const char *name)
{
    (void)name;
    return 1;
}

int hal_exit(int id)
{
    (void)id;
    return 0;
}

int hal_ready(int id)
{
    (void)id;
    return 0;
}

void *hal_malloc(long size) { return size > 0 ? calloc(1, (size_t)size) : NULL; }

void rtapi_print(const char *format, ...) { (void)format; }

void rtapi_print_msg(int level, const char *format, ...)
{
    (void)level;
    (void)format;
}

// A new pin: its memory is put into *at; -1 if there are too many.
static int new_pin(char kind, void **at, const char *format, va_list values)
{
    struct host_pin *pin = &pins[pin_count];
    if (pin_count >= MAX_PINS || !at) {
        return -1;
    }
    vsnprintf(pin->name, sizeof pin->name, format, values);
    pin->kind = kind;
    pin->value = calloc(1, sizeof(double));
    if (!pin->value) {
        return -1;
    }
    *at = pin->value;
    pin_count++;
    return 0;
}

// What the functions of both kinds do: int result is that of new_pin().
#define ADD_PIN(KIND)                                                                                                  \
    va_list values;                                                                                                    \
    int result;                                                                                                        \
    (void)direction;                                                                                                   \
    (void)id;                                                                                                          \
    va_start(values, format);                                                                                          \
    result = new_pin(KIND, at, format, values);                                                                        \
    va_end(values)

#define PIN_FUNCTIONS(TYPE, KIND)                                                                                      \
    int hal_pin_##TYPE##_newf(int direction, void **at, int id, const char *format, ...)                               \
    {                                                                                                                  \
        ADD_PIN(KIND);                                                                                                 \
        return result;                                                                                                 \
    }                                                                                                                  \
    int hal_pin_##TYPE##_new(const char *name, int direction, void **at, int id)                                       \
    {                                                                                                                  \
        return hal_pin_##TYPE##_newf(direction, at, id, "%s", name);                                                   \
    }

PIN_FUNCTIONS(float, 'f')
PIN_FUNCTIONS(s32, 'i')
PIN_FUNCTIONS(u32, 'i')
PIN_FUNCTIONS(bit, 'b')

// Those of LinuxCNC 2.10, with a value to begin with.
#define NEW_PIN_FUNCTION(NAME, TYPE, KIND)                                                                             \
    int hal_pin_new_##NAME(int id, int direction, void **at, TYPE initial, const char *format, ...)                    \
    {                                                                                                                  \
        ADD_PIN(KIND);                                                                                                 \
        if (result == 0) {                                                                                             \
            memcpy(*at, &initial, sizeof initial);                                                                     \
        }                                                                                                              \
        return result;                                                                                                 \
    }

NEW_PIN_FUNCTION(real, double, 'f')
NEW_PIN_FUNCTION(sint, long, 'i')
NEW_PIN_FUNCTION(uint, unsigned long, 'i')
NEW_PIN_FUNCTION(si32, int, 'i')
NEW_PIN_FUNCTION(ui32, unsigned, 'i')
NEW_PIN_FUNCTION(bool, _Bool, 'b')

// ---- what kinematics.py calls -------------------------------------------------------------------------------------

// Number of pins so far.
int chip_host_pins(void) { return pin_count; }

// Name of a pin, NULL if there is none; its kind goes to *kind.
const char *chip_host_pin(int number, char *kind)
{
    if (number < 0 || number >= pin_count) {
        return NULL;
    }
    *kind = pins[number].kind;
    return pins[number].name;
}

// Give a value to a pin of kind 'f'; -1 if there is none of that name.
int chip_host_set(const char *name, double value)
{
    int number;
    for (number = 0; number < pin_count; number++) {
        if (pins[number].kind == 'f' && strcmp(pins[number].name, name) == 0) {
            memcpy(pins[number].value, &value, sizeof value);
            return 0;
        }
    }
    return -1;
}

// Joints along poses (principle 2).  poses: count rows of X Y Z A B C U V W; joints: before the first, then after the last; found:
// count rows of JOINTS.  Returns how many poses were computed: count, or fewer where the module has refused one.
int chip_host_follow(int (*inverse)(const double *, double *, const unsigned long *, unsigned long *),
                     int (*forward)(const double *, double *, const unsigned long *, unsigned long *),
                     const double *poses, int count, double *joints, double *found)
{
    unsigned long solution = 0, reach = 0;
    double pose[POSE];
    int number;
    for (number = 0; number < count; number++) {
        memset(pose, 0, sizeof pose);
        if (forward(joints, pose, &reach, &solution) != 0) {
            return number;
        }
        if (inverse(poses + (size_t)number * POSE, joints, &solution, &reach) != 0) {
            return number;
        }
        memcpy(found + (size_t)number * JOINTS, joints, JOINTS * sizeof *joints);
    }
    return count;
}
