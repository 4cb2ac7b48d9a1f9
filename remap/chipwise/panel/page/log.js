'use strict';
// The log of the load: what each tool and each operation of the program did (log.json). SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const AGAIN_MS = 1000;
    const $ = (id) => document.getElementById(id);
    const {t, put, section, fill} = window.chipwise;
    const LIMITS = {nothing: 'nothing', stock: 'stock here', ahead: 'stock ahead', floor: 'feed floor', ceiling: 'feed ceiling',
                    fallback: 'F as programmed', chip: 'largest chip',
                    power: 'spindle power', torque: 'spindle torque', force: 'bending of the tool'};

    const inch = () => Boolean(window.chipwise.state && window.chipwise.state.task && window.chipwise.state.task.inch);
    const rate = (cm3) => (cm3 / (inch() ? 16.387064 : 1)).toPrecision(3);
    const length = (mm) => (inch() ? (mm / 25.4).toFixed(4) : mm.toFixed(2));
    const seconds = (s) => (s < 60 ? `${s.toFixed(1)} s` : `${Math.floor(s / 60)} min ${Math.floor(s % 60)} s`);

    const load = (row) => [row.reference_cm3_min > 0 ? rate(row.reference_cm3_min) : '-', rate(row.mean_cm3_min), rate(row.peak_cm3_min)];
    // The bound of which most was used, and the power as predicted and measured.
    const nearest = (row) => Object.keys(NAMES).map((name) => [name, row[name + '_percent']]).filter((one) => one[1] > 0).sort((a, b) => b[1] - a[1])
        .slice(0, 1).map(([name, percent]) => `${t(NAMES[name])} ${Math.round(percent)} %`)[0] || '-';
    const watts = (row) => [row.predicted_w, row.measured_w].map((w) => (w === '' ? '-' : Math.round(w))).join(' / ').replace(/^- \/ -$/, '-');
    const reaction = (row) => [t(LIMITS[row.limited_by]), nearest(row), watts(row), seconds(row.over_s), row.stops];
    const lines = (row) => (row.last_line === row.line ? `${row.line}` : `${row.line}-${row.last_line}`);
    const tool = (row) => [`${row.tool}: ${length(row.diameter_mm)}`, ...load(row), seconds(row.cutting_s), seconds(row.slowed_s), ...reaction(row)];
    const operation = (row) => [row.operation, `${row.code} ${lines(row)}`.trim(), row.tool, ...load(row), seconds(row.seconds), seconds(row.cutting_s),
                                ...reaction(row)];
    const held = (rows) => rows.map((row) => (row.stops || row.over_s > 0 ? 'held' : ''));

    async function look() {
        const answer = await fetch('log.json');
        if (!answer.ok) throw new Error(await answer.text());
        const found = await answer.json(), newest = found.operations.slice().reverse();
        put('log-program', found.program);
        put('log-unit', inch() ? 'in3/min, in, W' : 'cm3/min, mm, W');
        put('log-file', found.error || (found.file ? `${t('File')}: ${found.file}` : t('No file: set [CHIPWISE]PANEL_LOG')));
        fill($('log-tools'), found.tools.map(tool), held(found.tools));
        fill($('log-operations'), newest.map(operation), held(newest));
        put('log-count', found.count > newest.length ? `${newest.length} / ${found.count}` : '');
    }

    async function follow() {
        while (!$('log').hidden) {
            await look().catch((error) => put('log-file', error.message));
            await new Promise((done) => setTimeout(done, AGAIN_MS));
        }
    }

    section('log', 'log-open', follow);
}());
