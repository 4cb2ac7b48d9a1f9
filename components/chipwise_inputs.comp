// SPDX-License-Identifier: GPL-2.0-or-later
component chipwise_inputs "Read motion's pins whether they are connected or not";
description """
A HAL pin can be on one signal only. Other HAL files also use the pins of motion that chipwise needs (axis positions,
tool offset, kind of motion), and some of them are loaded later: the screen's
POSTGUI_HALFILE connects motion.tooloffset.x on many machines. So chipwise does not connect these pins. This component
finds them by name while it is loaded and copies their values in every period, on whatever signal they are,
or none.
.br
A pin whose connection changes keeps its last value for that period.
.br
.B own-0, own-1
are used by the component itself and carry no values.
.br
Add the function to the servo thread after motion-controller and before the other functions of
chipwise. Load it after motion.
""";

pin out real pos_x "axis.x.pos-cmd";
pin out real pos_y "axis.y.pos-cmd";
pin out real pos_z "axis.z.pos-cmd";
pin out real tool_offset_x "motion.tooloffset.x";
pin out real tool_offset_y "motion.tooloffset.y";
pin out real tool_offset_z "motion.tooloffset.z";
pin out real distance_to_go "motion.distance-to-go";
pin out real requested_vel "motion.requested-vel";
pin out real current_vel "motion.current-vel";
pin out real spindle_speed "spindle.0.speed-out-rps";
pin out si32 motion_type "motion.motion-type";
pin out si32 program_line "motion.program-line";
pin out si32 tool_number "iocontrol.0.tool-number; 0 if it was connected before this component was loaded";
pin out bool coord_mode "motion.coord-mode";
pin out bool index_enable "spindle.0.index-enable";
pin out bool motion_enabled "motion.motion-enabled; TRUE if there is no such pin";
pin in bool define "chipwise-command.0.define: a rising edge notes the positions of the axes A B C U V W";
pin in bool held "stock-tracker.0.held: a falling edge notes them too";
pin out bool turned "an axis A B C U V W has left its position since the stock was defined; until it is defined again";

variable chip_input_t input[22];
option extra_setup yes;
function _;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9), motion(9)";
include "inputs.h";
;;

/* Finds motion's pins. Two pins of its own, of known address, show how this HAL stores its pins. */
EXTRA_SETUP() {
    int kept = chip_inputs_setup(input, prefix, comp_id);
    if (kept < 0)
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: chipwise_inputs: the HAL pins of this LinuxCNC have an unknown layout; "
            "use LinuxCNC 2.9\n");
    return kept;
}

FUNCTION(_) {
    struct chip_input *in = input;

    chip_inputs_read(in);
    pos_x_set(chip_input_float(&in[CHIP_POS_X]));
    pos_y_set(chip_input_float(&in[CHIP_POS_Y]));
    pos_z_set(chip_input_float(&in[CHIP_POS_Z]));
    tool_offset_x_set(chip_input_float(&in[CHIP_OFFSET_X]));
    tool_offset_y_set(chip_input_float(&in[CHIP_OFFSET_Y]));
    tool_offset_z_set(chip_input_float(&in[CHIP_OFFSET_Z]));
    distance_to_go_set(chip_input_float(&in[CHIP_TO_GO]));
    requested_vel_set(chip_input_float(&in[CHIP_REQUESTED_VEL]));
    current_vel_set(chip_input_float(&in[CHIP_CURRENT_VEL]));
    spindle_speed_set(chip_input_float(&in[CHIP_SPINDLE_SPEED]));
    motion_type_set(chip_input_s32(&in[CHIP_MOTION_TYPE]));
    program_line_set(chip_input_s32(&in[CHIP_PROGRAM_LINE]));
    tool_number_set(chip_input_s32(&in[CHIP_TOOL_NUMBER]));
    coord_mode_set(chip_input_bit(&in[CHIP_COORD_MODE]));
    index_enable_set(chip_input_bit(&in[CHIP_INDEX_ENABLE]));
    motion_enabled_set(chip_input_bit(&in[CHIP_ENABLED]));
    turned_set(chip_inputs_turned(in, define || held, turned));
}
