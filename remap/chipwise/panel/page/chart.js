'use strict';
// Gauge and strip chart of the load. SPDX-License-Identifier: GPL-2.0-or-later
// Both are drawn from the state as panel.js keeps it; `unit` shows a rate of mm3/min in the operator's unit.

const CHART_S = 60;
const CHART_FONT = '13px sans-serif';

// The 2D context of a canvas whose pixels are those of the screen; [context, width, height] in CSS pixels.
function sheet(canvas) {
    const scale = window.devicePixelRatio || 1, width = Math.max(1, canvas.clientWidth), height = Math.max(1, canvas.clientHeight);
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
        Object.assign(canvas, {width: Math.round(width * scale), height: Math.round(height * scale)});
    }
    const context = canvas.getContext('2d');
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    context.font = CHART_FONT;
    return [context, width, height];
}

// A round number at or above `value`.
function roundUp(value) {
    const ten = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
    return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].find((k) => k * ten >= value * 0.999999) * ten;
}

// The top of a scale for values up to `value`; 1 while there are none.
function topOf(value) {
    return value > 1e-3 ? roundUp(value) : 1;
}

// Half a ring: the rate or another value, and marks at the limits {target, lower}.
// name: what it is the share of.
function drawGauge(canvas, rate, limits, unit, name, colour) {
    const [context, width, height] = sheet(canvas);
    const most = topOf(Math.max(unit(limits.target) * 1.25, unit(rate)));
    const radius = Math.min(width / 2 - 26, height - 38), x = width / 2, y = height - 22;
    const angle = (value) => Math.PI * (1 + Math.min(1, Math.max(0, value / most)));
    const ring = (from, to, ink, thick) => {
        context.beginPath();
        context.strokeStyle = ink;
        context.lineWidth = thick;
        context.arc(x, y, radius, from, to);
        context.stroke();
    };
    ring(Math.PI, 2 * Math.PI, colour('line'), 16);
    ring(Math.PI, angle(unit(rate)), colour('rate'), 16);
    for (const limit of [limits.target, limits.lower]) {
        const at = angle(unit(limit));
        if (limit > 0) ring(at - 0.015, at + 0.015, colour('limit'), 28);
    }
    context.fillStyle = colour('ink');
    context.textAlign = 'center';
    context.font = 'bold 26px sans-serif';
    context.fillText(unit(rate).toPrecision(3), x, y - 8);
    context.font = CHART_FONT;
    context.fillText(name, x, y + 16);
    context.fillText('0', x - radius, y + 16);
    context.fillText(String(Number(most.toPrecision(3))), x + radius, y + 16);
}

// The last CHART_S: rows of [time s, rate, target, override, loads, predicted W, measured W]. plot (loads.js) has what is drawn of a row: its value, the
// mark for it as a dashed line, a share, drawn as the override is from 0 to the largest of both, 100 % at least; and their names {value, mark, override, share}.
function drawChart(canvas, rows, plot, colour) {
    const [context, width, height] = sheet(canvas), left = 46, low = height - 20, up = 26;      // above it what the colours mean
    const now = rows.length ? rows[rows.length - 1][0] : 0;
    const most = topOf(Math.max(0, ...rows.map((row) => 1.1 * Math.max(plot.value(row), plot.mark(row)))));
    const x = (time) => left + (width - left - 6) * (1 - (now - time) / CHART_S), y = (value) => low - (low - up) * value / most;
    context.strokeStyle = colour('line');
    context.fillStyle = colour('faint');
    context.lineWidth = 1;
    context.textAlign = 'right';
    for (const share of [0, 0.5, 1]) {
        context.beginPath();
        context.moveTo(left, y(share * most));
        context.lineTo(width - 6, y(share * most));
        context.stroke();
        context.fillText(String(Number((share * most).toPrecision(3))), left - 4, y(share * most) + 4);
    }
    context.textAlign = 'center';
    for (let s = 0; s <= CHART_S; s += 15) context.fillText(`${-s} s`, Math.min(width - 20, x(now - s)), height - 5);
    const shared = rows.some((row) => plot.share(row) > 0), names = plot.names;
    const full = Math.max(1, ...rows.map((row) => Math.max(row[3], plot.share(row))));
    const curve = (height, ink, thick, dashes, shown) => {
        context.beginPath();
        context.strokeStyle = ink;
        context.lineWidth = thick;
        context.setLineDash(dashes);
        let on = false;
        for (const row of rows) {
            if (shown(row)) on ? context.lineTo(x(row[0]), height(row)) : context.moveTo(x(row[0]), height(row));
            on = shown(row);
        }
        context.stroke();
        context.setLineDash([]);
    };
    curve((row) => low - (low - up) * row[3] / full, colour('override'), 1.5, [2, 2], () => true);
    if (shared) curve((row) => low - (low - up) * plot.share(row) / full, colour('ink'), 1.5, [], (row) => plot.share(row) > 0);
    curve((row) => y(plot.value(row)), colour('rate'), 2, [], () => true);
    curve((row) => y(plot.mark(row)), colour('limit'), 2, [6, 4], (row) => plot.mark(row) > 0);
    drawNames(context, left, 14, [['rate', names.value], ['limit', names.mark], ['override', `${names.override}, ${Math.round(100 * full)} %`],
                                 ...(shared ? [['ink', names.share]] : [])], colour);
}

// What the colours mean, one beside the other: [[colour, words], ..].
function drawNames(context, x, y, names, colour) {
    context.textAlign = 'left';
    for (const [item, words] of names) {
        context.fillStyle = colour(item);
        context.fillRect(x, y - 8, 10, 8);
        context.fillStyle = colour('ink');
        context.fillText(words, x + 14, y);
        x += Math.round(30 + context.measureText(words).width);
    }
}
