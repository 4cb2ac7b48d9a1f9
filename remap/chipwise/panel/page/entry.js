'use strict';
// Entry by fields: the data of a code in one line, with commas between them. SPDX-License-Identifier: GPL-2.0-or-later
// The server makes the line of G-code (line.json), plans and draws it (plan), and runs by MDI what was planned last (run).
(function () {
    const WAIT_MS = 150;                // after a key, until the line is looked at
    const $ = (id) => document.getElementById(id);
    const {t, token, put, language, section, able, hooks, asked} = window.chipwise;
    let codes = [], newest = 0, planned = null, timer = 0, running = 0;     // running: look at which a line was handed over

    const state = () => window.chipwise.state;
    const local = () => window.chipwise.local;
    const inch = () => Boolean(state() && state().task && state().task.mdi_unit === 'in');
    const code = () => codes.find((one) => one.code === $('code').value);
    const chop = () => (code().chop ? $('chop-size').value : '');
    const texts = () => $('entry-line').value.split(',');

    // ---- what is shown -----------------------------------------------------------------------------------------

    // A row for each datum in the order of entry: number, letter, name, what is typed, what an empty place means.
    function fields(wrong = 0) {
        const given = texts(), chosen = code();
        $('chop').hidden = !chosen.chop;
        put('chop-unit', inch() ? 'in' : 'mm');
        $('chop-size').placeholder = chosen.chop ? chosen.chop[inch() ? 1 : 0] : '';
        $('field-rows').replaceChildren(...chosen.fields.map((field, k) => {
            const row = document.createElement('tr'), unit = field.units[inch() ? 1 : 0], typed = (given[k] || '').trim();
            const meaning = field.choices.map(([number, words]) => `${number} ${words}`).join(', ');
            const empty = field.required ? t('required') : `[${field.default}]`;
            [k + 1, field.letter, field.name + (unit ? `, ${unit}` : ''), [typed || empty, meaning].filter(Boolean).join(': ')].forEach((text) => {
                row.insertCell().textContent = text;
            });
            row.className = k + 1 === wrong ? 'wrong' : typed ? 'typed' : field.required ? 'required' : '';
            return row;
        }));
    }

    function says(text, wrong = 0) {
        put('entry-says', text);
        $('entry-says').className = wrong || (text && !planned) ? 'wrong' : '';
        fields(wrong);
    }

    function rights() {
        $('entry-run').hidden = !token();
        able('entry-run', !planned ? t('Draw the line first') : planned.refused, 'entry-says');
        able('entry-copy', $('entry-gcode').textContent ? '' : t('There is no line yet'), 'entry-says');
        able('entry-draw', local() || token() ? '' : t('From another computer a line is drawn with the token only'), 'entry-says');
    }

    // What was run is under way until a state that came later shows the machine idle.
    function underWay() {
        const task = state().task;
        if (!running || state().look < running + 2 || !task || !task.idle) return;
        running = 0;
        says(task.failed ? t('it ended with an error; see the screen of LinuxCNC') : t('it has ended, the machine is idle'));
        $('entry-says').className = task.failed ? 'wrong' : '';
    }

    function forget() {
        planned = null;
        running = 0;
        $('entry-drawing').classList.add('old');
        rights();
    }

    // ---- what is typed -----------------------------------------------------------------------------------------

    async function look() {
        const mine = ++newest, query = new URLSearchParams({code: $('code').value, text: $('entry-line').value, chop: chop()});
        const answer = await fetch('line.json?' + query);
        if (mine !== newest) return;
        const found = answer.ok ? await answer.json() : {error: await answer.text(), number: 0};
        put('entry-gcode', found.line || '');
        rights();
        says(found.error || '', found.error ? found.number : 0);
    }

    function changed() {
        forget();
        clearTimeout(timer);
        timer = setTimeout(() => look().catch(trouble), WAIT_MS);
    }

    async function plan() {
        clearTimeout(timer);
        forget();
        const mine = ++newest;
        says(t('Planning'));
        const answer = await fetch('plan?' + language(), {method: 'POST', headers: {'Content-Type': 'application/json', ...(token() ? {'X-Chipwise-Token': token()} : {})}, body: JSON.stringify(
            {code: $('code').value, text: $('entry-line').value, chop: chop(), mode: document.documentElement.dataset.theme})});
        const found = answer.ok ? await answer.json() : {error: await answer.text(), number: 0};
        if (mine !== newest) return;
        if (!found.error) planned = found;
        put('entry-gcode', found.line || '');
        $('entry-drawing').hidden = !found.svg;
        $('entry-drawing').classList.remove('old');
        if (found.svg) $('entry-drawing').src = 'data:image/svg+xml;charset=utf-8,' + encodeURIComponent(found.svg);
        says(found.error || [...found.figures, ...found.messages, found.refused].filter(Boolean).join('; ') || t('Planned: nothing moves'), found.number || 0);
        rights();
    }

    async function run() {
        let refused = '', look = 0;
        try { look = (await asked('run', {plan: planned.plan})).look; } catch (error) { refused = error.message; }
        planned = null;
        running = look;
        rights();
        says(refused || t('running; Stop on the screen of LinuxCNC ends it'));
        $('entry-says').className = refused ? 'wrong' : '';
    }

    // ---- opening -----------------------------------------------------------------------------------------------

    // The volumetric feed as it is now, as a start for another one.
    function present() {
        const s = state(), per = inch() ? 16387.064 : 1000, modes = {limit: 1, constant: 2, window: 3};
        if ($('code').value !== 'M251' || !s || !(s.target > 0) || !modes[s.mode]) return '';
        const rate = (mm3) => String(Number((mm3 / per).toPrecision(6)));
        return [rate(s.target), modes[s.mode], ...(s.mode === 'window' ? [rate(s.lower)] : [])].join(',');
    }

    function choose(name, text = null) {
        $('code').value = name;
        $('entry-line').value = text === null ? present() : text;
        $('entry-drawing').hidden = true;
        put('entry-names', code().fields.map((field) => field.letter).join(','));
        fields();
        changed();
        $('entry-line').focus();
    }

    async function load() {
        const answer = await fetch('codes.json?' + language());
        if (!answer.ok) throw new Error(await answer.text());
        codes = await answer.json();
        $('code').replaceChildren(...codes.map((one) => new Option(`${one.code} ${one.title}`, one.code)));
        document.querySelectorAll('[data-code]').forEach((e) => { e.hidden = !codes.some((one) => one.code === e.dataset.code); });
    }

    async function open() {
        rights();
        if (codes.length) return $('entry-line').focus();
        await load();
        choose((codes.find((one) => one.code === 'G79') || codes[0]).code);
    }

    const trouble = (error) => put('entry-says', error.message);
    section('entry', 'enter', () => open().catch(trouble));
    $('code').addEventListener('change', () => choose($('code').value));
    document.querySelectorAll('[data-code]').forEach((e) => e.addEventListener('click', () => choose(e.dataset.code)));
    for (const id of ['entry-line', 'chop-size']) $(id).addEventListener('input', changed);
    $('entry-form').addEventListener('submit', (e) => { e.preventDefault(); plan().catch(trouble); });
    $('entry-run').addEventListener('click', () => run().catch(trouble));
    $('entry-copy').addEventListener('click', async () => {
        const range = document.createRange();
        range.selectNodeContents($('entry-gcode'));         // what a page without the right to the clipboard can do: Ctrl-C copies it
        getSelection().removeAllRanges();
        getSelection().addRange(range);
        try { await navigator.clipboard.writeText($('entry-gcode').textContent); } catch (error) { document.execCommand('copy'); }
    });
    hooks.push(underWay);
    window.chipwise.onRights = rights;
}());
