component chipwise_inputs "Read motion's pins wherever they are connected, or not at all";
description """
HAL lets a pin be on one signal only. What chipwise has to know of motion (where the axes are, the
tool offset, the kind of motion) is wanted by other HAL files too, by some of them later: the screen's
POSTGUI_HALFILE connects motion.tooloffset.x on many machines. So chipwise does not connect these pins. This component
finds them by name while it is loaded and copies their values in every period, whatever signal they are
on now, or none.
.br
A pin whose connection changes keeps its last value for that period.
.br
.B own-0, own-1
are the component's own and say nothing.
.br
Add the function to the servo thread after motion-controller and before the other functions of
chipwise. Load it after motion.
""";

pin out float pos_x "axis.x.pos-cmd";
pin out float pos_y "axis.y.pos-cmd";
pin out float pos_z "axis.z.pos-cmd";
pin out float tool_offset_x "motion.tooloffset.x";
pin out float tool_offset_y "motion.tooloffset.y";
pin out float tool_offset_z "motion.tooloffset.z";
pin out float distance_to_go "motion.distance-to-go";
pin out float requested_vel "motion.requested-vel";
pin out float current_vel "motion.current-vel";
pin out float spindle_speed "spindle.0.speed-out-rps";
pin out s32 motion_type "motion.motion-type";
pin out s32 program_line "motion.program-line";
pin out s32 tool_number "iocontrol.0.tool-number; 0 where it was connected before this component was loaded";
pin out bit coord_mode "motion.coord-mode";
pin out bit index_enable "spindle.0.index-enable";
pin out bit motion_enabled "motion.motion-enabled; TRUE where there is no such pin";
pin in bit define "chipwise-command.0.define: a rising edge remembers where the axes A B C U V W are";
pin in bit held "stock-tracker.0.held: as define, when it falls";
pin out bit turned "an axis A B C U V W that the machine has is not where it was when the stock was defined; until it is defined again";

variable cw_input_t input[22];
option extra_setup yes;
function _ fp;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9), motion(9)";
include "inputs.h";
;;

/* Finds motion's pins. Two pins of its own, of known place, show how this HAL keeps its pins. */
EXTRA_SETUP() {
    int kept = cw_inputs_setup(input, prefix, comp_id);
    if (kept < 0)
        rtapi_print_msg(RTAPI_MSG_ERR,
            "chipwise: chipwise_inputs: this LinuxCNC keeps its HAL pins in a way that is not known; "
            "use LinuxCNC 2.9\n");
    return kept;
}

FUNCTION(_) {
    struct cw_input *in = input;

    cw_inputs_read(in);
    pos_x = cw_input_float(&in[CW_POS_X]);
    pos_y = cw_input_float(&in[CW_POS_Y]);
    pos_z = cw_input_float(&in[CW_POS_Z]);
    tool_offset_x = cw_input_float(&in[CW_OFFSET_X]);
    tool_offset_y = cw_input_float(&in[CW_OFFSET_Y]);
    tool_offset_z = cw_input_float(&in[CW_OFFSET_Z]);
    distance_to_go = cw_input_float(&in[CW_TO_GO]);
    requested_vel = cw_input_float(&in[CW_REQUESTED_VEL]);
    current_vel = cw_input_float(&in[CW_CURRENT_VEL]);
    spindle_speed = cw_input_float(&in[CW_SPINDLE_SPEED]);
    motion_type = cw_input_s32(&in[CW_MOTION_TYPE]);
    program_line = cw_input_s32(&in[CW_PROGRAM_LINE]);
    tool_number = cw_input_s32(&in[CW_TOOL_NUMBER]);
    coord_mode = cw_input_bit(&in[CW_COORD_MODE]);
    index_enable = cw_input_bit(&in[CW_INDEX_ENABLE]);
    motion_enabled = cw_input_bit(&in[CW_ENABLED]);
    turned = cw_inputs_turned(in, define || held, turned);
}
