/* SPDX-License-Identifier: GPL-2.0-or-later */
/* linuxcnc_block.h - motion's block of shared memory: whose it is, and where the queue lies. Not in realtime.
 *
 * Who calls it: linuxcnc_planner.c while the component is loaded.
 * Source: as linuxcnc_planner.h says; the numbers in brackets are those there.
 */
#ifndef CHIPWISE_LINUXCNC_BLOCK_H
#define CHIPWISE_LINUXCNC_BLOCK_H

#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/shm.h>
#include <unistd.h>

/* [4] Whether a user is root or one of those this process is or has been. */
static int is_us(uid_t user)
{
    uid_t real, effective, saved;
    if (getresuid(&real, &effective, &saved) < 0) return 0;
    return user == real || user == effective || user == saved || user == 0;
}

/* [1] Whether this process has mapped a block for writing, as motion in the same process has. Reads the rights and the
 * inode, which is the block's number, from /proc/self/maps. */
static int is_mapped(int id)
{
    char line[512], rights[8];
    unsigned long inode;
    int found = 0;
    FILE *maps = fopen("/proc/self/maps", "r");
    if (!maps) return 0;
    while (!found && fgets(line, sizeof line, maps))
        found = sscanf(line, "%*s %7s %*s %*s %lu", rights, &inode) == 2 && inode == (unsigned long)id
             && strstr(line, "/SYSV") && rights[1] == 'w';
    fclose(maps);
    return found;
}

#define CHIP_PLANNER_REGION (1ul << 30) /* bytes: larger regions are address space that somebody has only reserved */

/* [6] Whether all of a piece of memory may be read and written by this process. */
static int is_in_memory(const void *begin, size_t bytes)
{
    char line[512], rights[8];
    unsigned long low, high, next = (unsigned long)(uintptr_t)begin, end = next + bytes;
    FILE *maps;
    if (!next || end < next) return 0;
    maps = fopen("/proc/self/maps", "r");
    if (!maps) return 0;
    while (next < end && fgets(line, sizeof line, maps)) /* in the order of the addresses */
        if (sscanf(line, "%lx-%lx %7s", &low, &high, rights) == 3 && low <= next && next < high && rights[0] == 'r'
            && rights[1] == 'w' && high - low <= CHIP_PLANNER_REGION)
            next = high;
    fclose(maps);
    return next >= end;
}

#endif
