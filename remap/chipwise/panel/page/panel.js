'use strict';
// The page of `chipwise panel`: reads the stream of messages (server.py has their kinds) and shows them.
// SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const MM3_PER = {cm3: 1000, in3: 16387.064};
    const AGAIN_MS = 2000;              // until a stream that has ended is asked for again
    const LATE_MS = 4000;               // without a message: the page says so
    const KEEP_S = 60;
    const $ = (id) => document.getElementById(id);
    const root = document.documentElement;
    const language = () => new URLSearchParams(location.search).get('lang') || '';
    // Asked for before the view is made: the answers come while the graphics processor compiles.
    const askedFor = (path) => { const answer = fetch(path, {cache: 'no-store'}); answer.catch(() => {}); return answer; };
    const early = {stream: askedFor('stream'), texts: ['strings.json?' + language(), 'about.json'].map(askedFor)};
    let words = {}, state = null, rows = [], points = [], pathEpoch = 0, epoch = 0, canChange = false, local = true, wholeHistory = false, heard = 0;
    let heights = null, earlier = null;         // of the map, as it is and as it was before the program: Uint16Array, row by row
    const hooks = [];                           // what else draws a state
    let seen = new Set(), due = false, ageMs = [], firstPicture = 0, drawn = 0;
    const t = (text) => words[text] || text;
    const colour = (name) => getComputedStyle(root).getPropertyValue('--' + name).trim();
    const rgb = (name) => colour(name).match(/[0-9a-f]{2}/gi).map((part) => parseInt(part, 16) / 255);
    const colours = () => ({background: rgb('background'), uncut: rgb('stock'), shallow: rgb('stock-cut'), deep: rgb('stock-deep'),
                            path: rgb('path-done'), tool: rgb('tool'), ahead: rgb('path-ahead'), rapid: rgb('rapid'), target: rgb('target'), clamp: rgb('clamp')});
    const view = makeHeightView($('view'), colours(), new URLSearchParams(location.search).has('flat'));
    const ahead = makeAhead(view, () => view.colours);
    view.listen(show);

    // ---- words and units -----------------------------------------------------------------------------------------

    const inch = () => Boolean(state && state.task && state.task.inch);
    const rateUnit = () => (inch() ? 'in3/min' : 'cm3/min');
    const toRate = (mm3) => mm3 / MM3_PER[inch() ? 'in3' : 'cm3'];
    const rateText = (mm3) => `${toRate(mm3).toPrecision(3)} ${rateUnit()}`;
    const length = (mm) => (inch() ? `${(mm / 25.4).toFixed(4)} in` : `${mm.toFixed(2)} mm`);
    const fine = (mm) => (inch() ? `${(mm / 25.4).toFixed(5)} in` : `${mm.toFixed(4)} mm`);
    const speed = (mm) => (inch() ? `${(60 * mm / 25.4).toFixed(2)} in/min` : `${(60 * mm).toFixed(0)} mm/min`);
    const area = (mm2) => (inch() ? `${(mm2 / 645.16).toFixed(4)} in2` : `${mm2.toFixed(2)} mm2`);
    const seconds = (s) => (s < 60 ? `${s.toFixed(1)} s` : `${Math.floor(s / 60)} min ${Math.round(s % 60)} s`);

    const STATUS = {off: 'The machine is off', calm: 'Ready', cutting: 'Cutting', limited: 'Slower than F', over: 'Above the target', alarm: 'Alarm'};
    const MODES = {off: 'off', limit: 'limit', constant: 'constant', window: 'window'};

    // ---- what is shown -------------------------------------------------------------------------------------------

    const put = (id, text) => { if ($(id).textContent !== text) $(id).textContent = text; };
    const loads = makeLoads(t, put);

    function show() {
        if (!due) requestAnimationFrame(() => { due = false; draw(); });
        due = true;
    }

    function draw() {
        view.draw();
        drawChart($('chart'), rows, loads.chart(state, toRate), colour);
        if (!state) return;
        drawGauge($('gauge'), ...loads.gauge(state, toRate), colour);
        figures();
        if (window.chipwise.fill) tools();          // sections.js
        alarms();
        hooks.forEach((work) => work());
        measure();
    }

    // How old a state is when it is drawn, and when the first picture of the stock was, for the benchmark.
    function measure() {
        if (drawn === state.clock) return;
        drawn = state.clock;
        ageMs = ageMs.concat(Date.now() - 1000 * state.clock).slice(-200);
        if (view.map) firstPicture = firstPicture || performance.now();
    }

    function figures() {
        const s = state, run = s.run, task = s.task;
        document.body.dataset.state = late() ? 'off' : s.background;
        put('status', late() ? t('No answer from LinuxCNC') : !task ? t('LinuxCNC does not answer') : t(STATUS[s.background]));
        put('program', task ? task.program : '');
        assumed(s);
        put('rate', rateText(s.mrr));
        put('target', s.target > 0 ? rateText(s.target) : '-');
        put('mode', t(MODES[s.mode]));
        put('limit', loads.limit(s));
        loads.figures(s);
        put('feed', speed(s.current_vel));
        put('tooth', s.feed_per_tooth > 0 ? fine(s.feed_per_tooth) : '-');
        put('programmed', s.programmed_vel > 0 || s.requested_vel > 0 ? speed(s.programmed_vel || s.requested_vel) : '-');
        put('override', `${Math.round(s.override * 100)} %`);
        put('area', area(s.area));
        put('ahead', area(s.area_ahead));
        put('depth', length(s.depth));
        put('flutes', s.tool_flute_length > 0 ? length(s.tool_flute_length) : '-');
        put('tool', s.tool > 0 ? `${s.tool}: ${length(s.tool_diameter)}` : '-');
        put('line', s.line > 0 ? String(s.line) : '-');
        put('peak', run ? rateText(run.peak) : '-');
        put('mean', run ? rateText(run.mean) : '-');
        put('time', run ? seconds(run.seconds) : '-');
        put('air', run && run.air_share !== null ? `${Math.round(100 * run.air_share)} %` : '-');
        put('saved', run && run.saved !== null ? `${run.saved < 0 ? '-' : ''}${seconds(Math.abs(run.saved))}` : '-');
        put('removed', inch() ? `${(s.removed / MM3_PER.in3).toFixed(3)} in3` : `${(s.removed / MM3_PER.cm3).toFixed(2)} cm3`);
        put('work', `${s.work} %`);
        put('log-error', s.log_error);
        put('stock-note', window.chipwise.told('stock-note') || s.stock_error || (s.stock ? (s.ready ? doubt(s.doubt) : t('The feed is F as programmed')) : t('No stock is defined; use M250')) || pathNote(s.ahead));
    }

    // What depends on a stock or a tool that nobody has confirmed is marked.
    function assumed(s) {
        $('assumed').hidden = $('assumed-figures').hidden = !s.assumed;
        document.body.classList.toggle('assumed', s.assumed);
        document.body.classList.toggle('assumed-tool', s.tool_assumed);
    }

    const doubt = (mm) => (mm > 0 ? `${t('A probed blank: higher than the part by up to')} ${length(mm)}` : '');

    // Why the path ahead ends before the program does.
    const pathNote = (a) => (a.note ? `${t('Path ahead')}${a.line ? `, ${t('Line')} ${a.line}` : ''}: ${t(a.note)}` : '');

    // The tools of the program: rates in the operator's unit, times in s.
    function tools() {
        const rate = (cm3) => toRate(1000 * cm3).toPrecision(3);
        const rows = state.tools.map((use) => [use.tool, rate(use.mean_cm3_min), rate(use.peak_cm3_min), `${use.cutting_s} s`,
                                               `${use.slowed_s} s`, use.stops]);
        window.chipwise.fill($('tool-rows'), rows);
    }

    function alarms() {
        const shown = state.alarms.filter((a) => wholeHistory || a.active || !(a.cleared || seen.has(a.id))).slice().reverse();
        const key = JSON.stringify([shown, words['Alarms'], wholeHistory]);
        if ($('alarm-list').dataset.key === key) return;
        $('alarm-list').dataset.key = key;
        $('alarm-list').replaceChildren(...shown.map(alarmItem));
    }

    function alarmItem(alarm) {
        const item = document.createElement('li'), text = document.createElement('span'), where = document.createElement('span');
        const at = new Date(alarm.time * 1000).toLocaleTimeString();
        text.textContent = `${at} ${t(alarm.what)}${alarm.remedy ? '; ' + t(alarm.remedy) : ''}`;
        where.textContent = `${alarm.line > 0 ? `${t('Line')} ${alarm.line}` : 'MDI'}, ${t('Tool')} ${alarm.tool}`;
        item.className = alarm.active ? 'active' : alarm.cleared || seen.has(alarm.id) ? 'cleared' : '';
        item.dataset.item = alarm.item;
        item.append(text, where);
        return item;
    }

    function rights() {
        put('rights', !canChange ? t('Read-only') : token() ? t('Unlocked') : t('Locked'));
        $('unlock').hidden = !canChange || Boolean(token());
        if (window.chipwise.onRights) window.chipwise.onRights();
    }

    // ---- the stream ----------------------------------------------------------------------------------------------

    const late = () => heard > 0 && Date.now() - heard > LATE_MS;
    const json = (bytes) => JSON.parse(new TextDecoder().decode(bytes));

    function stock(found) {
        epoch = found.epoch;
        heights = new Uint16Array(found.rows * found.columns);
        earlier = null;
        view.begin({rows: found.rows, columns: found.columns, cell: found.cell, high: found.top - found.bottom, x: found.x, y: found.y,
                    z: found.bottom});
        compared();
        place();
    }

    // The stock before the program.
    function before(bytes) {
        const head = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
        if (head.getUint32(0, true) !== epoch || ![4, 4 + heights.byteLength].includes(bytes.byteLength)) return;
        earlier = bytes.byteLength > 4 ? new Uint16Array(bytes.slice(4).buffer) : null;
        compared();
    }

    const pressed = (id) => $(id).getAttribute('aria-pressed') === 'true';

    function press(id, on) {
        $(id).setAttribute('aria-pressed', String(on));
        ahead.show({path: pressed('path-ahead'), loops: pressed('contours')});
        if (view.map) compared();
        show();
    }

    // What is drawn as cut, and which of the two stocks is drawn.
    function compared() {
        view.before(earlier && pressed('this-run') ? earlier : null);
        view.put(0, 0, view.map.columns, view.map.rows, earlier && pressed('before') ? earlier : heights);
    }

    function tiles(bytes) {
        const head = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
        if (head.getUint32(0, true) !== epoch) return;
        for (let at = 4; at < bytes.byteLength;) {
            const [column, row, columns, count] = [0, 2, 4, 6].map((k) => head.getUint16(at + k, true));
            const size = columns * count * 2;
            const part = new Uint16Array(bytes.slice(at + 8, at + 8 + size).buffer);
            for (let j = 0; j < count; j++) heights.set(part.subarray(j * columns, (j + 1) * columns), (row + j) * view.map.columns + column);
            if (!(earlier && pressed('before'))) view.put(column, row, columns, count, part);
            at += 8 + size;
        }
    }

    // Path and tool from machine coordinates to the map's corner.
    function place() {
        const map = view.map;
        if (!map) return;
        const local = (p) => [p[0] - map.x, p[1] - map.y, p[2] - map.z];
        const goesOn = state && state.task && state.task.running && state.path[0] === pathEpoch;     // the last point is the last corner
        view.path((goesOn ? [...points, state.tip] : points).map(local));
        if (!state || !(state.tool_diameter > 0)) return view.tool(null);
        const [x, y, z] = local(state.tip);
        view.tool({x, y, z, radius: state.tool_diameter / 2});
    }

    function path(found) {
        points = found.epoch === pathEpoch ? points.concat(found.points).slice(-10000) : found.points;
        pathEpoch = found.epoch;
    }

    function now(found) {
        state = found;
        rows.push([found.time, found.mrr, found.target, found.override, found.loads, ...(found.power ? [found.power.predicted, found.power.measured] : [0, null])]);
        while (rows.length && rows[0][0] < found.time - KEEP_S) rows.shift();
        ahead.now(found.ahead, found.tip);
        place();
    }

    const KINDS = {R: (b) => { rows = json(b); }, P: (b) => path(json(b)), S: (b) => now(json(b)), M: (b) => stock(json(b)), T: tiles, B: before,
                   A: ahead.path, C: (b) => ahead.loops(json(b))};

    // Whole messages out of what has come; -> the rest.
    function consume(bytes) {
        let at = 0;
        while (bytes.length - at >= 5) {
            const size = new DataView(bytes.buffer, bytes.byteOffset + at + 1, 4).getUint32(0, true);
            if (bytes.length - at < 5 + size) break;
            const kind = KINDS[String.fromCharCode(bytes[at])];
            if (kind) kind(bytes.subarray(at + 5, at + 5 + size));
            at += 5 + size;
        }
        return bytes.subarray(at);
    }

    function joined(parts, size) {
        const all = new Uint8Array(size);
        parts.reduce((at, part) => { all.set(part, at); return at + part.length; }, 0);
        return all;
    }

    async function follow() {
        const asked = early.stream || askedFor('stream');
        early.stream = null;
        const answer = await asked;
        if (!answer.ok) throw new Error(await answer.text());
        const reader = answer.body.getReader();
        let parts = [], size = 0, wanted = 5;
        for (;;) {
            const {done, value} = await reader.read();
            if (done) return;
            heard = Date.now();
            parts.push(value);
            size += value.length;
            if (size < wanted) continue;
            const rest = consume(joined(parts, size)).slice();
            wanted = rest.length >= 5 ? 5 + new DataView(rest.buffer).getUint32(1, true) : 5;
            parts = rest.length ? [rest] : [];
            size = rest.length;
            show();
        }
    }

    async function followForEver() {
        for (;;) {
            try {
                await follow();
            } catch (error) {
                put('status', error.message);
            }
            heard = heard || 1;
            document.body.dataset.state = 'off';
            put('status', t('No answer from LinuxCNC'));
            await new Promise((done) => setTimeout(done, AGAIN_MS));
        }
    }

    // ---- what the operator does ----------------------------------------------------------------------------------

    const token = () => sessionStorage.getItem('chipwise-token') || '';

    async function change(path, wanted, given = token()) {
        const answer = await fetch(path, {method: 'POST', body: JSON.stringify(wanted),
                                          headers: {'X-Chipwise-Token': given, 'Content-Type': 'application/json'}});
        return answer.ok ? '' : answer.text();
    }

    function theme(name) {
        root.dataset.theme = name;
        localStorage.setItem('chipwise-theme', name);
        view.recolour(colours());
        show();
    }

    $('gauge-next').addEventListener('click', () => { if (state) loads.next(state); show(); });
    $('theme').addEventListener('click', () => theme(root.dataset.theme === 'dark' ? 'light' : 'dark'));
    $('above').addEventListener('click', () => { view.above(true); show(); });
    $('slanted').addEventListener('click', () => { view.above(false); show(); });
    for (const id of ['this-run', 'before', 'path-ahead', 'contours']) $(id).addEventListener('click', () => press(id, !pressed(id)));
    $('history').addEventListener('click', () => {
        wholeHistory = !wholeHistory;
        $('history').setAttribute('aria-pressed', String(wholeHistory));
        show();
    });
    $('clear').addEventListener('click', async () => {
        if (!state) return;
        state.alarms.filter((a) => !a.active).forEach((a) => seen.add(a.id));
        if (token()) put('token-answer', await change('clear', {}));
        show();
    });
    $('unlock').addEventListener('click', () => { $('token').hidden = false; $('token-text').focus(); });
    $('token').addEventListener('submit', async (e) => {
        e.preventDefault();
        const given = $('token-text').value, refused = await change('token', {}, given);
        put('token-answer', refused);
        if (refused) return;
        sessionStorage.setItem('chipwise-token', given);
        $('token-text').value = '';
        $('token').hidden = true;
        rights();
    });
    window.addEventListener('resize', show);
    setInterval(() => { if (late()) show(); }, 1000);

    async function begin() {
        const [found, about] = await Promise.all(early.texts.map(async (answer) => (await answer).json()));
        words = found.strings;
        root.lang = found.language;
        document.querySelectorAll('[data-t]').forEach((e) => { e.textContent = t(e.dataset.t); });
        canChange = about.can_change;
        local = about.local;
        rights();
        show();
    }

    window.chipwise = {t, change, token, put, language, show, view, ahead, loads, hooks, told: () => '', get canChange() { return canChange; },
                       get local() { return local; }, get earlier() { return earlier; }, get state() { return state; }, get rows() { return rows; }, get ageMs() { return ageMs; },
                       get firstPicture() { return firstPicture; }};     // for entry.js, the console, and tests
    theme(localStorage.getItem('chipwise-theme') || (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light'));
    begin().catch((error) => put('status', error.message));
    followForEver();
}());
