/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A block of shared memory at motion's key that is not motion's: what the stock tracker finds where LinuxCNC was killed, or where
 * another program uses the key.
 *
 *     foreign_motion FILL [stay]
 *
 * fills the block as FILL says: `plausible` as a planner at machine zero with five pieces in a queue at an address that is not
 * mapped, `running` the same and its counts go on, `noise` with pseudo-random bytes that change, `open` as plausible but
 * writable by everybody. With `stay` it stays attached; it says "ready" in any case.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/shm.h>
#include <unistd.h>
#include <motion.h>
#include <motion_types.h>
#include <tc_types.h>
#include <tcq.h>

#define KEY 100

int main(int count, char **words)
{
    size_t bytes = sizeof(struct emcmot_internal_t) + 200000, i;
    int open = !strcmp(words[1], "open"), noise = !strcmp(words[1], "noise"), running = !strcmp(words[1], "running");
    int id = shmget(KEY, bytes, IPC_CREAT | (open ? 0666 : 0600));
    char *block = id < 0 ? (char *)-1 : shmat(id, 0, 0);
    struct emcmot_internal_t *motion;
    if (block == (char *)-1) return 1;
    motion = (struct emcmot_internal_t *)(block + bytes - sizeof *motion);
    memset(block, 0, bytes);
    motion->head = motion->tail = 7;
    motion->coord_tp.queue.size = DEFAULT_TC_QUEUE_SIZE;
    motion->coord_tp.queue.queue = (TC_STRUCT *)0x123456789000;
    motion->coord_tp.queue._len = 5;
    motion->coord_tp.cycleTime = 0.001;
    if (noise) for (i = 0; i < bytes; i++) block[i] = rand();
    printf("ready\n");
    fflush(stdout);
    if (count < 3) return 0;
    for (;;) {
        if (running) for (i = 0; i < bytes - sizeof *motion; i += 4) ++*(unsigned *)(block + i);
        if (noise) for (i = bytes - sizeof *motion; i < bytes; i++) block[i] = rand();
        usleep(100);
    }
}
