'use strict';
// The set-up of the loaded program: measures it (measure), shows its path in the stock and a row for each tool, and with the token confirms it (confirm).
// SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const AXES = ['X', 'Y', 'Z'], SVG = 'http://www.w3.org/2000/svg', GAP = 0.08;
    const CM3 = 1000, IN = 25.4;
    const $ = (id) => document.getElementById(id);
    const {t, put, token, section, fill, asked} = window.chipwise;
    let found = null;                   // the last answer of measure
    let own = false;                    // whether the six numbers are a person's

    const inch = () => Boolean(window.chipwise.state && window.chipwise.state.task && window.chipwise.state.task.inch);
    const unit = () => (inch() ? IN : 1);
    const field = (k) => $('setup-n' + k);
    const shown = (mm) => String(Number((mm / unit()).toFixed(inch() ? 4 : 3)));

    function says(text, wrong = false) {
        put('setup-says', text);
        $('setup-says').className = wrong ? 'wrong' : '';
    }

    // ---- the six numbers ---------------------------------------------------------------------------------------

    function fields() {
        if (field(0)) return;
        for (const corner of [0, 1]) {
            AXES.forEach((axis, k) => {
                const input = document.createElement('input');
                Object.assign(input, {id: 'setup-n' + (3 * corner + k), inputMode: 'decimal', autocomplete: 'off', maxLength: 20, ariaLabel: axis + (corner ? ' max' : ' min'),
                                      placeholder: axis + (corner ? ' max' : ' min')});
                input.addEventListener('input', changed);
                $('setup-numbers').append(input);
            });
            const take = document.createElement('button');
            Object.assign(take, {type: 'button', id: 'setup-take' + corner});
            take.addEventListener('click', () => fromTool(corner).catch(trouble));
            $('setup-numbers').append(take);
        }
        $('setup-take0').textContent = t('Lower corner from the tool');
        $('setup-take1').textContent = t('Upper corner from the tool');
    }

    // A number as it is typed, in mm.
    function number(text, name) {
        if (!/^[-+]?(\d+(\.\d*)?|\.\d+)$/.test(text.trim())) throw new Error(`${name}: ${text} ${t('is not a number; write it with a point: 12.5')}`);
        return Number(text) * unit();
    }

    const numbers = () => [0, 1, 2, 3, 4, 5].map((k) => number(field(k).value, field(k).placeholder));

    function putNumbers(values) {
        values.forEach((value, k) => { field(k).value = shown(value); });
    }

    // What was measured does not belong to these numbers any more.
    function changed() {
        own = true;
        put('setup-source', '');
        $('setup-confirm').disabled = true;
        try { picture(numbers()); } catch { picture(null); }
    }

    async function fromTool(corner) {
        const place = (await asked('corner', {measured: found ? found.measured : null})).corner;
        AXES.forEach((_axis, k) => { field(3 * corner + k).value = shown(place[k]); });
        changed();
    }

    // The allowance is stock at the sides and on top.
    function add() {
        const much = number($('setup-allowance').value, t('Allowance')), [x, y, z, u, v, w] = numbers();
        putNumbers([x - much, y - much, z, u + much, v + much, w + much]);
        $('setup-allowance').value = '';
        changed();
    }

    // ---- path and stock in one picture: from above, and from the front below it --------------------------------

    function picture(stock) {
        const path = found ? found.path : [], every = path.map((p) => p.slice(0, 3));
        if (stock) every.push(stock.slice(0, 3), stock.slice(3));
        const clamps = found && every.length ? sides(found.clamps, every.reduce((a, p) => Math.min(a, p[2]), Infinity)) : [];
        every.push(...clamps.flat(2));
        const svg = $('setup-picture');
        svg.replaceChildren();
        if (!every.length) return;
        const low = [0, 1, 2].map((k) => every.reduce((a, p) => Math.min(a, p[k]), Infinity)), high = [0, 1, 2].map((k) => every.reduce((a, p) => Math.max(a, p[k]), -Infinity));
        const wide = Math.max(high[0] - low[0], 1e-3), gap = GAP * Math.max(wide, high[1] - low[1]), deep = high[1] - low[1] + gap;
        svg.setAttribute('viewBox', `${low[0] - gap} ${-gap} ${wide + 2 * gap} ${deep + high[2] - low[2] + 2 * gap}`);
        const views = [(p) => [p[0], high[1] - p[1]], (p) => [p[0], deep + high[2] - p[2]]];
        views.forEach((view, k) => {
            for (const both of clamps) svg.append(polygon(both[k].map(view)));
            if (stock) svg.append(rectangle(view(stock.slice(0, 3)), view(stock.slice(3))));
            for (const piece of pieces(path)) {
                const line = document.createElementNS(SVG, 'polyline');
                line.setAttribute('points', piece.points.map((p) => view(p).map((v) => v.toFixed(3)).join()).join(' '));
                if (piece.rapid) line.setAttribute('class', 'rapid');
                svg.append(line);
            }
        });
    }

    // Of each clamp its outlines, from above and from the front; it is drawn down to the bottom of what there is, or to its own.
    function sides(clamps, lowest) {
        return clamps.map((one) => {
            const ring = window.chipwise.outline(one.seen), x = ring.map((p) => p[0]), a = Math.min(...x), b = Math.max(...x), y = one.seen[2][1];
            const bottom = Math.min(one.top, Math.max(one.bottom, lowest));
            return [ring.map(([u, v]) => [u, v, one.top]), [[a, y, bottom], [b, y, bottom], [b, y, one.top], [a, y, one.top]]];
        });
    }

    function polygon(points) {
        const made = document.createElementNS(SVG, 'polygon');
        made.setAttribute('points', points.map((p) => p.map((v) => v.toFixed(3)).join()).join(' '));
        return made;
    }

    function rectangle(a, b) {
        const made = document.createElementNS(SVG, 'rect');
        const values = {x: Math.min(a[0], b[0]), y: Math.min(a[1], b[1]), width: Math.abs(b[0] - a[0]), height: Math.abs(b[1] - a[1])};
        Object.entries(values).forEach(([name, value]) => made.setAttribute(name, value));
        return made;
    }

    function pieces(path) {
        const all = [];
        path.forEach((p, k) => {
            const last = all[all.length - 1], rapid = Boolean(p[3]);
            if (last && (last.rapid === rapid || k === 0)) last.points.push(p);
            else all.push({rapid, points: k ? [path[k - 1], p] : [p]});
        });
        return all;
    }

    // ---- what is measured and confirmed ------------------------------------------------------------------------

    async function measure() {
        const stock = own ? numbers() : null;
        $('setup-confirm').disabled = $('setup-measure').disabled = true;
        says(t('The program is being measured'));
        try {
            found = await asked('measure', {stock, material: $('setup-material').value.trim()});
        } finally {
            $('setup-measure').disabled = false;
        }
        const program = own && found.source === 'program';
        own = own && !program;
        putNumbers(found.stock);
        put('setup-source', t(NAMES[found.source]));
        put('setup-program', found.program);
        picture(found.stock);
        fill($('setup-rows'), found.tools.map(row));
        put('setup-clamps', found.clamps.length ? `${t('Clamps')}: ${found.clamps.map((one) => one.name).join('; ')}` : t('No clamps'));
        put('setup-notes', found.notes.concat(found.own_m251 ? [t('The program has M251 of its own, which wins')] : []).join('; '));
        rights();
        says(found.confirmed ? t('It is confirmed as it is') : token() ? t('Look at it, then confirm') : t('Read-only: enter the token to confirm'));
    }

    const NAMES = {program: 'of the program', comment: 'assumed from comments', option: 'as typed', assumed: 'assumed from the path'};
    const minutes = (s) => (s < 60 ? `${s.toFixed(1)} s` : `${Math.floor(Math.round(s) / 60)}:${String(Math.round(s) % 60).padStart(2, '0')}`);
    const rate = (mm3) => (inch() ? `${(mm3 / IN ** 3).toPrecision(3)} in3/min` : `${(mm3 / CM3).toPrecision(3)} cm3/min`);

    function row(tool) {
        return [tool.number, tool.name, shown(tool.diameter), tool.flutes || '-', minutes(tool.time_s), `${tool.time_s > 0 ? Math.round(100 * tool.air_s / tool.time_s) : 0} %`,
                rate(tool.rate_mean_mm3_min), rate(tool.rate_1s_mm3_min), tool.target_mm3_min === null ? t('keeps F') : rate(tool.target_mm3_min),
                tool.target_mm3_min === null ? '-' : `${tool.ceiling} x F`, minutes(tool.time_with_s)].map(String);
    }

    function rights() {
        $('setup-confirm').disabled = !found || !token();
    }

    async function confirm() {
        const wanted = found.measured;
        $('setup-confirm').disabled = true;
        const answer = await asked('confirm', {measured: wanted});
        says(`${t('saved in')} ${answer.file}`);
    }

    const trouble = (error) => says(error.message, true);
    $('setup-form').addEventListener('submit', (e) => { e.preventDefault(); measure().catch(trouble); });
    $('setup-add').addEventListener('click', () => { try { add(); } catch (error) { trouble(error); } });
    $('setup-confirm').addEventListener('click', () => confirm().catch(trouble));
    section('setup', 'setup-open', () => {
        fields();
        put('setup-unit', inch() ? 'in' : 'mm');
        found = null;
        own = false;
        [0, 1, 2, 3, 4, 5].forEach((k) => { field(k).value = ''; });
        picture(null);
        measure().catch(trouble);
    });
}());
