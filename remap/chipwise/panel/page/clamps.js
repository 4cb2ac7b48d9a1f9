'use strict';
// Clamps: draws those in force in the stock's picture, and lists the set-ups of the machine (clamps.json); with the token it adds and removes clamps (clamp) and has
// a set-up put in force (clamps). Places are mm, machine coordinates. SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const AXES = ['X', 'Y', 'Z'], SVG = 'http://www.w3.org/2000/svg', IN = 25.4, GAP = 0.08, ROUND = 32, DEEP = 0.25;
    const $ = (id) => document.getElementById(id);
    const {t, put, token, section, asked, view, hooks} = window.chipwise;
    let file = {set_ups: {}}, chosen = 0, drag = null, reach = null, shown = '', newest = null;

    const state = () => window.chipwise.state;
    const inch = () => Boolean(state() && state().task && state().task.inch);
    const unit = () => (inch() ? IN : 1);
    const text = (mm) => String(Number((mm / unit()).toFixed(inch() ? 4 : 3)));
    const field = (k) => $('clamps-n' + k);
    const inForce = () => (state() && state().clamps) || [];

    function says(words, wrong = false) {
        put('clamps-says', words);
        $('clamps-says').className = wrong ? 'wrong' : '';
    }

    // ---- in the picture of the stock ---------------------------------------------------------------------------

    // Corners of a clamp [shape, turn in degrees, [x, y], [half x, half y], top], seen from above.
    function outline([shape, turn, [x, y], [a, b]]) {
        if (shape) return Array.from({length: ROUND}, (_v, k) => [x + a * Math.cos(2 * Math.PI * k / ROUND), y + a * Math.sin(2 * Math.PI * k / ROUND)]);
        const c = Math.cos(turn * Math.PI / 180), s = Math.sin(turn * Math.PI / 180);
        return [[a, b], [-a, b], [-a, -b], [a, -b]].map(([u, v]) => [x + u * c - v * s, y + u * s + v * c]);
    }

    window.chipwise.outline = outline;

    // A clamp goes down as far as the table: it is drawn to the bottom of the stock, or a little below its top.
    function draw() {
        const gl = view.gl, map = view.map, ink = view.colours.clamp;
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        for (const clamp of inForce()) {
            const top = clamp[4] - map.z, low = Math.min(0, top - DEEP * map.high), ring = outline(clamp).map(([x, y]) => [x - map.x, y - map.y]);
            const closed = [...ring, ring[0]];
            view.drawLine(closed.flatMap(([x, y]) => [x, y, low, x, y, top]), gl.TRIANGLE_STRIP, [...ink, 0.45]);
            view.drawLine(ring.flatMap(([x, y]) => [x, y, top]), gl.TRIANGLE_FAN, [...ink, 0.7]);
            view.drawLine(closed.flatMap(([x, y]) => [x, y, top]), gl.LINE_STRIP, [...ink, 1]);
        }
        gl.disable(gl.BLEND);
    }

    function drawFlat(context, at) {
        context.fillStyle = `rgba(${view.colours.clamp.map((v) => Math.round(v * 255)).join(',')},0.7)`;
        for (const clamp of inForce()) {
            context.beginPath();
            outline(clamp).forEach((p) => context.lineTo(...at(p)));
            context.fill();
        }
    }

    if (view.gl) {
        const over = view.over;
        view.over = (matrix) => { draw(); over(matrix); };
    } else {
        const over = view.overFlat;
        view.overFlat = (context, at) => { drawFlat(context, at); over(context, at); };
    }

    // ---- the set-ups -------------------------------------------------------------------------------------------

    const numbers = () => Object.keys(file.set_ups).map(Number).sort((a, b) => a - b);

    function button(words, work) {
        const made = document.createElement('button');
        Object.assign(made, {type: 'button', textContent: words});
        made.addEventListener('click', () => Promise.resolve(work()).catch(trouble));
        return made;
    }

    function row(cells, buttons) {
        const made = document.createElement('tr');
        cells.forEach((words) => { made.insertCell().textContent = words; });
        made.insertCell().append(...buttons);
        return made;
    }

    function list() {
        const on = new Set(file.in_force);
        $('clamps-set-ups').replaceChildren(...numbers().map((number) => {
            const one = file.set_ups[number], made = row([`P${number}`, one.name, String(Object.keys(one.clamps).length), on.has(number) ? t('in force') : '-'],
                                                         [button(t('Show'), () => choose(number)), button(t('Switch on'), () => put_on(number))]);
            made.className = number === chosen ? 'inside' : '';
            return made;
        }));
        const clamps = chosen in file.set_ups ? file.set_ups[chosen].clamps : {};
        $('clamps-rows').replaceChildren(...Object.entries(clamps).map(([name, one]) => row(
            [name, t(NAMES[one.shape]), one.min.map(text).join(' '), one.max.map(text).join(' ')], [button(t('Remove'), () => change({remove: name}))])));
        put('clamps-count', `${t('Clamps in force')}: ${inForce().length}`);
        picture();
    }

    const NAMES = {box: 'box', cylinder: 'cylinder'};

    function choose(number) {
        chosen = number;
        $('clamps-number').value = String(number || Math.max(0, ...numbers()) + 1);
        $('clamps-title').value = number ? file.set_ups[number].name : '';
        list();
    }

    async function fetched() {
        const answer = await fetch('clamps.json', {cache: 'no-store'});
        if (!answer.ok) throw new Error(await answer.text());
        return answer.json();
    }

    // Reads may overlap, and an older answer may come later: all wait for the one begun last, and only that one is shown.
    function read() {
        const mine = fetched().then((all) => {
            if (mine !== newest) return newest;
            file = all;
            put('clamps-file', file.file);
            list();
        });
        newest = mine;
        return mine;
    }

    // ---- a new clamp -------------------------------------------------------------------------------------------

    function fields() {
        if (field(0)) return;
        for (const corner of [0, 1]) {
            AXES.forEach((axis, k) => {
                const input = document.createElement('input'), name = axis + (corner ? ' max' : ' min');
                Object.assign(input, {id: 'clamps-n' + (3 * corner + k), inputMode: 'decimal', autocomplete: 'off', maxLength: 20, ariaLabel: name, placeholder: name});
                input.addEventListener('input', picture);
                $('clamps-numbers').append(input);
            });
            const take = button(corner ? t('Second corner from the tool') : t('First corner from the tool'), () => fromTool(corner));
            take.id = 'clamps-take' + corner;
            $('clamps-numbers').append(take);
        }
    }

    async function fromTool(corner) {
        const place = (await asked('corner', {machine: true})).corner;
        AXES.forEach((_axis, k) => { field(3 * corner + k).value = text(place[k]); });
        picture();
    }

    function number(words, name) {
        if (!/^[-+]?(\d+(\.\d*)?|\.\d+)$/.test(words.trim())) throw new Error(`${name}: ${words} ${t('is not a number; write it with a point: 12.5')}`);
        return Number(words) * unit();
    }

    // The two corners in any order.
    function box() {
        const all = [0, 1, 2, 3, 4, 5].map((k) => number(field(k).value, field(k).placeholder));
        return [0, 1, 2].map((k) => Math.min(all[k], all[k + 3])).concat([0, 1, 2].map((k) => Math.max(all[k], all[k + 3])));
    }

    async function change(more) {
        const wanted = Number($('clamps-number').value);
        await asked('clamp', {set_up: wanted, title: $('clamps-title').value.trim(), ...more});
        await read();
        choose(wanted in file.set_ups ? wanted : 0);
        says(`${t('saved in')} ${file.file}`);
    }

    async function put_on(wanted) {
        says(t('Being done'));
        await asked('clamps', {set_up: wanted});
        await read();
        says(wanted ? `${t('in force')}: P${wanted}` : t('No clamp is in force'));
    }

    // ---- from above: clamps, stock and tool; a box that is drawn is a new clamp --------------------------------

    function place(e) {
        const at = new DOMPoint(e.clientX, e.clientY).matrixTransform($('clamps-picture').getScreenCTM().inverse());
        return [Math.round(10 * at.x) / 10, Math.round(-10 * at.y) / 10];
    }

    function polygon(points, name) {
        const made = document.createElementNS(SVG, 'polygon');
        made.setAttribute('points', points.map(([x, y]) => `${x.toFixed(3)},${(-y).toFixed(3)}`).join(' '));
        made.setAttribute('class', name);
        return made;
    }

    const square = ([x, y], [u, v]) => [[x, y], [u, y], [u, v], [x, v]];

    function picture() {
        const svg = $('clamps-picture'), map = view.map, shapes = [];
        if (map) shapes.push([square([map.x, map.y], [map.x + map.columns * map.cell, map.y + map.rows * map.cell]), 'stock']);
        const clamps = chosen in file.set_ups ? Object.values(file.set_ups[chosen].clamps) : [];
        for (const one of clamps) {
            const middle = [0, 1].map((k) => (one.min[k] + one.max[k]) / 2), half = [0, 1].map((k) => (one.max[k] - one.min[k]) / 2);
            shapes.push([outline([one.shape === 'cylinder', 0, middle, half]), 'clamp']);
        }
        for (const one of inForce()) shapes.push([outline(one), 'clamp on']);
        if (state()) shapes.push([outline([1, 0, state().tip, [Math.max(0.5, state().tool_diameter / 2), 0]]), 'tool']);
        try {
            const [x, y, , u, v] = box();
            shapes.push([square([x, y], [u, v]), 'clamp new']);
        } catch { /* not all numbers are there */ }
        const all = shapes.flatMap(([points]) => points);
        if (!drag && all.length) {
            const low = [0, 1].map((k) => Math.min(...all.map((p) => p[k]))), high = [0, 1].map((k) => Math.max(...all.map((p) => p[k])));
            const gap = GAP * Math.max(high[0] - low[0], high[1] - low[1], 10);
            reach = [low[0] - gap, -high[1] - gap, high[0] - low[0] + 2 * gap, high[1] - low[1] + 2 * gap];
            svg.setAttribute('viewBox', reach.join(' '));
        }
        svg.replaceChildren(...shapes.map(([points, name]) => polygon(points, name)));
    }

    $('clamps-picture').addEventListener('pointerdown', (e) => { if (reach) { drag = place(e); e.currentTarget.setPointerCapture(e.pointerId); } });
    $('clamps-picture').addEventListener('pointermove', (e) => {
        if (!drag) return;
        const here = place(e);
        [drag, here].forEach((p, corner) => [0, 1].forEach((k) => { field(3 * corner + k).value = text(p[k]); }));
        picture();
    });
    for (const end of ['pointerup', 'pointercancel']) $('clamps-picture').addEventListener(end, () => { drag = null; picture(); });

    // ---- the section -------------------------------------------------------------------------------------------

    const trouble = (error) => says(error.message, true);
    $('clamps-form').addEventListener('submit', (e) => {
        e.preventDefault();
        try { change({add: $('clamps-name').value.trim(), box: box()}).catch(trouble); } catch (error) { trouble(error); }
    });
    $('clamps-clear').addEventListener('click', () => put_on(0).catch(trouble));
    hooks.push(() => {                          // others change what is in force, too
        const now = JSON.stringify(inForce());
        if (now === shown) return;
        shown = now;
        if (!$('clamps').hidden) read().catch(trouble);
    });
    section('clamps', 'clamps-open', () => {
        fields();
        put('clamps-unit', inch() ? 'in' : 'mm');
        says(token() ? '' : t('Read-only: enter the token to change clamps'));
        read().then(() => choose(file.in_force[0] || numbers()[0] || 0)).catch(trouble);
    });
}());
