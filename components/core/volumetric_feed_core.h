/* volumetric_feed_core.h - the feed law, for volumetric_feed.comp (why here: see
 * stock_tracker_core.h). */
#define CHIPWISE_RTAPI
#include "core/feed.c"
