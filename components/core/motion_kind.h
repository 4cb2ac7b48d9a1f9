/* SPDX-License-Identifier: GPL-2.0-or-later */
/* motion_kind.h - values of motion.motion-type, as in LinuxCNC's motion_types.h. */
#ifndef CHIPWISE_MOTION_KIND_H
#define CHIPWISE_MOTION_KIND_H

#define CHIP_MOTION_NONE 0
#define CHIP_MOTION_TRAVERSE 1
#define CHIP_MOTION_FEED 2
#define CHIP_MOTION_ARC 3
#define CHIP_MOTION_PROBING 5

#endif
