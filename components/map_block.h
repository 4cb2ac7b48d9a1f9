/* SPDX-License-Identifier: GPL-2.0-or-later */
/* map_block.h - the block of shared memory with the stock's map: what lies under its key, and whose it is. Not in realtime.
 *
 * Who calls it: stock_tracker.comp while the component is loaded.
 */
#ifndef CHIPWISE_MAP_BLOCK_H
#define CHIPWISE_MAP_BLOCK_H

#include <errno.h>
#include <stdint.h>
#include <sys/shm.h>
#include <unistd.h>
#include "linuxcnc_planner.h"

/* Removes the map a killed LinuxCNC has left under the key: it may be too small. A program that still has it attached
 * keeps it; the key is free. Returns 0, or -1 if the map belongs to another user or program. */
static int remove_stale(int key)
{
    struct shmid_ds about;
    int old = shmget(key, 0, 0);
    if (old < 0) return errno == ENOENT ? 0 : -1;
    if (shmctl(old, IPC_STAT, &about) < 0 || !chip_planner_ours(&about)) return -1;
    return shmctl(old, IPC_RMID, 0);
}

/* Whether this process has just made the block under the key, and nobody else has it attached. */
static int freshly_made(int key, uint64_t bytes)
{
    struct shmid_ds about;
    int id = shmget(key, 0, 0);
    return id >= 0 && shmctl(id, IPC_STAT, &about) == 0 && chip_planner_ours(&about) && about.shm_segsz == bytes
        && about.shm_nattch == 1 && about.shm_cpid == getpid();
}

#endif
