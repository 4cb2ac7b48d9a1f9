// SPDX-License-Identifier: GPL-2.0-or-later
component stock_tracker "Follow the tool, keep a model of the stock and report the load to come";
description """
Keeps a height map of the stock in shared memory of its own, cuts it along the path of the
tool, and reports the section area: the volume of stock met per millimetre of travel,
at the tool and along the path ahead. The removal rate is the section area times the
velocity; volumetric_feed(9) turns that into a feed override.

.B loadrt stock_tracker cell=0.25 size_x=300 size_y=200

.B cell
is the side of a map cell in mm (default 0.25),
.B finest_cell
its side at least where the stock is smaller than the map: the cells get as small as the memory allows (default: all cells have the side
.BR cell ),
.B size_x, size_y
the largest stock in mm (default 300 by 200). The map needs 8 bytes a cell. With count=N there
are N trackers with a map each.
.B work
is the part of a period's work that is done, 10 to 100 per cent (default 100): less for a slow computer, where the map lags more often.

All lengths on pins, distances and accelerations included, are in machine units; volumes are in mm3, areas in mm2.

Add the function to the servo thread after motion-controller.
""";

pin in real pos_x "X position command, machine units (axis.x.pos-cmd)";
pin in real pos_y "Y position command, machine units (axis.y.pos-cmd)";
pin in real pos_z "Z position command, machine units (axis.z.pos-cmd)";
pin in real tool_offset_x "tool offset X, machine units (motion.tooloffset.x)";
pin in real tool_offset_y "tool offset Y, machine units (motion.tooloffset.y)";
pin in real tool_offset_z "tool offset Z, machine units (motion.tooloffset.z)";
pin in si32 motion_type "motion.motion-type";
pin in bool enable "motion.coord-mode; while FALSE the tracker follows the position and cuts nothing";
pin in real tool_diameter "machine units; 0 or negative: no tool";
pin in real tool_corner_radius "machine units";
pin in real tool_tip_angle "included angle of the tip, degrees; 0: flat end";
pin in real tool_flute_length "machine units; 0: unknown";
pin in real current_vel "motion.current-vel (chipwise-inputs.0.current-vel), machine units/s; 0: unknown";
pin in real tool_stick_out "from the tip to the holder, machine units (chipwise-monitor.tool-stick-out)";
pin in real tool_holder_diameter "machine units; 0: unknown, the holder is kept from no clamp (chipwise-monitor.tool-holder-diameter)";
pin in real min_x "stock box, machine coordinates, machine units";
pin in real min_y "stock box, machine coordinates, machine units";
pin in real min_z "stock box, machine coordinates, machine units";
pin in real max_x "stock box, machine coordinates, machine units";
pin in real max_y "stock box, machine coordinates, machine units";
pin in real max_z "stock box, machine coordinates, machine units";
pin in si32 shape "shape of the stock: 0 the box, 1 the cylinder along Z inscribed in it";
pin in real turn "angle in degrees, counter-clockwise, by which the box is turned about its middle in XY; a cylinder is not turned";
pin in bool define "rising edge: fill the map with the box; ready is FALSE until the map is filled";
pin in bool hold "TRUE while another program (chipwise monitor) writes a stock into the map";
pin in bool assumed "TRUE with hold: the stock that is written is assumed, and nothing may act on it (chipwise-monitor.assumed); refused while a certain stock is defined";
pin in bool tool_assumed "the tool is described as a program's comments say (chipwise-monitor.tool-assumed): unknown in a certain stock";
pin in si32 tool_in_spindle "number of the tool in the spindle (iocontrol.0.tool-number); unconnected: not compared";
pin in si32 tool_followed "number of the tool that chipwise-monitor has described last (chipwise-monitor.tool-followed)";
pin in si32 heartbeat "counts while chipwise-monitor runs (chipwise-monitor.heartbeat)";
pin in real distance_to_go "motion.distance-to-go, machine units; 0 or negative: unknown";
pin in bool feed_decided "TRUE for a period when M251 or M252 takes effect, a program starts or is aborted, or the machine goes off (chipwise-command.0.feed-decided)";
pin in bool turned "an axis other than X Y Z has moved since the stock was defined (chipwise-inputs.0.turned): the stock is unknown";

pin in bool air "feeds above the stock are as fast as the axes (chipwise-command.0.air), so pace-.. are wanted";
pin in real ceiling = 1.0 "times F that another feed may be fast then (chipwise-monitor.job-ceiling)";
pin in real programmed_vel "F of the program, machine units/s (motion.analog-out of feed-output)";
pin in real feed_override = 1.0 "the operator's feed override in effect (chipwise-monitor.feed-override)";

pin out bool stock_defined "the map holds a stock";
pin out bool certain "a program or a person has confirmed the stock (M250, M254); FALSE: none is defined, or it is assumed, and neither guards nor feed act on it";
pin out bool ready "stock, tool and position are known";
pin out bool fault "a fault is present, see fault-code";
pin out si32 fault_code "0 none; stock box: 1 not finite, 2 empty, 3 larger than the map, 4 the map is incomplete or another program wrote into it; tool: 11 diameter, 12 corner radius, 13 tip angle, 14 flute length; 15 chipwise-monitor has not described the tool in the spindle, 16 chipwise-monitor does not answer; 20 position not finite, 21 position jumps, 22 units-per-mm, 23 turned";
pin out real removed_volume "mm3 cut since define; for a restored stock, since it was defined first";
pin out bool held "answer to hold: the tracker does not touch the map";
pin out real mrr "removal rate, mm3/min, averaged over mrr-window";
pin out real section_area "mm2: volume met per mm of travel, at the tool now";
pin out real depth "machine units: deepest stock above the tool's edge within its footprint";
pin out real buried_depth "machine units: how deep the tool was in the stock where another tool offset or shape has placed it, until it moves at feed; 0: it was not, or the stock is not certain";
pin out real direction_z "vertical part of the unit direction of travel, -1 (plunge) to 1";
pin out real descent_distance = -1.0 "travel until a feed goes down, machine units; -1: none in sight, or the tool stops before; to volumetric-feed.N.descent-distance";
pin out real descent_accel "mean acceleration the planner may brake with until there, machine units/s2; 0: unknown";
pin out real pace_distance = -2.0 "travel until pace-vel applies, machine units; -1: nowhere in sight, or the tool stops before; -2: unknown, or air is FALSE; to volumetric-feed.N.pace-distance";
pin out real pace_vel "largest velocity of the program there, machine units/s: below air-clearance F down, ceiling times F otherwise";
pin out real pace_accel "mean acceleration the planner may brake with until there, machine units/s2; 0: unknown";
pin out bool flute_excess "the depth exceeds the flute length while cutting";
pin out bool tool_awaited "tool-in-spindle is not tool-followed yet, and chipwise-monitor may still describe it (until monitor-timeout); to chipwise-guard.N.tool-awaited";
pin out bool rapid_contact "a traverse meets stock, or will meet it within its braking distance";
pin out real rapid_distance "machine units to the stock a traverse is about to meet; 0: none seen";
pin out bool aborted "motion got the command to abort (Stop, E-stop, error of a program) since the last period";
pin out bool load_lost "stock, tool or position were known under the M251 in force and are not, or nobody followed them meanwhile and they have changed; to volumetric-feed.N.load-lost";
pin out bool path_known "the path ahead is read from the motion planner; FALSE: it is predicted";
pin out si32 path_refused "check that keeps the path ahead unknown although read-path is TRUE; 0 none; motion's memory: 1 missing, 2 too small, 3 of another user, 4 not of this LinuxCNC, 5 no queue in it; for 1 s of cutting: 6 heartbeat, 7 pins of motion, 8 counts, 9 backwards, 10 position, 11 segment, 12 place on it, 13 chain, 14 queue empty";
pin out real blend_vel "velocity that the slower segment of a parabolic blend adds to motion.current-vel, machine units/s; 0: no such blend, or path-known is FALSE";
pin out real braking_accel "least acceleration the planner brakes with where the tool is, machine units/s2; 0: path-known is FALSE";
pin out real load_step_distance_#[8] "machine units of travel until load-step-area-N applies; step 0 applies now";
pin out real load_step_area_#[8] "mm2, never too low; rises with N; 0: unused";
pin out real load_step_accel_#[8] "mean braking the planner can use until there, machine units/s2; 0: unknown";

pin in real chip_weight "volumetric-feed.N.chip-weight, 1/mm: 1 / largest chip; 0: not limited";
pin in real power_weight "volumetric-feed.N.power-weight, 1/mm: what power and torque allow; 0: not limited";
pin in real force_weight "volumetric-feed.N.force-weight, 1/mm: what the largest side force allows; 0: not limited";
pin in real tool_flutes "number of cutting edges (chipwise-monitor.tool-flutes), for force-weight; 0: unknown";
pin in real force_exponent "Kienzle's mc of the material (chipwise-monitor.force-exponent), for power-weight and force-weight";
pin out real chip_share "largest chip over the feed per tooth at the tool, 0 to 1; 0 without chip-weight";
pin out real power_root "A_mc^(1 / (1 - mc)) at the tool, for power and torque; 0 without power-weight";
pin out real force_root "(side force)^(1 / (1 - mc)) at the tool; 0 without force-weight";
pin out real force_mean_share "mean of the side force over a turn, share of its largest value";
pin out real tooth_step_distance_#[8] "machine units of travel until tooth-step-load-N applies; step 0 applies now";
pin out real tooth_step_load_#[8] "1/mm: 1 / largest feed per tooth that the limits of tool and spindle allow; rises with N; 0: unused";
pin out real tooth_step_accel_#[8] "mean braking the planner can use until there, machine units/s2; 0: unknown";
pin out si32 tooth_step_limit_#[8] "which limit has made it: 0 chip, 1 power or torque, 2 side force";

pin out bool clamp_contact "a move meets, or within its braking distance will meet, a clamp or its clearance";
pin out real clamp_distance "travel to where it does, machine units";
pin out si32 clamp_number "that clamp: its place in the table of M256, from 1; 0: none";
pin out si32 clamp_part "what meets it: 0 the tool or its shank, 1 the holder";
pin out si32 clamp_count "clamps in force, as chipwise-monitor has written them for M256";
pin out si32 clamps_taken "counts tables of clamps that were taken over; -1: the last one was refused, and those before are in force";

param rw real units_per_mm = 1.0 "machine units per mm: 1 or 1/25.4";
param rw real mrr_window = 0.02 "s, at most 1023 periods";
param rw real acceleration = 0.0 "acceleration the planner really uses, machine units/s2; 0: unknown, look 20 mm ahead";
param rw real max_jerk = 0.0 "jerk limit of the planner ([TRAJ]PLANNER_TYPE = 1), machine units/s3; 0: not limited";
param rw bool read_path = 1 "read the path ahead from the motion planner; FALSE: always predict it";
param rw real acceleration_x = 0.0 "acceleration of the X axis, for the braking of traverses, machine units/s2; 0: unknown, use acceleration";
param rw real acceleration_y = 0.0 "the same of the Y axis";
param rw real acceleration_z = 0.0 "the same of the Z axis";
param rw real monitor_timeout = 0.0 "time without a heartbeat until fault 16, s; 0: not watched";
param rw real air_clearance = 0.0 "height above the stock's box from which feeds meet nothing, machine units; 0: none";
param rw si32 feed_output = -1 "number of the analog output of motion that carries F (programmed-vel); -1: unknown";
param r si32 work_percent "part of a period's work that is done, from the module's work, per cent";
param r si32 shm_key "key of the shared memory with the map";

variable chip_tracker_t state;
variable chip_planner_t planner;
variable chip_tool_watch_t watch;
variable chip_load_watch_t load_state;
variable chip_path_thinner_t thinner;
variable chip_path_watch_t path_state;
variable int is_reported;
variable double last_ns;
variable double told_buried;
variable int told_tool;
variable void *map;
variable void *done;
variable void *clamp_table;
variable int map_id;

option extra_setup yes;
option post_export yes;
option extra_cleanup yes;
function _;
license "GPL";
author "chipwise";
see_also "volumetric_feed(9), chipwise_command(9)";
include "core/stock_tracker_core.h";
;;

#include <rtapi_string.h>
#include "map_block.h"
#include "tracker_watches.h"

/* Module parameters: HAL has no float parameters, so lengths come as text. */
static char *cell = "0.25";
RTAPI_MP_STRING(cell, "side of a map cell, mm");
static char *finest_cell = "";
RTAPI_MP_STRING(finest_cell, "side of a map cell where the stock is small, mm");
static char *size_x = "300";
RTAPI_MP_STRING(size_x, "largest stock in X, mm");
static char *size_y = "200";
RTAPI_MP_STRING(size_y, "largest stock in Y, mm");
static int work = 100;
RTAPI_MP_INT(work, "part of a period's work, per cent");

static int refuse_external(int key)
{
    rtapi_print_msg(RTAPI_MSG_ERR,
        "chipwise: stock_tracker: the shared memory with the key 0x%x is another user's or another program's; end that "
        "program, then run `ipcrm -M 0x%x` as that user or as root\n", key, key);
    return -13;
}

/* What was made here has been removed again, so there is nothing to clear away. */
static int refuse_shared(int key)
{
    rtapi_print_msg(RTAPI_MSG_ERR,
        "chipwise: stock_tracker: another program has opened the shared memory with the key 0x%x while it was made; end "
        "that program, then start LinuxCNC again\n", key);
    return -16;
}

/* Makes the map of one instance in shared memory, so that other programs can read it. Variables are
 * zero here; halcompile sets initial values only after this, so map_id has none. */
EXTRA_SETUP() {
    double side = chip_decimal(cell), finest = *finest_cell ? chip_decimal(finest_cell) : side, x = chip_decimal(size_x), y = chip_decimal(size_y);
    int key = CHIP_STOCK_MAGIC + extra_arg;
    uint32_t cells = chip_stock_cells(side, x, y);
    uint64_t bytes = chip_stock_bytes(cells) + sizeof(struct chip_path_done) + sizeof(struct chip_clamp_table);

    if (!cells) {
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: stock_tracker: no map with cell=%s size_x=%s size_y=%s mm: each must be a "
            "number > 0, the cell 0.001 to 100 mm, and the map have at most 268435456 cells; use a larger cell or a smaller "
            "size\n", cell, size_x, size_y);
        return -22;
    }
    if (!(finest >= CHIP_MIN_CELL && finest <= side)) {
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: stock_tracker: finest_cell=%s mm is not a length from 0.001 mm to the cell of %s mm; correct it, or "
            "leave it out\n", finest_cell, cell);
        return -22;
    }
    if (work < CHIP_WORK_MIN_PERCENT || work > 100) {
        rtapi_print_msg(RTAPI_MSG_ERR, "chipwise: stock_tracker: work=%d is not 10 to 100 per cent; correct it, or leave it out\n", work);
        return -22;
    }
    if (remove_stale(key) < 0) return refuse_external(key);
    map_id = rtapi_shmem_new(key, comp_id, bytes);
    if (map_id >= 0 && !freshly_made(key, bytes)) {
        rtapi_shmem_delete(map_id, comp_id);
        return refuse_shared(key);
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
    chip_stock_init_finer(map, side, finest, cells);
    done = (char *)map + chip_stock_bytes(cells);       /* the path done, behind the cells, */
    clamp_table = (char *)done + sizeof(struct chip_path_done); /* and the clamps */
    chip_tracker_init(&state); chip_tracker_set_work(&state, work);
    chip_tracker_own_map(&state, map);
    chip_planner_attach(&planner);
    return 0;
}

/* The parameter exists from here on. */
POST_EXPORT() {
    work_percent_set(work);
    shm_key_set(CHIP_STOCK_MAGIC + extra_arg);
    return 0;
}

/* The function may still run in a thread: it loses the map and gets a millisecond to end, then the
 * map is removed. The pin and variable macros use the name __comp_inst. */
EXTRA_CLEANUP() {
    struct __comp_state *__comp_inst;
    int i;
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next) map = 0;
    for (i = 0; i < 100; i++) rtapi_delay(10000);
    for (__comp_inst = __comp_first_inst; __comp_inst; __comp_inst = __comp_inst->_next)
        rtapi_shmem_delete(map_id, comp_id);
}

/* Pins and parameters -> input of the core. */
static void read_pins(struct __comp_state *__comp_inst, long period, struct chip_tracker_in *in)
{
    in->pos_mu[0] = pos_x; in->pos_mu[1] = pos_y; in->pos_mu[2] = pos_z;
    in->tool_offset_mu[0] = tool_offset_x; in->tool_offset_mu[1] = tool_offset_y; in->tool_offset_mu[2] = tool_offset_z;
    in->mu_per_mm = units_per_mm; in->motion = motion_type;
    in->is_enabled = enable; in->is_turned = turned;
    in->tool_diameter_mu = tool_diameter; in->tool_corner_radius_mu = tool_corner_radius;
    in->tool_tip_angle_deg = tool_tip_angle; in->tool_flute_length_mu = tool_flute_length;
    in->tool_stick_out_mu = tool_stick_out; in->tool_holder_diameter_mu = tool_holder_diameter; in->clamps = clamp_table;
    in->current_vel_mu_s = current_vel;
    in->box_min_mu[0] = min_x; in->box_min_mu[1] = min_y; in->box_min_mu[2] = min_z;
    in->box_max_mu[0] = max_x; in->box_max_mu[1] = max_y; in->box_max_mu[2] = max_z;
    in->box_shape = shape; in->box_turn_deg = turn; in->define_request = define;
    in->external_writer = hold; in->is_assumed = assumed; in->tool_is_assumed = tool_assumed;
    in->distance_to_go_mu = distance_to_go;
    watch_tool(__comp_inst, period, in);
    in->acceleration_mu_s2 = acceleration;
    in->axis_acceleration_mu_s2[0] = acceleration_x; in->axis_acceleration_mu_s2[1] = acceleration_y; in->axis_acceleration_mu_s2[2] = acceleration_z;
    in->max_jerk_mu_s3 = max_jerk; in->mrr_window_s = mrr_window;
    in->is_air_free = air; in->air_clearance_mu = air_clearance; in->ceiling_of_f = ceiling; in->feed_override_share = feed_override;
    in->programmed_vel_mu_s = programmed_vel; in->f_output = feed_output;
    in->chip_weight_per_mm = chip_weight; in->power_weight_per_mm = power_weight; in->force_exponent_mc = force_exponent;
    in->force_weight_per_mm = force_weight; in->flutes = tool_flutes;
    in->period_s = fperiod;
}

/* Output of the core -> pins; lengths go out in machine units. */
static void write_pins(struct __comp_state *__comp_inst, const struct chip_tracker_out *out)
{
    double scale = units_per_mm >= CHIP_MIN_MU_PER_MM && units_per_mm <= CHIP_MAX_MU_PER_MM ? units_per_mm : 0.0;
    int i;

    stock_defined_set(out->has_stock); certain_set(out->is_certain); ready_set(out->is_ready);
    fault_set(out->has_fault); fault_code_set(out->fault_number);
    removed_volume_set(out->removed_volume_mm3); mrr_set(out->mrr_mm3_min);
    section_area_set(out->section_area_mm2); depth_set(out->depth_mm * scale);
    buried_depth_set(out->buried_depth_mm * scale);
    direction_z_set(out->dir_z);
    descent_distance_set(out->descent_mm < 0.0 ? -1.0 : out->descent_mm * scale); descent_accel_set(out->descent_accel_mm_s2 * scale);
    pace_distance_set(out->pace.distance < 0.0 ? out->pace.distance : out->pace.distance * scale);
    pace_vel_set(out->pace.vel * scale); pace_accel_set(out->pace.accel * scale);
    flute_excess_set(out->has_flute_excess); rapid_contact_set(out->has_rapid_contact);
    clamp_contact_set(out->has_clamp_contact); clamp_distance_set(out->clamp_distance_mm * scale);
    clamp_number_set(out->met_clamp); clamp_part_set(out->met_part);
    clamp_count_set(out->clamps_in_force); clamps_taken_set(out->tables_taken);
    path_known_set(state.lookahead.on_path); held_set(out->is_held);
    rapid_distance_set(out->rapid_distance_mm * scale);
    for (i = 0; i < CHIP_LOAD_STEPS; i++) {
        load_step_distance_set(i, i < out->load.steps ? out->load.step[i].distance * scale : 0.0);
        load_step_area_set(i, i < out->load.steps ? out->load.step[i].area : 0.0);
        load_step_accel_set(i, i < out->load.steps ? out->load.step[i].accel * scale : 0.0);
        tooth_step_distance_set(i, i < out->load.tooth_steps ? out->load.tooth_step[i].distance * scale : 0.0);
        tooth_step_load_set(i, i < out->load.tooth_steps ? out->load.tooth_step[i].area : 0.0);
        tooth_step_accel_set(i, i < out->load.tooth_steps ? out->load.tooth_step[i].accel * scale : 0.0);
        tooth_step_limit_set(i, i < out->load.tooth_steps ? out->load.tooth_step[i].limit : 0);
    }
    chip_share_set(out->load.chip); power_root_set(out->load.power);
    force_root_set(out->load.force); force_mean_share_set(out->load.force_mean);
}

FUNCTION(_) {
    struct chip_stock *stock = map;
    struct chip_tracker_in in;
    struct chip_tracker_out out;
    int is_cutting;

    if (!stock) return;
    aborted_set(chip_planner_aborted(&planner));
    read_pins(__comp_inst, period, &in);
    if (chip_tracker_offset_changed(&state, &in)) chip_path_reset(&state.path);
    if (read_path)
        chip_planner_follow(&planner, &in, chip_tracker_horizon(&state, stock, &in), &state.path);
    else
        chip_planner_unread(&planner, &state.path);
    blend_vel_set(planner.blend_vel_mu_s);
    braking_accel_set(planner.braking_mu_s2);
    chip_tracker_step(&state, stock, &in, &out);
    if (state.tip_known) chip_path_done_step(&thinner, done, state.tip);
    else chip_path_done_lose(&thinner);
    write_pins(__comp_inst, &out);
    watch_buried(__comp_inst, &out);
    if (feed_decided) path_state.unknown_s = 0.0; /* counts from there on */
    /* At rest in stock, as in a dwell, the queue may be empty. */
    is_cutting = enable && in.motion > 0 && section_area > 0.0;
    path_refused_set(chip_path_watch_step(&path_state, read_path ? planner.refusal : 0, is_cutting, fperiod));
    load_lost_set(watch_load(__comp_inst, &in));
    tool_awaited_set(watch.is_awaited);
}
