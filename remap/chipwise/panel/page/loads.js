'use strict';
// Which limit gauge and chart show, and its words. SPDX-License-Identifier: GPL-2.0-or-later
// What limits the feed, too. A view is 'rate', 'nearest' (the largest share of a bound), the name of one limit, or 'watts': predicted against measured power.

const LIMITS = {nothing: 'nothing', stock: 'stock here', ahead: 'stock ahead', floor: 'feed floor', ceiling: 'feed ceiling',
                fallback: 'no stock or tool known: F as programmed', chip: 'largest chip',
                power: 'spindle power', torque: 'spindle torque', force: 'bending of the tool'};
const NAMES = {rate: 'Removal rate', chip: LIMITS.chip, power: LIMITS.power, torque: LIMITS.torque, force: LIMITS.force};

// The loads {name: share of its bound} of a state, the largest first: [[name, share], ..].
function byShare(loads) {
    return Object.entries(loads || {}).sort((a, b) => b[1] - a[1]);
}

// What can be shown of a state: the nearest limit and each one, where chip, power, torque or bending have bounds, else the rate; power, where it is measured.
function viewsOf(state) {
    const known = Object.keys(NAMES).filter((name) => name in state.loads);
    return [...(known.length ? ['nearest', ...known] : ['rate']), ...(state.power && state.power.measured !== null ? ['watts'] : [])];
}

// t: translates; put: shows the text of a figure.
function makeLoads(t, put) {
    const chosen = {view: ''};
    const view = (state) => (state && viewsOf(state).includes(chosen.view) ? chosen.view : state ? viewsOf(state)[0] : 'rate');
    const named = (name) => t(NAMES[name]);
    const only = (id, text) => {
        const shown = document.getElementById(id);
        put(id, text);
        shown.hidden = shown.previousElementSibling.hidden = !text;
    };

    return {
        view,
        // What limits the feed; at F for a fault, its sentence is among the alarms.
        limit: (state) => (state.limited_by === 'fallback' && state.fault ? t('a fault, see Alarms: F as programmed') : t(LIMITS[state.limited_by])),
        // The next view, at a press.
        next(state) {
            const all = viewsOf(state);
            chosen.view = all[(all.indexOf(view(state)) + 1) % all.length];
        },
        // Arguments of drawGauge(): the rate, a share of a bound in per cent, or the power that is measured with a mark at the one predicted.
        gauge(state, unit) {
            const found = view(state), same = (value) => value;
            if (found === 'rate' && !('rate' in state.loads)) return [state.mrr, state, unit, ''];
            if (found === 'watts') return [state.power.measured, {target: state.power.predicted, lower: 0}, same, `W ${t('measured')}`];
            const [name, share] = found === 'nearest' ? byShare(state.loads)[0] : [found, state.loads[found]];
            return [100 * share, {target: 100, lower: 0}, same, `% ${named(name)}`];
        },
        // What drawChart() draws of its rows.
        chart(state, unit) {
            const found = view(state);
            if (found === 'watts') {
                return {value: (row) => row[6] || 0, mark: (row) => row[5] || 0, share: () => 0,
                        names: {value: `${t('Measured power')}, W`, mark: t('Predicted power'), override: t('Override'), share: ''}};
            }
            const one = NAMES[found] ? `, ${named(found)}` : '';
            return {value: (row) => unit(row[1]), mark: (row) => unit(row[2]),
                    share: (row) => (found === 'nearest' || !one ? Math.max(0, ...Object.values(row[4] || {})) : (row[4] || {})[found] || 0),
                    names: {value: t('Removal rate'), mark: t('Target'), override: t('Override'), share: t('Share of the limit') + one}};
        },
        // The figures: all shares, and the power where something is known of it: measured, and how much that is of what the tool was taught to take.
        figures(state) {
            const shares = byShare(state.loads).map(([name, share]) => `${named(name)} ${Math.round(100 * share)} %`.replaceAll(' ', '\u00a0'));
            put('share', shares.join(', ') || '-');
            document.getElementById('share').classList.toggle('wide', shares.length > 1);
            const power = state.power, ofTaught = power && power.ratio > 0 && power.factor > 0 ? `, ${Math.round(100 * power.ratio / power.factor)} %` : '';
            only('predicted', power ? `${Math.round(power.predicted)} W` : '');
            only('measured', power && power.measured !== null ? `${Math.round(power.measured)} W${ofTaught}` : '');
        },
    };
}
