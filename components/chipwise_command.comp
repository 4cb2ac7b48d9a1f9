component chipwise_command "Carry M250..M252 from the interpreter to the HAL, in step with motion";
description """
The interpreter runs far ahead of the machine, so a code that must act when the machine gets
there goes through motion's analog outputs, which M68 sets in their turn of the queue. Two
outputs carry any number of values: first the number of a register to
.B word,
then its content to
.B value.
Registers 1..6 are the stock box, 11..13 the feed. Nothing of them takes effect before the word
that commits them (7: the stock, 17: the feed), so a program aborted in between changes nothing.
""";

pin in float word "motion.analog-out-N: number of the register that value goes to";
pin in float value "motion.analog-out-M: its content";
pin out float min_x "register 1: stock box, machine units";
pin out float min_y "register 2";
pin out float min_z "register 3";
pin out float max_x "register 4";
pin out float max_y "register 5";
pin out float max_z "register 6";
pin out bit define "TRUE while word is 7";
pin out s32 mode "register 11, as of the last commit: mode of volumetric_feed(9)";
pin in bit stock_defined "stock-tracker.N.stock-defined";
pin in s32 fault_code "stock-tracker.N.fault-code";
pin out float status "to motion.analog-in-N, where the codes look whether they were obeyed: mode + 10 if a stock is defined + 100 * fault-code";
pin out float mrr_target "register 12, as of the last commit: mm3/min";
pin out float mrr_lower "register 13, as of the last commit: mm3/min";

variable double box[6];
variable double feed[3];
function _ fp;
license "GPL";
author "chipwise";
see_also "stock_tracker(9), volumetric_feed(9)";
;;

#define BOX_FIRST 1
#define BOX_COMMIT 7
#define FEED_FIRST 11
#define FEED_COMMIT 17

FUNCTION(_) {
    double w = word;
    int number = w > 0.5 && w < 100.0 ? (int)(w + 0.5) : 0;

    if (number >= BOX_FIRST && number < BOX_FIRST + 6) box[number - BOX_FIRST] = value;
    if (number >= FEED_FIRST && number < FEED_FIRST + 3) feed[number - FEED_FIRST] = value;
    if (number == BOX_COMMIT) {
        min_x = box[0]; min_y = box[1]; min_z = box[2];
        max_x = box[3]; max_y = box[4]; max_z = box[5];
    }
    define = number == BOX_COMMIT;
    if (number == FEED_COMMIT) {
        mode = feed[0] >= 0.5 && feed[0] < 3.5 ? (int)(feed[0] + 0.5) : 0;
        mrr_target = feed[1];
        mrr_lower = feed[2];
    }
    status = mode + (stock_defined ? 10 : 0) + 100.0 * fault_code;
}
