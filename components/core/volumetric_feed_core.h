/* volumetric_feed_core.h - the feed law and its watch, for volumetric_feed.comp (why here: see
 * stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/feed.c"
#include "core/obey.c"

typedef struct cw_feed_easing cw_feed_easing_t;
typedef struct cw_obey cw_obey_t;
