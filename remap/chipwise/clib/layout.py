# SPDX-License-Identifier: GPL-2.0-or-later
"""Structures, enums and constants of the C core.  Made by tools/make_layout.py from the headers in components/:
change them there, and run `make build`.
"""
import ctypes as C
from enum import IntEnum

ALARM_AIR_S = 0.5
ALARM_HALF = 0.55
ALARM_HIGH = 1.7
ALARM_LOW = 0.6
ALARM_MISSING_S = 1.0
ALARM_NONE = 0.3
ALARM_RATIO_S = 3.0
ALARM_SHORT = 0.7
ALARM_SUM_S = 0.025
ARC_POINTS = 196
BOX_REGISTERS = 6
CELLS_PER_PERIOD = 12000
CHAIN_LINE = -1e+30
CLAMPS = 100
CLAMP_BODIES = 2
CLAMP_LINES = 26
CLAMP_MOST_CLEARANCE = 1000.0
CLAMP_MOST_COORDINATE = 1000000.0
CLAMP_TANGENTS = 24
CLAMP_WORK = 1200
CORE_VERSION = 1
DROP_FULL = 32767
DROP_NOTHING = -1e+30
ENGAGE_AIR = 1
ENGAGE_COLUMNS = 7
ENGAGE_LOADED = 4
ENGAGE_NO_ROOM = 8
ENGAGE_STUCK = 2
FEED_LOAD_STEPS = 8
FEED_OF_JOB = 2
FEED_REGISTERS = 4
FORCE_BRINKS = 96
FORCE_EDGES = 36
FORCE_NODES = 72
FORCE_RADIAL = 1.044
FORCE_STEP = 5.0
FULL = 65535
GUARD_STRIP = 0.5
GUARD_STRIP_MM = 0.125
HEIGHT_LAG = 0.05
HEIGHT_RIDGE = 0.002
HEIGHT_SKIN = 0.004
HEIGHT_STILL = 1e-06
LOAD_FROZEN_S = 2.0
LOAD_LAGS = 8
LOAD_REGAIN_S = 1.0
LOAD_SPEEDS = 8
LOAD_SPIKE = 3.0
LOAD_STEPS = 8
LOAD_WATCH_SIZES = 4
LOOKAHEAD_SAMPLES = 192
MAX_CELL = 100.0
MAX_CELLS = 268435456
MAX_COORDINATE = 1000000.0
MAX_EXPONENT = 0.6
MAX_FLUTE_LENGTH = 10000.0
MAX_MU_PER_MM = 1000.0
MAX_TOOL_DIAMETER = 2000.0
MAX_TOOTH_LOAD = 1000000.0
MIN_CELL = 0.001
MIN_MU_PER_MM = 0.001
MIN_SIZE = 0.001
MIN_TIP_ANGLE = 0.1
MIN_TOOL_DIAMETER = 0.001
MOST_CEILING = 10.0
MOST_JOB_RATE = 1000000000000.0
MOTION_ARC = 3
MOTION_FEED = 2
MOTION_NONE = 0
MOTION_PROBING = 5
MOTION_TRAVERSE = 1
NEEDLE_AREA = 0.001
NEEDLE_SKIN = 0.002
NEED_NONE = 1e+30
NEED_SAME = 0.0001
PAST_ARM = 12
PAST_POINTS = 32
PATH_BEYOND = 1e-07
PATH_DESCENT = 0.0001
PATH_DONE_LEAST = 0.001
PATH_DONE_POINTS = 8192
PATH_DONE_STRIP = 0.05
PATH_PATIENCE_S = 1.0
PATH_SEGMENTS = 160
PROOF_BESIDE = 0.003
PROOF_BESIDE_ROUND = 0.0005
PROOF_ENOUGH = 4
PROOF_LEAST = 0.004
PROOF_LEVEL = 0.005
PROOF_LOWER = 0.01
PROOF_MOST = 60
PROOF_MOST_MORE = 30
PROOF_SEGMENT = 0.2
PROOF_SIDE = 0.001
PROOF_SKIN = 0.004
PROOF_WITNESS = 0.1
RASTER_NEIGHBOURS = 8
RATE_SLOTS = 1024
RIM = 32768
RIM_CUT = 511
RIM_DROP = 1023
RIM_GONE = 2047
RIM_TWO = 16384
ROUTE_BAD = 1000000000.0
ROUTE_POINTS = 24
ROUTE_SAME = 1e-06
SAMPLE_RING = 256
STATUS_ACTIVE = 20000000000.0
STATUS_AIR = 80000000000.0
STATUS_CARRIED = 40000000000.0
STATUS_FAULT = 100
STATUS_JOB = 1000000
STATUS_REPLY = 10000
STATUS_STOCK = 10
STATUS_WAITS = 10000000000.0
STOCK_MAGIC = 1129796436
STOCK_VERSION = 5
STOPPED_S = 0.5
STYLUS_DELAY = 32
SUMS_AREA = 0.01
SUMS_DOWN = 0.999
SUMS_LARGEST = 1000000000000.0
SUMS_REST_S = 0.1
SUMS_SETTLE = 20
SUMS_SHARE = 0.5
SUMS_SLOTS = 128
SUMS_THIN = 0.001
SUMS_WAIT_S = 0.5
SUMS_WIDTH = 0.01
SUMS_WINDOW_S = 0.01
SWEEP_QUEUE = 16
TEACH_LEAST_S = 2.0
TEACH_LONGEST_S = 20.0
TOOL_GRACE_S = 0.05
TOOL_RINGS = 12
TRACER_CHORD = 8
TRACER_DELAY = 64
TRACER_RISES = 4
TRACER_WINDOW = 17
TRAVERSE_POINTS = 256
TREE_FAN = 4
TREE_LEVELS = 32
WAITING_MAX = 3
WEIGHTS = 256
WORK_A_NODE = 14
WORK_A_ROUND_NODE = 20
WORK_LEAST = 1500
WORK_MIN_PERCENT = 10
WORK_PARTS = 3
WORK_PER_PERIOD = 16500
WORK_TO_CUT = 10500
WORK_TO_RAMP = 5250
WORK_TO_RAMP_LATE = 8000


class Register(IntEnum):
    """enum chip_register"""

    IDLE = 0
    BOX_FIRST = 1
    BOX_COMMIT = 7
    BOX_SHAPE = 8
    BOX_TURN = 9
    FEED_FIRST = 11
    FEED_COMMIT = 17
    FILE_SLOT = 21
    SAVE_COMMIT = 27
    RESTORE_COMMIT = 28
    CLAMPS_COMMIT = 29


class FileRequest(IntEnum):
    """enum chip_file_request"""

    NONE = 0
    SAVE = 1
    RESTORE = 2
    CLAMPS = 3


class RunEnd(IntEnum):
    """enum chip_run_end"""

    GOES_ON = 0
    WHOLE = 1
    STOPPED = 2


class GuardReason(IntEnum):
    """enum chip_guard_reason"""

    NONE = 0
    RAPID_CONTACT = 1
    FLUTE_EXCESS = 2
    OVERRIDE_IGNORED = 3
    LOAD = 4
    CLAMP_CONTACT = 5


class FeedMode(IntEnum):
    """enum chip_feed_mode"""

    OFF = 0
    LIMIT = 1
    CONSTANT = 2
    WINDOW = 3


class LimitedBy(IntEnum):
    """enum chip_limited_by"""

    NONE = 0
    STOCK_HERE = 1
    STOCK_AHEAD = 2
    FLOOR = 3
    CEILING = 4
    FALLBACK = 5
    CHIP = 6
    POWER = 7
    TORQUE = 8
    FORCE = 9


class ToolWatchFault(IntEnum):
    """enum chip_tool_watch_fault"""

    WATCHED = 0
    CHANGED = 15
    UNWATCHED = 16


class PathRefusal(IntEnum):
    """enum chip_path_refusal"""

    NONE = 0
    NO_BLOCK = 1
    TOO_SMALL = 2
    NOT_OURS = 3
    NOT_MAPPED = 4
    NO_QUEUE = 5
    HEARTBEAT = 6
    PINS = 7
    COUNTS = 8
    REVERSED = 9
    POSITION = 10
    SEGMENT = 11
    STATION = 12
    CHAIN = 13
    EMPTY = 14


class Join(IntEnum):
    """enum chip_join"""

    STOP = 0
    TANGENT = 1
    PARABOLIC = 2


class ToothLimit(IntEnum):
    """enum chip_tooth_limit"""

    CHIP = 0
    POWER = 1
    FORCE = 2


class ToothChange(IntEnum):
    """enum chip_tooth_change"""

    SAME = 0
    CHANGED = 1
    BEGUN = 2


class ToolError(IntEnum):
    """enum chip_tool_error"""

    OK = 0
    DIAMETER = 1
    CORNER = 2
    ANGLE = 3
    FLUTE = 4


class StockError(IntEnum):
    """enum chip_stock_error"""

    OK = 0
    NOT_FINITE = 1
    EMPTY = 2
    TOO_LARGE = 3
    UNSOUND = 4


class StockShape(IntEnum):
    """enum chip_stock_shape"""

    BOX = 0
    CYLINDER = 1


class Fault(IntEnum):
    """enum chip_fault"""

    NONE = 0
    BOX_NOT_FINITE = 1
    BOX_EMPTY = 2
    BOX_TOO_LARGE = 3
    MAP = 4
    TOOL_DIAMETER = 11
    TOOL_CORNER = 12
    TOOL_ANGLE = 13
    TOOL_FLUTE = 14
    TOOL_CHANGED = 15
    NO_MONITOR = 16
    POSITION = 20
    JUMP = 21
    UNITS = 22
    TURNED = 23


class TrackerState(IntEnum):
    """enum chip_tracker_state"""

    CUTTING = 0
    FLUSHING = 1
    EXTERNAL_WRITER = 2


class TracerState(IntEnum):
    """enum chip_tracer_state"""

    IDLE = 0
    APPROACH = 1
    TRACE = 2
    PICK = 3
    RETRACT = 4
    RETURN = 5
    LOST = 6
    OVER_RANGE = 7
    FAULT = 8
    DONE = 9


class TracerMode(IntEnum):
    """enum chip_tracer_mode"""

    ONE_WAY = 1
    BOTH_WAYS = 2
    CONTOUR = 3
    PARTIAL = 4


class TracerLimit(IntEnum):
    """enum chip_tracer_limit"""

    NOTHING = 0
    RANGE = 1
    MAX_VEL = 2
    BEND = 3
    DEFLECTION = 4
    WINDOW = 5
    GAIN = 6


class TracerFault(IntEnum):
    """enum chip_tracer_fault"""

    NO_FAULT = 0
    SETTINGS = 1
    NOT_FINITE = 2
    SENSOR_JUMP = 3
    POSITION_JUMP = 4
    NO_CONTACT = 5
    SOFT_LIMIT = 6
    COLLISION = 7
    TOO_FAR = 8
    BELOW = 9
    FROZEN = 10
    CONTRADICTS = 11


class StylusSurface(IntEnum):
    """enum chip_stylus_surface"""

    PLANE = 0
    BALL = 1
    BOWL = 2
    STEP = 3
    CORNER = 4
    CYLINDER = 5
    BOX = 6
    GRID = 7


class SlaveState(IntEnum):
    """enum chip_slave_state"""

    IDLE = 0
    WAIT = 1
    FOLLOW = 2
    CATCH_UP = 3
    DEAD = 4
    FAULT = 5


class SlaveFault(IntEnum):
    """enum chip_slave_fault"""

    NO_FAULT = 0
    SETTINGS = 1
    CORRUPT = 2
    TOO_FAR = 3
    NO_MASTER = 4


class AxisOffsetState(IntEnum):
    """enum chip_axis_offset_state"""

    HOLD = 0
    FOLLOW = 1
    CLEAR = 2
    FAULT = 3


class AxisOffsetFault(IntEnum):
    """enum chip_axis_offset_fault"""

    NO_FAULT = 0
    SETTINGS = 1
    NOT_FINITE = 2
    ASTRAY = 3
    BEHIND = 4
    COLLISION = 5
    TOO_FAR = 6


class LoadAlarm(IntEnum):
    """enum chip_load_alarm"""

    SOUND = 0
    BROKEN = 1
    MISSING = 2
    IN_AIR = 3
    HIGH = 4
    LOW = 5
    UNUSABLE = 6


class LoadAction(IntEnum):
    """enum chip_load_action"""

    SAY = 0
    HOLD = 1
    SLOW = 2


class FeedIn(C.Structure):
    """struct chip_feed_in"""

    __slots__ = ()
    _fields_ = [
        ("feed_mode", C.c_int),
        ("mrr_target_mm3_s", C.c_double),
        ("mrr_lower_mm3_s", C.c_double),
        ("programmed_vel_mm_s", C.c_double),
        ("requested_vel_mm_s", C.c_double),
        ("motion", C.c_int),
        ("acceleration_mm_s2", C.c_double),
        ("min_vel_mm_s", C.c_double),
        ("period_s", C.c_double),
        ("is_trusted", C.c_int),
        ("section_area_mm2", C.c_double),
        ("load_distance_mm", C.c_double * 8),
        ("load_area_mm2", C.c_double * 8),
        ("load_accel_mm_s2", C.c_double * 8),
        ("tool_max_rate_mm3_s", C.c_double),
        ("max_vel_mm_s", C.c_double),
        ("min_scale_of_f", C.c_double),
        ("max_scale_of_f", C.c_double),
        ("air_vel_mm_s", C.c_double),
        ("plunge_vel_mm_s", C.c_double),
        ("dir_z", C.c_double),
        ("keeps_f_down", C.c_int),
        ("descent_mm", C.c_double),
        ("descent_accel_mm_s2", C.c_double),
        ("is_air_free", C.c_int),
        ("ceiling_of_f", C.c_double),
        ("pace_mm", C.c_double),
        ("pace_vel_mm_s", C.c_double),
        ("pace_accel_mm_s2", C.c_double),
        ("max_chip_thickness_mm", C.c_double),
        ("flutes", C.c_double),
        ("spindle_speed_rps", C.c_double),
        ("tool_diameter_mm", C.c_double),
        ("depth_mm", C.c_double),
        ("feed_override_share", C.c_double),
        ("max_jerk_mm_s3", C.c_double),
        ("current_vel_mm_s", C.c_double),
        ("current_accel_mm_s2", C.c_double),
        ("tooth_distance_mm", C.c_double * 8),
        ("tooth_load_per_mm", C.c_double * 8),
        ("tooth_accel_mm_s2", C.c_double * 8),
        ("tooth_limit", C.c_int * 8),
        ("chip_share_now", C.c_double),
        ("power_root_now", C.c_double),
        ("force_root_now", C.c_double),
        ("force_mean_share_now", C.c_double),
        ("max_chip_mm", C.c_double),
        ("max_power_w", C.c_double),
        ("max_torque_nm", C.c_double),
        ("max_force_n", C.c_double),
        ("tool_stiffness_n_mm", C.c_double),
        ("specific_force_n_mm2", C.c_double),
        ("force_exponent_mc", C.c_double),
        ("is_load_measured", C.c_int),
        ("min_chip_mm", C.c_double),
    ]


class FeedOut(C.Structure):
    """struct chip_feed_out"""

    __slots__ = ()
    _fields_ = [
        ("scale", C.c_double),
        ("limit", C.c_int),
    ]


class FeedEasing(C.Structure):
    """struct chip_feed_easing"""

    __slots__ = ()
    _fields_ = [
        ("ramp_mm_s", C.c_double),
        ("given_mm_s", C.c_double),
        ("is_begun", C.c_int),
    ]


class ToothOut(C.Structure):
    """struct chip_tooth_out"""

    __slots__ = ()
    _fields_ = [
        ("chip_weight_per_mm", C.c_double),
        ("power_weight_per_mm", C.c_double),
        ("chip_mm", C.c_double),
        ("power_w", C.c_double),
        ("torque_nm", C.c_double),
        ("force_weight_per_mm", C.c_double),
        ("side_force_n", C.c_double),
        ("mean_force_n", C.c_double),
        ("deflection_mm", C.c_double),
    ]


class FeedBound(C.Structure):
    """struct chip_feed_bound"""

    __slots__ = ()
    _fields_ = [
        ("scale", C.c_double),
        ("vel_mm_s", C.c_double),
    ]


class FeedHold(C.Structure):
    """struct chip_feed_hold"""

    __slots__ = ()
    _fields_ = [
        ("last", FeedBound),
        ("lowest", FeedBound),
        ("held", FeedBound),
        ("is_begun", C.c_int),
        ("is_in_cut", C.c_int),
        ("has_cut", C.c_int),
        ("is_held", C.c_int),
    ]


class RunTotals(C.Structure):
    """struct chip_run_totals"""

    __slots__ = ()
    _fields_ = [
        ("run_s", C.c_double),
        ("cut_s", C.c_double),
        ("air_s", C.c_double),
        ("fed_s", C.c_double),
        ("saved_s", C.c_double),
        ("volume_mm3", C.c_double),
        ("peak_mm3_s", C.c_double),
        ("rub_s", C.c_double),
    ]


class RunWaiting(C.Structure):
    """struct chip_run_waiting"""

    __slots__ = ()
    _fields_ = [
        ("time_s", C.c_double),
        ("read_mm3", C.c_double),
        ("lost_mm3", C.c_double),
    ]


class RunSums(C.Structure):
    """struct chip_run_sums"""

    __slots__ = ()
    _fields_ = [
        ("program", RunTotals),
        ("beginning", RunTotals),
        ("window", C.c_double * 128),
        ("in_window_mm3", C.c_double),
        ("next", C.c_int),
        ("filled", C.c_int),
        ("rest_s", C.c_double),
        ("last_removed_mm3", C.c_double),
        ("since_motion", C.c_int),
        ("was_running", C.c_int),
        ("is_begun", C.c_int),
        ("thin", RunWaiting),
        ("plunge", RunWaiting),
        ("since_cut", C.c_int),
        ("since_load", C.c_int),
        ("is_plunge", C.c_int),
    ]


class WatchdogIn(C.Structure):
    """struct chip_watchdog_in"""

    __slots__ = ()
    _fields_ = [
        ("feed_mode", C.c_int),
        ("motion", C.c_int),
        ("programmed_vel_mm_s", C.c_double),
        ("requested_vel_mm_s", C.c_double),
        ("override_share", C.c_double),
        ("current_vel_mm_s", C.c_double),
        ("blend_vel_mm_s", C.c_double),
        ("braking_mm_s2", C.c_double),
        ("acceleration_mm_s2", C.c_double),
        ("max_override_share", C.c_double),
        ("period_s", C.c_double),
        ("max_jerk_mm_s3", C.c_double),
        ("is_index_enabled", C.c_int),
        ("is_adaptive_off", C.c_int),
    ]


class Watchdog(C.Structure):
    """struct chip_watchdog"""

    __slots__ = ()
    _fields_ = [
        ("explained_mm_s", C.c_double),
        ("at_rest_s", C.c_double),
        ("periods_above", C.c_int),
        ("faster_s", C.c_double),
        ("is_synchronised", C.c_int),
        ("override_ignored", C.c_int),
    ]


class ToolWatchIn(C.Structure):
    """struct chip_tool_watch_in"""

    __slots__ = ()
    _fields_ = [
        ("tool_in_spindle_number", C.c_int),
        ("tool_followed_number", C.c_int),
        ("heartbeat_count", C.c_int),
        ("monitor_timeout_s", C.c_double),
        ("period_s", C.c_double),
        ("since_last_s", C.c_double),
    ]


class ToolWatch(C.Structure):
    """struct chip_tool_watch"""

    __slots__ = ()
    _fields_ = [
        ("last_heartbeat", C.c_int),
        ("silent_s", C.c_double),
        ("changed_s", C.c_double),
        ("stopped_s", C.c_double),
        ("is_unknown", C.c_int),
        ("is_unwatched", C.c_int),
        ("is_awaited", C.c_int),
        ("code", C.c_int),
    ]


class LoadWatchIn(C.Structure):
    """struct chip_load_watch_in"""

    __slots__ = ()
    _fields_ = [
        ("is_ready", C.c_int),
        ("is_unwatched", C.c_int),
        ("stock_changes", C.c_int),
        ("is_decided", C.c_int),
        ("tool_in_spindle_number", C.c_int),
        ("tool_mu", C.c_double * 4),
    ]


class LoadWatch(C.Structure):
    """struct chip_load_watch"""

    __slots__ = ()
    _fields_ = [
        ("is_known", C.c_int),
        ("is_lost", C.c_int),
        ("was_unwatched", C.c_int),
        ("stock_changed", C.c_int),
        ("tool_number", C.c_int),
        ("tool_mu", C.c_double * 4),
    ]


class PathWatch(C.Structure):
    """struct chip_path_watch"""

    __slots__ = ()
    _fields_ = [
        ("unknown_s", C.c_double),
        ("code", C.c_int),
    ]


class Segment(C.Structure):
    """struct chip_segment"""

    __slots__ = ()
    _fields_ = [
        ("origin", C.c_double * 3),
        ("heading", C.c_double * 2),
        ("horizontal", C.c_double),
        ("vertical", C.c_double),
        ("curvature", C.c_double),
        ("length", C.c_double),
        ("accel", C.c_double),
        ("overlap", C.c_double * 2),
        ("feed", C.c_double),
        ("rapid", C.c_int),
        ("join", C.c_int),
    ]


class Blend(C.Structure):
    """struct chip_blend"""

    __slots__ = ()
    _fields_ = [
        ("active", C.c_int),
        ("start", C.c_double * 3),
        ("dir", C.c_double * 3),
        ("length", C.c_double),
        ("travelled", C.c_double),
        ("speed", C.c_double),
        ("end_speed", C.c_double),
        ("first_left", C.c_double),
        ("first_speed", C.c_double),
    ]


class Path(C.Structure):
    """struct chip_path"""

    __slots__ = ()
    _fields_ = [
        ("known", C.c_int),
        ("new_chain", C.c_int),
        ("s", C.c_double),
        ("begin_s", C.c_double),
        ("key", C.c_long * 160),
        ("segment", Segment * 160),
        ("first", C.c_int),
        ("count", C.c_int),
        ("end_s", C.c_double),
        ("changed_s", C.c_double),
        ("blend", Blend),
    ]


class PathPoint(C.Structure):
    """struct chip_path_point"""

    __slots__ = ()
    _fields_ = [
        ("s", C.c_double),
        ("tip", C.c_double * 3),
        ("dir", C.c_double * 3),
        ("curvature", C.c_double),
        ("turn", C.c_double),
        ("corner", C.c_int),
    ]


class ToothLoad(C.Structure):
    """struct chip_tooth_load"""

    __slots__ = ()
    _fields_ = [
        ("load", C.c_double),
        ("limit", C.c_int),
    ]


class BrinkForce(C.Structure):
    """struct chip_brink_force"""

    __slots__ = ()
    _fields_ = [
        ("at", C.c_float),
        ("unit", C.c_float),
        ("scale", C.c_float),
        ("off", C.c_float),
        ("ahead", C.c_float),
    ]


class ToothWeights(C.Structure):
    """struct chip_tooth_weights"""

    __slots__ = ()
    _fields_ = [
        ("chip", C.c_double),
        ("power", C.c_double),
        ("force", C.c_double),
        ("exponent", C.c_double),
        ("edges", C.c_double),
    ]


class Tooth(C.Structure):
    """struct chip_tooth"""

    __slots__ = ()
    _fields_ = [
        ("chip_weight", C.c_double),
        ("power_weight", C.c_double),
        ("force_weight", C.c_double),
        ("exponent", C.c_double),
        ("edges", C.c_int),
        ("made", C.c_int),
        ("given", ToothWeights),
        ("weight", C.c_float * (256 + 2)),
        ("root", C.c_float * (256 + 2)),
        ("ahead", C.c_float * (256 + 2)),
        ("aside", C.c_float * (256 + 2)),
        ("sine", C.c_float * 72),
        ("cosine", C.c_float * 72),
        ("part", C.c_float * 72),
        ("node", C.c_ubyte * (256 + 2)),
        ("slot", C.c_float),
        ("points", C.c_int),
        ("side", C.c_float * 196),
        ("height", C.c_float * 196),
        ("force", C.c_float * 72),
        ("more", C.c_float * 72),
        ("end", C.c_float * 72),
        ("rise", C.c_float * ((72 // 4) + 1) * 2),
        ("has_more", C.c_int),
        ("has_end", C.c_int),
        ("is_round", C.c_int),
        ("brink", BrinkForce * 96 * 2),
        ("brinks", C.c_int * 2),
        ("push", C.c_double * 2),
    ]


class ToolRing(C.Structure):
    """struct chip_tool_ring"""

    __slots__ = ()
    _fields_ = [
        ("radius", C.c_double),
        ("height", C.c_double),
        ("rise", C.c_double),
        ("run", C.c_double),
        ("inner", C.c_double),
        ("outer", C.c_double),
        ("straight", C.c_int),
    ]


class Tool(C.Structure):
    """struct chip_tool"""

    __slots__ = ()
    _fields_ = [
        ("radius", C.c_double),
        ("corner", C.c_double),
        ("slope", C.c_double),
        ("flute", C.c_double),
        ("r_flat", C.c_double),
        ("r_arc", C.c_double),
        ("arc_top", C.c_double),
        ("shoulder", C.c_double),
        ("tooth", C.c_void_p),
        ("rings", C.c_int),
        ("ring", ToolRing * 12),
    ]


class Clamp(C.Structure):
    """struct chip_clamp"""

    __slots__ = ()
    _fields_ = [
        ("x", C.c_double),
        ("y", C.c_double),
        ("half_x", C.c_double),
        ("half_y", C.c_double),
        ("cosine", C.c_double),
        ("sine", C.c_double),
        ("top", C.c_double),
        ("is_round", C.c_uint64),
    ]


class ClampTable(C.Structure):
    """struct chip_clamp_table"""

    __slots__ = ()
    _fields_ = [
        ("generation", C.c_uint64),
        ("count", C.c_uint64),
        ("clearance", C.c_double),
        ("clamp", Clamp * 100),
    ]


class ClampBody(C.Structure):
    """struct chip_clamp_body"""

    __slots__ = ()
    _fields_ = [
        ("begins", C.c_double),
        ("radius", C.c_double),
        ("lines", C.c_int),
        ("a", C.c_double * 26),
        ("b", C.c_double * 26),
        ("share", C.c_double * 26),
    ]


class ClampIn(C.Structure):
    """struct chip_clamp_in"""

    __slots__ = ()
    _fields_ = [
        ("from", C.c_double * 3),
        ("to", C.c_double * 3),
        ("period_s", C.c_double),
        ("acceleration_mm_s2", C.c_double),
        ("current_vel_mm_s", C.c_double),
        ("max_jerk_mm_s3", C.c_double),
        ("distance_to_go_mm", C.c_double),
        ("path", C.c_void_p),
    ]


class Clamps(C.Structure):
    """struct chip_clamps"""

    __slots__ = ()
    _fields_ = [
        ("table", ClampTable),
        ("next", ClampTable),
        ("seen", C.c_uint64),
        ("refused", C.c_int),
        ("bodies", C.c_int),
        ("body", ClampBody * 2),
        ("built", C.c_double * 6),
        ("allowed", C.c_double * 2 * 100),
        ("window", C.c_double),
        ("distance", C.c_double),
        ("number", C.c_int),
        ("part", C.c_int),
        ("work", C.c_long),
    ]


class PredictedPath(C.Structure):
    """struct chip_predicted_path"""

    __slots__ = ()
    _fields_ = [
        ("known", C.c_int),
        ("segment", Segment),
        ("travelled", C.c_double),
        ("speed", C.c_double),
        ("last_heading", C.c_double),
        ("last_step", C.c_double),
        ("last_turn", C.c_double),
        ("last_dir_z", C.c_double),
        ("point", C.c_double * 2 * 32),
        ("newest", C.c_int),
        ("points", C.c_int),
    ]


class Cell(C.Structure):
    """struct chip_cell"""

    __slots__ = ()
    _fields_ = [
        ("top", C.c_float),
        ("drop", C.c_uint16),
        ("cut", C.c_uint16),
    ]


class Levels(C.Structure):
    """struct chip_levels"""

    __slots__ = ()
    _fields_ = [
        ("top", C.c_double),
        ("low", C.c_double),
        ("cut", C.c_double),
        ("gone", C.c_double),
    ]


class Stock(C.Structure):
    """struct chip_stock"""

    __slots__ = ()
    _fields_ = [
        ("magic", C.c_uint32),
        ("version", C.c_uint32),
        ("generation", C.c_uint32),
        ("capacity", C.c_uint32),
        ("coarsest", C.c_double),
        ("finest", C.c_double),
        ("cell", C.c_double),
        ("x0", C.c_double),
        ("y0", C.c_double),
        ("z_min", C.c_double),
        ("z_max", C.c_double),
        ("x_max", C.c_double),
        ("y_max", C.c_double),
        ("drop_unit", C.c_double),
        ("nx", C.c_int32),
        ("ny", C.c_int32),
        ("filled", C.c_int32),
        ("shape", C.c_int32),
        ("removed", C.c_double),
        ("half_x", C.c_double),
        ("half_y", C.c_double),
        ("turn", C.c_double),
        ("definitions", C.c_uint64),
    ]


class Section(C.Structure):
    """struct chip_section"""

    __slots__ = ()
    _fields_ = [
        ("area", C.c_double),
        ("depth", C.c_double),
        ("nodes", C.c_int),
        ("chip", C.c_double),
        ("power_area", C.c_double),
        ("side_force", C.c_double),
        ("mean_force", C.c_double),
    ]


class LoadInterval(C.Structure):
    """struct chip_load_interval"""

    __slots__ = ()
    _fields_ = [
        ("from", C.c_double),
        ("to", C.c_double),
        ("a", C.c_double),
        ("b", C.c_double),
        ("bound", C.c_double),
        ("jump", C.c_int),
    ]


class Lookahead(C.Structure):
    """struct chip_lookahead"""

    __slots__ = ()
    _fields_ = [
        ("predicted", PredictedPath),
        ("on_path", C.c_int),
        ("at_s", C.c_double),
        ("period", C.c_double),
        ("latency_travel", C.c_double),
        ("jerk_travel", C.c_double),
        ("jerk_gain", C.c_double),
        ("spacing", C.c_double),
        ("next_spacing", C.c_double),
        ("begin_s", C.c_double),
        ("begin_area", C.c_double),
        ("first", C.c_int),
        ("count", C.c_int),
        ("stale", C.c_int),
        ("s", C.c_double * 256),
        ("area", C.c_float * 256),
        ("full_area", C.c_float * 256),
        ("depth", C.c_float * 256),
        ("position_error", C.c_float * 256),
        ("turn", C.c_float * 256),
        ("corner_turn", C.c_double * 256),
        ("corner", C.c_ubyte * 256),
        ("read_clear", C.c_ubyte * 256),
        ("completed", C.c_ubyte * 256),
        ("interval", LoadInterval * 256),
        ("chip_weight", C.c_double),
        ("power_weight", C.c_double),
        ("force_weight", C.c_double),
        ("power_root", C.c_double),
        ("begin_tooth", ToothLoad),
        ("tooth", ToothLoad * 256),
        ("between", ToothLoad * 256),
        ("chip", C.c_float * 256),
        ("power", C.c_float * 256),
        ("force", C.c_float * 256),
        ("force_mean", C.c_float * 256),
        ("carried", C.c_float * 192 * 3),
    ]


class LoadStep(C.Structure):
    """struct chip_load_step"""

    __slots__ = ()
    _fields_ = [
        ("distance", C.c_double),
        ("area", C.c_double),
        ("accel", C.c_double),
        ("limit", C.c_int),
    ]


class LoadProfile(C.Structure):
    """struct chip_load_profile"""

    __slots__ = ()
    _fields_ = [
        ("area", C.c_double),
        ("depth", C.c_double),
        ("steps", C.c_int),
        ("step", LoadStep * 8),
        ("tooth_steps", C.c_int),
        ("tooth_step", LoadStep * 8),
        ("chip", C.c_double),
        ("power", C.c_double),
        ("force", C.c_double),
        ("force_mean", C.c_double),
    ]


class Pace(C.Structure):
    """struct chip_pace"""

    __slots__ = ()
    _fields_ = [
        ("distance", C.c_double),
        ("vel", C.c_double),
        ("accel", C.c_double),
    ]


class PaceIn(C.Structure):
    """struct chip_pace_in"""

    __slots__ = ()
    _fields_ = [
        ("clear_z", C.c_double),
        ("ceiling", C.c_double),
        ("late", C.c_double),
        ("override", C.c_double),
        ("horizon", C.c_double),
    ]


class Sweep(C.Structure):
    """struct chip_sweep"""

    __slots__ = ()
    _fields_ = [
        ("at", C.c_double * 3),
        ("queue", C.c_double * 3 * 16),
        ("waiting", C.c_int),
        ("known", C.c_int),
        ("start_is_cut", C.c_int),
        ("row", C.c_int),
        ("row_end", C.c_int),
        ("finished", C.c_uint32),
        ("column", C.c_int),
        ("heading", C.c_double * 2),
        ("rise", C.c_double),
        ("straight", C.c_double),
        ("deviation", C.c_double * 16),
    ]


class GuardIn(C.Structure):
    """struct chip_guard_in"""

    __slots__ = ()
    _fields_ = [
        ("from", C.c_double * 3),
        ("to", C.c_double * 3),
        ("period_s", C.c_double),
        ("acceleration_mm_s2", C.c_double),
        ("axis_acceleration_mm_s2", C.c_double * 3),
        ("max_jerk_mm_s3", C.c_double),
        ("distance_to_go_mm", C.c_double),
        ("start_is_cut", C.c_int),
        ("path", C.c_void_p),
    ]


class GuardProbe(C.Structure):
    """struct chip_guard_probe"""

    __slots__ = ()
    _fields_ = [
        ("clear", C.c_double),
        ("hit_near", C.c_double),
        ("hit_far", C.c_double),
    ]


class GuardBlend(C.Structure):
    """struct chip_guard_blend"""

    __slots__ = ()
    _fields_ = [
        ("active", C.c_int),
        ("from", C.c_double),
        ("end", C.c_double),
        ("offset", C.c_double * 3),
        ("speed", C.c_double),
        ("rise", C.c_double),
        ("time", C.c_double),
    ]


class Guard(C.Structure):
    """struct chip_guard"""

    __slots__ = ()
    _fields_ = [
        ("origin", C.c_double * 3),
        ("dir", C.c_double * 3),
        ("travelled", C.c_double),
        ("on_line", GuardProbe),
        ("blend", GuardBlend),
        ("on_path", GuardProbe),
        ("path_s", C.c_double),
        ("periods", C.c_int),
        ("distance_to_go", C.c_double),
        ("speed", C.c_double),
        ("slowing", C.c_double),
        ("slowing_before", C.c_double),
        ("distance", C.c_double),
        ("shank", Tool),
        ("excess", C.c_int),
    ]


class TrackerIn(C.Structure):
    """struct chip_tracker_in"""

    __slots__ = ()
    _fields_ = [
        ("pos_mu", C.c_double * 3),
        ("tool_offset_mu", C.c_double * 3),
        ("mu_per_mm", C.c_double),
        ("motion", C.c_int),
        ("is_enabled", C.c_int),
        ("is_turned", C.c_int),
        ("tool_diameter_mu", C.c_double),
        ("tool_corner_radius_mu", C.c_double),
        ("tool_tip_angle_deg", C.c_double),
        ("tool_flute_length_mu", C.c_double),
        ("box_min_mu", C.c_double * 3),
        ("box_max_mu", C.c_double * 3),
        ("box_shape", C.c_int),
        ("box_turn_deg", C.c_double),
        ("define_request", C.c_int),
        ("external_writer", C.c_int),
        ("is_assumed", C.c_int),
        ("tool_is_assumed", C.c_int),
        ("tool_unknown", C.c_int),
        ("watch_fault", C.c_int),
        ("distance_to_go_mu", C.c_double),
        ("acceleration_mu_s2", C.c_double),
        ("axis_acceleration_mu_s2", C.c_double * 3),
        ("max_jerk_mu_s3", C.c_double),
        ("mrr_window_s", C.c_double),
        ("is_air_free", C.c_int),
        ("air_clearance_mu", C.c_double),
        ("ceiling_of_f", C.c_double),
        ("feed_override_share", C.c_double),
        ("programmed_vel_mu_s", C.c_double),
        ("f_output", C.c_int),
        ("chip_weight_per_mm", C.c_double),
        ("power_weight_per_mm", C.c_double),
        ("force_weight_per_mm", C.c_double),
        ("force_exponent_mc", C.c_double),
        ("flutes", C.c_double),
        ("tool_stick_out_mu", C.c_double),
        ("tool_holder_diameter_mu", C.c_double),
        ("current_vel_mu_s", C.c_double),
        ("clamps", C.c_void_p),
        ("period_s", C.c_double),
    ]


class TrackerOut(C.Structure):
    """struct chip_tracker_out"""

    __slots__ = ()
    _fields_ = [
        ("has_stock", C.c_int),
        ("is_ready", C.c_int),
        ("has_fault", C.c_int),
        ("fault_number", C.c_int),
        ("removed_volume_mm3", C.c_double),
        ("mrr_mm3_min", C.c_double),
        ("section_area_mm2", C.c_double),
        ("depth_mm", C.c_double),
        ("buried_depth_mm", C.c_double),
        ("dir_z", C.c_double),
        ("descent_mm", C.c_double),
        ("descent_accel_mm_s2", C.c_double),
        ("pace", Pace),
        ("has_flute_excess", C.c_int),
        ("has_rapid_contact", C.c_int),
        ("rapid_distance_mm", C.c_double),
        ("is_held", C.c_int),
        ("is_certain", C.c_int),
        ("load", LoadProfile),
        ("has_clamp_contact", C.c_int),
        ("clamp_distance_mm", C.c_double),
        ("met_clamp", C.c_int),
        ("met_part", C.c_int),
        ("clamps_in_force", C.c_int),
        ("tables_taken", C.c_int),
    ]


class Tracker(C.Structure):
    """struct chip_tracker"""

    __slots__ = ()
    _fields_ = [
        ("state", C.c_uint),
        ("tool", Tool),
        ("tooth", Tooth),
        ("built", C.c_double * 4),
        ("tool_error", C.c_int),
        ("sweep", Sweep),
        ("path", Path),
        ("lookahead", Lookahead),
        ("tip", C.c_double * 3),
        ("axis", C.c_double * 3),
        ("offset_mu", C.c_double * 3),
        ("start", C.c_double * 3),
        ("has_start", C.c_int),
        ("buried_mm", C.c_double),
        ("tip_known", C.c_int),
        ("last_request", C.c_int),
        ("box_error", C.c_int),
        ("fault", C.c_int),
        ("guard", Guard),
        ("clamps", Clamps),
        ("feed_finished", C.c_uint32),
        ("work_percent", C.c_int),
        ("parts_left", C.c_int),
        ("is_uncertain", C.c_int),
        ("held_assumed", C.c_int),
        ("held_moved", C.c_int),
        ("held_waiting", C.c_int),
        ("held_generation", C.c_uint32),
        ("held_coarsest", C.c_double),
        ("held_finest", C.c_double),
        ("held_mm3", C.c_double),
        ("held_definitions", C.c_uint64),
        ("held_capacity", C.c_uint32),
        ("own_head", C.c_uint64 * ((C.sizeof(Stock) + 7) // 8)),
        ("own_known", C.c_int),
        ("rate_log", C.c_double * 1024),
        ("rate_next", C.c_int),
        ("rate_filled", C.c_int),
    ]


class PathDone(C.Structure):
    """struct chip_path_done"""

    __slots__ = ()
    _fields_ = [
        ("count", C.c_uint64),
        ("point", C.c_double * 3 * 8192),
    ]


class PathThinner(C.Structure):
    """struct chip_path_thinner"""

    __slots__ = ()
    _fields_ = [
        ("count", C.c_uint64),
        ("is_known", C.c_int),
        ("has_dir", C.c_int),
        ("from", C.c_double * 3),
        ("dir", C.c_double * 3),
        ("at", C.c_double * 3),
        ("reach", C.c_double),
    ]


class TracerSettings(C.Structure):
    """struct chip_tracer_settings"""

    __slots__ = ()
    _fields_ = [
        ("mode_number", C.c_int),
        ("scan_axis_number", C.c_int),
        ("direction_sign", C.c_int),
        ("feed_mm_s", C.c_double),
        ("approach_vel_mm_s", C.c_double),
        ("return_vel_mm_s", C.c_double),
        ("max_vel_mm_s", C.c_double),
        ("acceleration_mm_s2", C.c_double),
        ("gain_hz", C.c_double),
        ("deflection_mm", C.c_double),
        ("range_mm", C.c_double),
        ("dead_time_s", C.c_double),
        ("drive_time_s", C.c_double),
        ("max_jump_mm", C.c_double),
        ("friction_share", C.c_double),
        ("pick_mm", C.c_double),
        ("retract_mm", C.c_double),
        ("search_mm", C.c_double),
        ("lost_mm", C.c_double),
        ("approach_dir", C.c_double * 3),
        ("window_min_mm", C.c_double * 3),
        ("window_max_mm", C.c_double * 3),
        ("soft_min_mm", C.c_double * 3),
        ("soft_max_mm", C.c_double * 3),
    ]


class TracerIn(C.Structure):
    """struct chip_tracer_in"""

    __slots__ = ()
    _fields_ = [
        ("is_enabled", C.c_int),
        ("wants_retract", C.c_int),
        ("feed_share", C.c_double),
        ("period_s", C.c_double),
        ("position_mm", C.c_double * 3),
        ("deflection_mm", C.c_double * 3),
    ]


class TracerOut(C.Structure):
    """struct chip_tracer_out"""

    __slots__ = ()
    _fields_ = [
        ("state_number", C.c_int),
        ("fault_number", C.c_int),
        ("limit_number", C.c_int),
        ("line_count", C.c_int),
        ("velocity_mm_s", C.c_double * 3),
        ("velocity_limit_mm_s", C.c_double),
        ("gain_hz", C.c_double),
        ("deflection_mm", C.c_double),
        ("error_mm", C.c_double),
        ("normal_vel_mm_s", C.c_double),
        ("tangential_vel_mm_s", C.c_double),
        ("friction_share", C.c_double),
        ("normal", C.c_double * 3),
        ("ball_mm", C.c_double * 3),
    ]


class TracerPoint(C.Structure):
    """struct chip_tracer_point"""

    __slots__ = ()
    _fields_ = [
        ("ball_a_mm", C.c_double),
        ("ball_b_mm", C.c_double),
        ("angle_rad", C.c_double),
        ("share", C.c_double),
    ]


class TracerLaw(C.Structure):
    """struct chip_tracer_law"""

    __slots__ = ()
    _fields_ = [
        ("a", C.c_double * 3),
        ("b", C.c_double * 3),
        ("sense", C.c_double),
        ("friction_share", C.c_double),
        ("heading_rad", C.c_double),
        ("rate_rad_s", C.c_double),
        ("turned_rad", C.c_double),
        ("periods", C.c_int),
        ("since_s", C.c_double),
        ("sliding", C.c_int),
        ("has_head", C.c_int),
        ("head_mm", C.c_double * 3),
        ("normal", C.c_double * 3),
        ("drag", C.c_double * 3),
        ("newest", C.c_int),
        ("point", TracerPoint * 17),
    ]


class TracerSensor(C.Structure):
    """struct chip_tracer_sensor"""

    __slots__ = ()
    _fields_ = [
        ("run", C.c_int * 3),
        ("longest", C.c_int * 3),
        ("periods", C.c_int * 2 * 3),
        ("changes", C.c_int * 2 * 3),
        ("held_periods", C.c_int),
        ("held_mm", C.c_double * 3),
        ("has_late", C.c_int),
        ("late_mm", C.c_double * 3),
        ("moved_mm", C.c_double * 3),
        ("off_mm", C.c_double),
        ("path_mm", C.c_double),
        ("change_mm", C.c_double),
        ("doubt_share", C.c_double),
        ("phase", C.c_int),
        ("level", C.c_int),
        ("block_periods", C.c_int),
        ("block_normal", C.c_double * 3),
        ("asked_mm", C.c_double * 2),
        ("answer_mm", C.c_double * 2),
        ("noise_mm2", C.c_double),
        ("newest", C.c_int),
        ("eps_mm", C.c_double * 4),
    ]


class Tracer(C.Structure):
    """struct chip_tracer"""

    __slots__ = ()
    _fields_ = [
        ("settings", TracerSettings),
        ("law", TracerLaw),
        ("sensor", TracerSensor),
        ("state", C.c_int),
        ("fault", C.c_int),
        ("lines", C.c_int),
        ("has_settings", C.c_int),
        ("stored", C.c_int),
        ("newest", C.c_int),
        ("position_mm", C.c_double * 3 * 64),
        ("deflection_mm", C.c_double * 3),
        ("velocity_mm_s", C.c_double * 3),
        ("normal", C.c_double * 3),
        ("from_mm", C.c_double * 3),
        ("line_mm", C.c_double),
        ("pick_to_mm", C.c_double),
        ("highest_mm", C.c_double),
        ("start_mm", C.c_double * 3),
        ("start_tangent", C.c_double * 3),
        ("has_left_start", C.c_int),
        ("returns", C.c_int),
        ("lost_in_pick", C.c_int),
        ("periods_out", C.c_int),
        ("sense", C.c_double),
    ]


class StylusSettings(C.Structure):
    """struct chip_stylus_settings"""

    __slots__ = ()
    _fields_ = [
        ("surface_number", C.c_int),
        ("at_mm", C.c_double * 3),
        ("normal", C.c_double * 3),
        ("size_mm", C.c_double),
        ("angle_deg", C.c_double),
        ("ball_mm", C.c_double),
        ("friction_share", C.c_double),
        ("noise_mm", C.c_double),
        ("delay_periods", C.c_int),
        ("cell_mm", C.c_double),
        ("nx", C.c_int),
        ("ny", C.c_int),
        ("height_mm", C.c_void_p),
    ]


class Stylus(C.Structure):
    """struct chip_stylus"""

    __slots__ = ()
    _fields_ = [
        ("ball_mm", C.c_double * 3),
        ("is_touching", C.c_int),
        ("random", C.c_uint64),
        ("newest", C.c_int),
        ("deflection_mm", C.c_double * 3 * 32),
    ]


class Packet(C.Structure):
    """struct chip_packet"""

    __slots__ = ()
    _fields_ = [
        ("sequence_number", C.c_uint32),
        ("position_counts", C.c_int64 * 3),
        ("step_counts", C.c_int32 * 3),
    ]


class Master(C.Structure):
    """struct chip_master"""

    __slots__ = ()
    _fields_ = [
        ("is_started", C.c_int),
        ("packet", Packet),
    ]


class SlaveSettings(C.Structure):
    """struct chip_slave_settings"""

    __slots__ = ()
    _fields_ = [
        ("scale_numerator", C.c_int32 * 3),
        ("scale_divisor", C.c_int32 * 3),
        ("most_counts", C.c_int32),
        ("change_counts", C.c_int32),
        ("catch_up_counts", C.c_int32),
        ("max_behind_counts", C.c_int32),
        ("silence_periods", C.c_int32),
        ("tick_count", C.c_int32),
    ]


class Slave(C.Structure):
    """struct chip_slave"""

    __slots__ = ()
    _fields_ = [
        ("state_number", C.c_int),
        ("fault_number", C.c_int),
        ("silent_periods", C.c_int),
        ("sequence_number", C.c_uint32),
        ("received_counts", C.c_int64 * 3),
        ("done_counts", C.c_int64 * 3),
        ("fastest_counts", C.c_int64 * 2 * 3),
        ("zero_counts", C.c_int64 * 3),
        ("remainder", C.c_int64 * 3),
        ("position_counts", C.c_int64 * 3),
        ("step_counts", C.c_int32 * 3),
        ("pulsed_counts", C.c_int64 * 3),
        ("pulse_counts", C.c_int32 * 3),
        ("tick_count", C.c_int32),
        ("phase", C.c_int32 * 3),
        ("tick", C.c_int32),
        ("lost_packets", C.c_uint32),
        ("ignored_packets", C.c_uint32),
    ]


class AxisOffsetSettings(C.Structure):
    """struct chip_axis_offset_settings"""

    __slots__ = ()
    _fields_ = [
        ("acceleration_mm_s2", C.c_double * 3),
        ("max_vel_mm_s", C.c_double * 3),
        ("count_mm", C.c_double),
        ("clear_vel_mm_s", C.c_double),
        ("max_astray_mm", C.c_double),
        ("max_behind_mm", C.c_double),
        ("contact_mm", C.c_double),
    ]


class AxisOffsetIn(C.Structure):
    """struct chip_axis_offset_in"""

    __slots__ = ()
    _fields_ = [
        ("has_request", C.c_int),
        ("has_permit", C.c_int),
        ("has_machine", C.c_int),
        ("wants_clear", C.c_int),
        ("period_s", C.c_double),
        ("position_mm", C.c_double * 3),
        ("offset_mm", C.c_double * 3),
        ("requested_mm", C.c_double * 3),
        ("deflection_mm", C.c_double),
    ]


class AxisOffsetOut(C.Structure):
    """struct chip_axis_offset_out"""

    __slots__ = ()
    _fields_ = [
        ("state_number", C.c_int),
        ("fault_number", C.c_int),
        ("is_enabled", C.c_int),
        ("is_cleared", C.c_int),
        ("is_off", C.c_int),
        ("counts", C.c_int32 * 3),
        ("behind_mm", C.c_double),
        ("lead_mm", C.c_double),
        ("astray_mm", C.c_double),
    ]


class AxisOffset(C.Structure):
    """struct chip_axis_offset"""

    __slots__ = ()
    _fields_ = [
        ("state", C.c_int),
        ("fault", C.c_int),
        ("had_request", C.c_int),
        ("had_clear", C.c_int),
        ("had_machine", C.c_int),
        ("begin_s", C.c_double),
        ("clear_s", C.c_double),
        ("stage", C.c_int),
        ("least_mm", C.c_double),
        ("known", C.c_int),
        ("counts", C.c_int32 * 3),
        ("from_mm", C.c_double * 3),
        ("missing_mm", C.c_double * 3),
        ("velocity_mm_s", C.c_double * 3),
        ("expected_mm", C.c_double * 3),
    ]


class SpindleSettings(C.Structure):
    """struct chip_spindle_settings"""

    __slots__ = ()
    _fields_ = [
        ("inertia_kg_m2", C.c_double),
        ("torque_nm", C.c_double),
        ("idle_w", C.c_double * 3),
        ("factor_share", C.c_double),
        ("wear_per_h", C.c_double),
        ("break_time_s", C.c_double),
        ("lag_s", C.c_double),
        ("drift_per_h", C.c_double),
        ("noise_share", C.c_double),
        ("sample_s", C.c_double),
        ("period_s", C.c_double),
        ("seed_number", C.c_int),
    ]


class SpindleSim(C.Structure):
    """struct chip_spindle_sim"""

    __slots__ = ()
    _fields_ = [
        ("speed_rps", C.c_double),
        ("hours", C.c_double),
        ("cut_s", C.c_double),
        ("lagged_w", C.c_double),
        ("noise", C.c_double),
        ("sample_left_s", C.c_double),
        ("random", C.c_uint64),
        ("seeded", C.c_int),
        ("is_begun", C.c_int),
        ("is_broken", C.c_int),
    ]


class SpindleShown(C.Structure):
    """struct chip_spindle_shown"""

    __slots__ = ()
    _fields_ = [
        ("load_w", C.c_double),
        ("quiet_w", C.c_double),
        ("true_w", C.c_double),
        ("speed_rps", C.c_double),
        ("is_at_speed", C.c_int),
    ]


class LoadIn(C.Structure):
    """struct chip_load_in"""

    __slots__ = ()
    _fields_ = [
        ("spindle_load_w", C.c_double),
        ("power_w", C.c_double),
        ("spindle_speed_rps", C.c_double),
        ("load_factor_share", C.c_double),
        ("section_area_mm2", C.c_double),
        ("period_s", C.c_double),
        ("specific_force_n_mm2", C.c_double),
        ("is_known", C.c_int),
        ("feeds", C.c_int),
        ("moves", C.c_int),
        ("tool_number", C.c_int),
        ("is_decided", C.c_int),
    ]


class LoadIdle(C.Structure):
    """struct chip_load_idle"""

    __slots__ = ()
    _fields_ = [
        ("speed_rps", C.c_double),
        ("idle_w", C.c_double),
    ]


class SpindleLoad(C.Structure):
    """struct chip_spindle_load"""

    __slots__ = ()
    _fields_ = [
        ("is_seen", C.c_int),
        ("last_w", C.c_double),
        ("same_s", C.c_double),
        ("bad_left_s", C.c_double),
        ("is_frozen", C.c_int),
        ("now_w", C.c_double),
        ("fast_w", C.c_double),
        ("faster_w", C.c_double),
        ("medium_w", C.c_double),
        ("slow_w", C.c_double),
        ("block_w", C.c_double),
        ("block_s", C.c_double),
        ("blocks_w", C.c_double * 2),
        ("noise_w2", C.c_double),
        ("blocks", C.c_int),
        ("speed_rps", C.c_double),
        ("steady_s", C.c_double),
        ("has_fed", C.c_int),
        ("air_s", C.c_double),
        ("still_s", C.c_double),
        ("wrong_s", C.c_double),
        ("idle_w", C.c_double),
        ("idle_s", C.c_double),
        ("is_sure", C.c_int),
        ("idle", LoadIdle * 8),
        ("next_idle", C.c_int),
        ("late_w", C.c_double * 8),
        ("lag_s", C.c_double),
        ("lag", C.c_int),
        ("sum_mp", C.c_double * 8),
        ("sum_pp", C.c_double * 8),
        ("sum_mm", C.c_double),
        ("sum_s", C.c_double),
        ("cut_s", C.c_double),
        ("out_s", C.c_double),
        ("cut_factor", C.c_double),
        ("cuts", C.c_int),
        ("factor", C.c_double),
        ("trim", C.c_double),
        ("expected_w", C.c_double),
        ("short_s", C.c_double),
        ("there_s", C.c_double),
        ("missing_s", C.c_double),
        ("in_air_s", C.c_double),
        ("ratio", C.c_double),
        ("ratio_s", C.c_double),
        ("off_s", C.c_double),
        ("usual_w", C.c_double),
        ("unusable_s", C.c_double),
        ("cut_ratio", C.c_double),
        ("was_there", C.c_int),
        ("is_trusted", C.c_int),
        ("is_unusable", C.c_int),
        ("alarm", C.c_int),
        ("tool_number", C.c_int),
        ("specific_force_n_mm2", C.c_double),
    ]


class HeightMap(C.Structure):
    """struct chip_height_map"""

    __slots__ = ()
    _fields_ = [
        ("x0", C.c_double),
        ("y0", C.c_double),
        ("cell", C.c_double),
        ("z_min", C.c_double),
        ("z_max", C.c_double),
        ("nx", C.c_int32),
        ("ny", C.c_int32),
        ("height", C.c_void_p),
        ("x", C.c_void_p),
        ("shift_x", C.c_void_p),
        ("shift_y", C.c_void_p),
        ("needle_x", C.c_void_p),
        ("needle_y", C.c_void_p),
        ("needle_height", C.c_void_p),
        ("strip", C.c_void_p),
        ("strip_y", C.c_double),
        ("strip_width", C.c_double),
        ("needle_skin", C.c_double),
        ("needle_area", C.c_double),
        ("needles", C.c_int32),
        ("strips", C.c_int32),
    ]


class HeightTool(C.Structure):
    """struct chip_height_tool"""

    __slots__ = ()
    _fields_ = [
        ("radius", C.c_double),
        ("corner", C.c_double),
        ("slope", C.c_double),
        ("holder_radius", C.c_double),
        ("stick_out", C.c_double),
    ]


class HeightMet(C.Structure):
    """struct chip_height_met"""

    __slots__ = ()
    _fields_ = [
        ("volume", C.c_float),
        ("depth", C.c_float),
        ("at", C.c_float),
        ("holder", C.c_float),
        ("beside", C.c_float),
        ("beside_at", C.c_float),
    ]


class HeightTraverses(C.Structure):
    """struct chip_height_traverses"""

    __slots__ = ()
    _fields_ = [
        ("judged", C.c_void_p),
        ("clearance", C.c_double),
    ]


class Lane(C.Structure):
    """struct chip_lane"""

    __slots__ = ()
    _fields_ = [
        ("place", C.c_double * 6),
        ("corner", C.c_double),
        ("length", C.c_double),
        ("top", C.c_double),
        ("blend", C.c_double),
        ("speed", C.c_double),
        ("accel", C.c_double),
        ("limit", C.c_void_p),
        ("lower", C.c_void_p),
        ("limits", C.c_int64),
        ("lowers", C.c_int64),
    ]


class DropMesh(C.Structure):
    """struct chip_drop_mesh"""

    __slots__ = ()
    _fields_ = [
        ("bin", C.c_double),
        ("nx", C.c_int32),
        ("ny", C.c_int32),
        ("n", C.c_int32),
        ("stamp", C.c_uint32),
        ("triangle", C.c_void_p),
        ("top", C.c_void_p),
        ("first", C.c_void_p),
        ("member", C.c_void_p),
        ("bin_top", C.c_void_p),
        ("seen", C.c_void_p),
    ]


class DropTool(C.Structure):
    """struct chip_drop_tool"""

    __slots__ = ()
    _fields_ = [
        ("radius", C.c_double),
        ("corner", C.c_double),
        ("half_angle", C.c_double),
    ]


class ProofStock(C.Structure):
    """struct chip_proof_stock"""

    __slots__ = ()
    _fields_ = [
        ("x", C.c_double),
        ("y", C.c_double),
        ("half_x", C.c_double),
        ("half_y", C.c_double),
        ("cosine", C.c_double),
        ("sine", C.c_double),
        ("z_min", C.c_double),
        ("z_max", C.c_double),
        ("shape", C.c_int32),
        ("pad", C.c_int32),
    ]


class ProofTool(C.Structure):
    """struct chip_proof_tool"""

    __slots__ = ()
    _fields_ = [
        ("radius", C.c_double),
        ("corner", C.c_double),
        ("half_angle", C.c_double),
        ("limit", C.c_double),
        ("clearance", C.c_double),
    ]


class ProofPath(C.Structure):
    """struct chip_proof_path"""

    __slots__ = ()
    _fields_ = [
        ("start", C.c_void_p),
        ("to", C.c_void_p),
        ("tool", C.c_void_p),
        ("n", C.c_int64),
    ]


class ProofFound(C.Structure):
    """struct chip_proof_found"""

    __slots__ = ()
    _fields_ = [
        ("x", C.c_double),
        ("y", C.c_double),
        ("height", C.c_double),
        ("at", C.c_double),
        ("move", C.c_int64),
        ("segment", C.c_int64),
    ]


class TracerRow(C.Structure):
    """struct chip_tracer_row"""

    __slots__ = ()
    _fields_ = [
        ("position_mm", C.c_double * 3),
        ("ball_mm", C.c_double * 3),
        ("deflection_mm", C.c_double * 3),
        ("velocity_mm_s", C.c_double * 3),
        ("seen_ball_mm", C.c_double * 3),
        ("normal", C.c_double * 3),
        ("measured_mm", C.c_double),
        ("velocity_limit_mm_s", C.c_double),
        ("tangential_vel_mm_s", C.c_double),
        ("friction_share", C.c_double),
        ("gain_hz", C.c_double),
        ("state", C.c_int),
        ("fault", C.c_int),
        ("limited_by", C.c_int),
        ("lines", C.c_int),
    ]


class EngageRule(C.Structure):
    """struct chip_engage_rule"""

    __slots__ = ()
    _fields_ = [
        ("angle", C.c_double),
        ("escape", C.c_double),
        ("rho", C.c_double),
        ("inset", C.c_double),
        ("step", C.c_double),
        ("air", C.c_double),
    ]


class ElementTree(C.Structure):
    """struct chip_element_tree"""

    __slots__ = ()
    _fields_ = [
        ("n", C.c_int64),
        ("levels", C.c_int64),
        ("first", C.c_void_p),
        ("low", C.c_void_p),
        ("high", C.c_void_p),
        ("start", C.c_void_p),
        ("end", C.c_void_p),
        ("centre", C.c_void_p),
        ("radius", C.c_void_p),
        ("middle", C.c_void_p),
        ("cos_half", C.c_void_p),
        ("is_arc", C.c_void_p),
    ]


class Raster(C.Structure):
    """struct chip_raster"""

    __slots__ = ()
    _fields_ = [
        ("columns", C.c_int64),
        ("rows", C.c_int64),
        ("free", C.c_void_p),
        ("count", C.c_int64),
        ("step", C.c_void_p),
        ("length", C.c_void_p),
    ]


STRUCTURES = {
    "chip_feed_in": FeedIn,
    "chip_feed_out": FeedOut,
    "chip_feed_easing": FeedEasing,
    "chip_tooth_out": ToothOut,
    "chip_feed_bound": FeedBound,
    "chip_feed_hold": FeedHold,
    "chip_run_totals": RunTotals,
    "chip_run_waiting": RunWaiting,
    "chip_run_sums": RunSums,
    "chip_watchdog_in": WatchdogIn,
    "chip_watchdog": Watchdog,
    "chip_tool_watch_in": ToolWatchIn,
    "chip_tool_watch": ToolWatch,
    "chip_load_watch_in": LoadWatchIn,
    "chip_load_watch": LoadWatch,
    "chip_path_watch": PathWatch,
    "chip_segment": Segment,
    "chip_blend": Blend,
    "chip_path": Path,
    "chip_path_point": PathPoint,
    "chip_tooth_load": ToothLoad,
    "chip_brink_force": BrinkForce,
    "chip_tooth_weights": ToothWeights,
    "chip_tooth": Tooth,
    "chip_tool_ring": ToolRing,
    "chip_tool": Tool,
    "chip_clamp": Clamp,
    "chip_clamp_table": ClampTable,
    "chip_clamp_body": ClampBody,
    "chip_clamp_in": ClampIn,
    "chip_clamps": Clamps,
    "chip_predicted_path": PredictedPath,
    "chip_cell": Cell,
    "chip_levels": Levels,
    "chip_stock": Stock,
    "chip_section": Section,
    "chip_load_interval": LoadInterval,
    "chip_lookahead": Lookahead,
    "chip_load_step": LoadStep,
    "chip_load_profile": LoadProfile,
    "chip_pace": Pace,
    "chip_pace_in": PaceIn,
    "chip_sweep": Sweep,
    "chip_guard_in": GuardIn,
    "chip_guard_probe": GuardProbe,
    "chip_guard_blend": GuardBlend,
    "chip_guard": Guard,
    "chip_tracker_in": TrackerIn,
    "chip_tracker_out": TrackerOut,
    "chip_tracker": Tracker,
    "chip_path_done": PathDone,
    "chip_path_thinner": PathThinner,
    "chip_tracer_settings": TracerSettings,
    "chip_tracer_in": TracerIn,
    "chip_tracer_out": TracerOut,
    "chip_tracer_point": TracerPoint,
    "chip_tracer_law": TracerLaw,
    "chip_tracer_sensor": TracerSensor,
    "chip_tracer": Tracer,
    "chip_stylus_settings": StylusSettings,
    "chip_stylus": Stylus,
    "chip_packet": Packet,
    "chip_master": Master,
    "chip_slave_settings": SlaveSettings,
    "chip_slave": Slave,
    "chip_axis_offset_settings": AxisOffsetSettings,
    "chip_axis_offset_in": AxisOffsetIn,
    "chip_axis_offset_out": AxisOffsetOut,
    "chip_axis_offset": AxisOffset,
    "chip_spindle_settings": SpindleSettings,
    "chip_spindle_sim": SpindleSim,
    "chip_spindle_shown": SpindleShown,
    "chip_load_in": LoadIn,
    "chip_load_idle": LoadIdle,
    "chip_spindle_load": SpindleLoad,
    "chip_height_map": HeightMap,
    "chip_height_tool": HeightTool,
    "chip_height_met": HeightMet,
    "chip_height_traverses": HeightTraverses,
    "chip_lane": Lane,
    "chip_drop_mesh": DropMesh,
    "chip_drop_tool": DropTool,
    "chip_proof_stock": ProofStock,
    "chip_proof_tool": ProofTool,
    "chip_proof_path": ProofPath,
    "chip_proof_found": ProofFound,
    "chip_tracer_row": TracerRow,
    "chip_engage_rule": EngageRule,
    "chip_element_tree": ElementTree,
    "chip_raster": Raster,
}
