# SPDX-License-Identifier: GPL-2.0-or-later
"""The HAL pins of chipwise-monitor.  Called by cli/monitor.py."""

from chipwise.host.halcmd import halcmd, signal_of
from chipwise.monitor import known, set_up_time, takeover

COMPONENT = 'chipwise-monitor'


def make_component():
    """(the component, whether it has taken over the pins of one that was killed)."""
    import hal
    name, dead = takeover.choose_name(COMPONENT)
    component = hal.component(name)
    for name in ('tool-diameter', 'tool-corner-radius', 'tool-tip-angle', 'tool-flute-length', 'tool-stick-out', 'tool-holder-diameter'):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    for name in ('tool-number', 'tool-followed', 'heartbeat', 'program-loaded', 'program-mark', 'job-stock', *known.PINS):
        component.newpin(name, hal.HAL_S32, hal.HAL_OUT)
    for name in ('tool-max-rate', 'tool-flutes', 'max-chip', 'min-chip', 'max-power', 'max-force', 'tool-stiffness', 'specific-force', 'force-exponent', 'load-factor', 'stock-doubt'):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin('adaptive-off', hal.HAL_BIT, hal.HAL_OUT)
    component.newpin('feed-override', hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin('program-running', hal.HAL_BIT, hal.HAL_OUT)
    for name in ('reply', 'parts'):
        component.newpin(name, hal.HAL_S32, hal.HAL_OUT)
    for name in ('job-target', 'job-ceiling', *set_up_time.PINS):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_OUT)
    for name in ('hold', 'assumed', 'tool-assumed', 'job', 'job-waits', 'job-air'):
        component.newpin(name, hal.HAL_BIT, hal.HAL_OUT)
    for name in ('ready', 'fault', 'load-lost', 'override-ignored', 'held', 'stock-defined', 'certain', 'job-active', 'feed-carried', 'new-part'):
        component.newpin(name, hal.HAL_BIT, hal.HAL_IN)
    for name in ('guard-distance', 'guard-depth', 'mrr-target', 'load-cut-factor', 'load-ratio'):
        component.newpin(name, hal.HAL_FLOAT, hal.HAL_IN)
    for name in ('fault-code', 'limited-by', 'mode', 'request', 'slot', 'guard-reason', 'guard-line', 'tool-in-spindle', 'run-end', 'path-refused', 'guard-clamp', 'guard-part', 'clamps-taken', 'load-alarm', 'load-cuts'):
        component.newpin(name, hal.HAL_S32, hal.HAL_IN)
    if dead:
        takeover.take_over(component, dead, hal.get_value)
    else:
        signal = signal_of('stock-tracker.0.tool-in-spindle')
        if signal:                        # the machine's own tool number, by whatever name
            halcmd('net', signal, component.getprefix() + '.tool-in-spindle')
    return component, bool(dead)
