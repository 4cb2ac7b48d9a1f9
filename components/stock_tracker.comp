component stock_tracker "Follow the tool, keep a model of the stock and tell the load to come";
description """
Keeps a height map of the stock in shared memory of its own, cuts it along the way the
machine goes, and gives the section area: the volume of stock met per millimetre of travel,
at the tool and on the way it is about to go. The removal rate is the section area times the
velocity; volumetric_feed(9) turns that into a feed override.

.B loadrt stock_tracker cell=0.25 size_x=300 size_y=200

.B cell
is the side of a map cell in mm (default 0.25),
.B size_x, size_y
the largest stock in mm (default 300 by 200). The map needs 8 bytes a cell. With count=N there
are N trackers with a map each.

Positions, tool sizes and the stock box are in machine units; volumes and areas in mm.

Add the function to the servo thread after motion-controller.
""";

pin in float pos_x "X position command, machine units (axis.x.pos-cmd)";
pin in float pos_y "Y position command, machine units (axis.y.pos-cmd)";
pin in float pos_z "Z position command, machine units (axis.z.pos-cmd)";
pin in float tool_offset_x "tool offset X, machine units (motion.tooloffset.x)";
pin in float tool_offset_y "tool offset Y, machine units (motion.tooloffset.y)";
pin in float tool_offset_z "tool offset Z, machine units (motion.tooloffset.z)";
pin in s32 motion_type "motion.motion-type";
pin in bit enable "while FALSE nothing is cut and the position is only followed (motion.coord-mode)";
pin in float tool_diameter "machine units; not positive: no tool";
pin in float tool_corner_radius "machine units";
pin in float tool_tip_angle "included angle of the tip, degrees; 0: flat end";
pin in float tool_flute_length "machine units; 0: unknown";
pin in float min_x "stock box, machine coordinates, machine units";
pin in float min_y "stock box, machine coordinates, machine units";
pin in float min_z "stock box, machine coordinates, machine units";
pin in float max_x "stock box, machine coordinates, machine units";
pin in float max_y "stock box, machine coordinates, machine units";
pin in float max_z "stock box, machine coordinates, machine units";
pin in s32 shape "of the stock in that box: 0 all of it, 1 the cylinder along Z inscribed in it";
pin in float turn "degrees, counter-clockwise, by which the box min..max is turned about its middle in XY; not for a cylinder";
pin in bit define "rising edge: fill the map with the box; ready is FALSE until that is done";
pin in bit hold "TRUE: another program has the map and writes a stock into it (chipwise monitor)";
pin in s32 tool_in_spindle "number of the tool by the machine itself (iocontrol.0.tool-number); unconnected: not compared";
pin in s32 tool_followed "the same as chipwise-monitor has last seen and described it (chipwise-monitor.tool-followed)";
pin in s32 heartbeat "counts while chipwise-monitor runs (chipwise-monitor.heartbeat)";
pin in float distance_to_go "motion.distance-to-go, machine units; not positive: unknown";
pin in bit turned "an axis beside X Y Z has moved since the stock was defined (chipwise-inputs.0.turned): no stock is known";

pin out bit stock_defined "the map is filled with a stock";
pin out bit ready "stock, tool and position are known";
pin out bit fault "something is wrong, see fault-code";
pin out s32 fault_code "0 none; stock box: 1 not finite, 2 empty, 3 larger than the map, 4 a map was not written to its end, or the machine went on meanwhile; tool: 11 diameter, 12 corner radius, 13 tip angle, 14 flute length; 15 the tool in the spindle is not the one that chipwise-monitor has described, 16 chipwise-monitor does not answer; 20 position not finite, 21 position jumps, 22 units-per-mm, 23 turned";
pin out float removed_volume "mm3 cut since define; of a restored stock since it was defined";
pin out bit held "the map is not touched: answer to hold";
pin out float mrr "removal rate, mm3/min, averaged over mrr-window";
pin out float section_area "mm2: volume met per mm of travel, at the tool, now";
pin out float depth "machine units: deepest stock above the tool's edge within its footprint";
pin out float direction_z "vertical part of the direction of travel, -1 (plunge) to 1";
pin out bit flute_excess "the tool cuts stock higher than its flutes";
pin out bit rapid_contact "a traverse meets stock, or will within its braking distance";
pin out float rapid_distance "machine units to the stock a traverse is about to meet; 0: none seen";
pin out bit path_known "the way ahead is the program's own, read from the motion planner; FALSE: it is predicted";
pin out float ahead_distance_#[8] "machine units of travel until ahead-area-N applies; number 0: now";
pin out float ahead_area_#[8] "mm2, never too low; rises with N; 0: unused";
pin out float ahead_accel_#[8] "machine units/s2 the planner can brake with until there, in the mean; 0: not known";

param rw float units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw float mrr_window = 0.02 "s, at most 1023 periods";
param rw float acceleration = 0.0 "machine units/s2 the planner really uses; 0: unknown, look 20 mm ahead";
param rw float max_jerk = 0.0 "machine units/s3, of a planner that bounds the jerk ([TRAJ]PLANNER_TYPE = 1); 0: it does not";
param rw bit read_path = 1 "read the program's way ahead from the motion planner; FALSE: always predict it";
param rw float acceleration_x = 0.0 "machine units/s2 of the axis, for the traverses' braking; 0: unknown, as acceleration";
param rw float acceleration_y = 0.0 "machine units/s2";
param rw float acceleration_z = 0.0 "machine units/s2";
param rw float monitor_timeout = 0.0 "s without a heartbeat until fault 16; 0: the heartbeat is not watched";
param r s32 shm_key "key of the shared memory that holds the map";

variable cw_tracker_t state;
variable cw_planner_t planner;
variable chip_tool_watch_t watch;
variable int said_unwatched;
variable void *map;
variable int map_id;

option extra_setup yes;
option extra_cleanup yes;
function _ fp;
license "GPL";
author "chipwise";
see_also "volumetric_feed(9), chipwise_command(9)";
include "core/stock_tracker_core.h";
;;

#include <errno.h>
#include <rtapi_string.h>

/* Module parameters: HAL has no float parameters, so lengths come as text. */
static char *cell = "0.25";
RTAPI_MP_STRING(cell, "side of a map cell, mm");
static char *size_x = "300";
RTAPI_MP_STRING(size_x, "largest stock in X, mm");
static char *size_y = "200";
RTAPI_MP_STRING(size_y, "largest stock in Y, mm");

/* Gives up the map a killed LinuxCNC has left under the key: it may be too small. A program that still has it attached
 * keeps what it has; the key is free. Returns 0, or -1 where it is somebody else's. */
static int remove_stale(int key)
{
    struct shmid_ds about;
    int old = shmget(key, 0, 0);
    if (old < 0) return errno == ENOENT ? 0 : -1;
    if (shmctl(old, IPC_STAT, &about) < 0 || !cw_planner_ours(&about)) return -1;
    return shmctl(old, IPC_RMID, 0);
}

/* Whether the block under the key is the one this process has just made, and has it for itself. */
static int freshly_made(int key, uint64_t bytes)
{
    struct shmid_ds about;
    int id = shmget(key, 0, 0);
    return id >= 0 && shmctl(id, IPC_STAT, &about) == 0 && cw_planner_ours(&about) && about.shm_segsz == bytes
        && about.shm_nattch == 1 && about.shm_cpid == getpid();
}

static int refuse_foreign(int key)
{
    rtapi_print_msg(RTAPI_MSG_ERR,
        "chipwise: stock_tracker: the shared memory with the key 0x%x is another user's or another program's; end that "
        "program, or remove it with `ipcrm -M 0x%x`\n", key, key);
    return -13;
}

/* Makes the map of one instance: shared memory, so that other programs can read it. Variables are
 * zero here; halcompile gives them initial values only after this, so map_id has none. */
EXTRA_SETUP() {
    double side = cw_decimal(cell), x = cw_decimal(size_x), y = cw_decimal(size_y);
    uint32_t cells = cw_stock_cells(side, x, y);
    uint64_t bytes = cw_stock_bytes(cells);

    if (!cells) {
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: stock_tracker: no map with cell=%s size_x=%s size_y=%s mm: each must be a "
            "number > 0, the cell 0.001 to 100 mm, and the map have at most 268435456 cells; use a larger cell or a smaller "
            "size\n", cell, size_x, size_y);
        return -22;
    }
    shm_key = CW_STOCK_MAGIC + extra_arg;
    if (remove_stale(shm_key) < 0) return refuse_foreign(shm_key);
    map_id = rtapi_shmem_new(shm_key, comp_id, bytes);
    if (map_id >= 0 && !freshly_made(shm_key, bytes)) {
        rtapi_shmem_delete(map_id, comp_id);
        return refuse_foreign(shm_key);
    }
    if (map_id < 0 || rtapi_shmem_getptr(map_id, &map) < 0) {
        if (map_id >= 0) rtapi_shmem_delete(map_id, comp_id);
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: stock_tracker: no memory for a map of %llu bytes (cell=%s size_x=%s size_y=%s "
            "mm); use a larger cell or a smaller size, or end the program that still has an old map\n",
            (unsigned long long)bytes, cell, size_x, size_y);
        return -12;
    }
    memset(map, 0, bytes);      /* touches every page now, not in the servo thread */
    cw_stock_init(map, side, cells);
    cw_tracker_init(&state);
    chip_tracker_own_map(&state, map);
    cw_planner_attach(&planner);
    return 0;
}

/* The function may still run in a thread: it loses the map, gets a millisecond to end, then the
 * map goes. __comp_inst is the name the pin and variable macros look through. */
EXTRA_CLEANUP() {
    struct __comp_state *__comp_inst;
    int i;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) map = 0;
    for (i = 0; i < 100; i++) rtapi_delay(10000);
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next)
        rtapi_shmem_delete(map_id, comp_id);
}

/* Whether the tool is still the one that was described. A monitor that is dead cannot say so itself: the operator is
 * told from here (motion hands error messages of realtime on to the user interface). */
static void watch_tool(struct __comp_state *__comp_inst, long period, struct cw_tracker_in *in)
{
    struct chip_tool_watch_in seen;
    seen.machine_tool = tool_in_spindle;
    seen.followed_tool = tool_followed;
    seen.beats = heartbeat;
    seen.limit_s = monitor_timeout;
    seen.period_s = fperiod;
    chip_tool_watch_step(&watch, &seen);
    in->tool_unknown = watch.is_unknown;
    in->watch_fault = watch.code;
    if (watch.code != CHIP_TOOL_UNWATCHED) said_unwatched = 0;
    else if (!said_unwatched) {
        said_unwatched = 1;
        rtapi_print_msg(RTAPI_MSG_ERR, "chipwise: chipwise-monitor does not answer: changes of the tool are not "
            "seen, the volumetric feed leaves F as programmed; start `chipwise monitor` in a shell\n");
    }
}

FUNCTION(_) {
    struct cw_stock *stock = map;
    struct cw_tracker_in in;
    struct cw_tracker_out out;
    double scale;               /* of lengths that go out */
    int i;

    if (!stock) return;
    in.axis[0] = pos_x; in.axis[1] = pos_y; in.axis[2] = pos_z;
    in.offset[0] = tool_offset_x; in.offset[1] = tool_offset_y; in.offset[2] = tool_offset_z;
    in.unit = units_per_mm;
    in.motion = motion_type;
    in.cutting = enable;
    in.other_moved = turned;
    in.tool_size[0] = tool_diameter; in.tool_size[1] = tool_corner_radius;
    in.tool_size[2] = tool_tip_angle; in.tool_size[3] = tool_flute_length;
    in.box_min[0] = min_x; in.box_min[1] = min_y; in.box_min[2] = min_z;
    in.box_max[0] = max_x; in.box_max[1] = max_y; in.box_max[2] = max_z;
    in.form = shape;
    in.box_turn = turn;
    in.request = define;
    in.foreign = hold;
    in.to_go = distance_to_go;
    watch_tool(__comp_inst, period, &in);
    in.accel = acceleration;
    in.axis_accel[0] = acceleration_x;
    in.axis_accel[1] = acceleration_y;
    in.axis_accel[2] = acceleration_z;
    in.jerk = max_jerk;
    in.window = mrr_window;
    in.period = fperiod;

    if (cw_tracker_offset_changed(&state, &in)) cw_way_reset(&state.ahead.way);
    if (read_path)
        cw_planner_follow(&planner, &in, cw_tracker_horizon(&state, stock, &in), &state.ahead.way);
    else
        cw_way_reset(&state.ahead.way);
    cw_tracker_step(&state, stock, &in, &out);
    scale = units_per_mm >= CHIP_LEAST_UNIT && units_per_mm <= CHIP_MOST_UNIT ? units_per_mm : 0.0;

    stock_defined = out.has_stock;
    ready = out.is_ready;
    fault = out.has_fault;
    fault_code = out.code;
    removed_volume = out.removed_mm3;
    mrr = out.rate;
    section_area = out.here;
    depth = out.deepest * scale;
    direction_z = out.upward;
    flute_excess = out.over_flute;
    rapid_contact = out.rapid_hit;
    path_known = state.ahead.on_way;
    rapid_distance = out.rapid_mm * scale;
    held = out.is_held;
    for (i = 0; i < CW_AHEAD_LEVELS; i++) {
        ahead_distance(i) = i < out.view.levels ? out.view.level[i].distance * scale : 0.0;
        ahead_area(i) = i < out.view.levels ? out.view.level[i].area : 0.0;
        ahead_accel(i) = i < out.view.levels ? out.view.level[i].accel * scale : 0.0;
    }
}
