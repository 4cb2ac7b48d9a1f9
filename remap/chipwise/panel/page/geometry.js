'use strict';
// The tool geometry: shows the file [CHIPWISE]TOOL_GEOMETRY (tools.json), and with the token changes a tool in it (tool).
// SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const CHOICES = {shape: ['flat', 'ball', 'bull', 'vee', 'tapered-ball'], material: ['carbide', 'hss']};
    const KEYS = ['shape', 'corner_radius', 'tip_angle', 'flute_length', 'flutes', 'max_rate', 'stick_out', 'holder_diameter', 'chip_load', 'chip_least', 'deflection', 'material'];
    const NAMES = {shape: 'Shape', corner_radius: 'Corner radius', tip_angle: 'Tip angle', flute_length: 'Flute length', flutes: 'Flutes',
                   max_rate: 'Largest rate', stick_out: 'Stick-out', holder_diameter: 'Holder diameter', chip_load: 'Largest chip',
                   chip_least: 'Smallest chip', deflection: 'Deflection', material: 'Material'};
    const NUMBER = 'number';            // of the tool: a field of the form, no key of the file
    const $ = (id) => document.getElementById(id);
    const {t, put, token, section} = window.chipwise;
    let file = null;                    // tools.json as it was read last

    const field = (name) => $('geometry-' + name);
    const numbers = () => Object.keys(file.tools).map(Number).sort((a, b) => a - b);

    function says(text, wrong = false) {
        put('geometry-says', text);
        $('geometry-says').className = wrong ? 'wrong' : '';
    }

    // ---- what is shown -----------------------------------------------------------------------------------------

    function rows() {
        const inside = window.chipwise.state ? window.chipwise.state.tool : 0;
        $('geometry-head').replaceChildren(...[t('Tool'), ...KEYS.map((key) => t(NAMES[key]))].map((text) => {
            const cell = document.createElement('th');
            cell.textContent = text;
            return cell;
        }));
        $('geometry-rows').replaceChildren(...numbers().map((number) => {
            const row = document.createElement('tr'), button = document.createElement('button');
            button.type = 'button';
            button.textContent = number;
            button.addEventListener('click', () => choose(number));
            row.insertCell().append(button);
            KEYS.forEach((key) => { row.insertCell().textContent = shown(file.tools[number][key]); });
            row.className = number === inside ? 'inside' : '';
            return row;
        }));
    }

    const shown = (value) => (value === undefined ? '-' : String(value));

    function input(name, text, options) {
        const label = document.createElement('label'), words = document.createElement('span');
        const made = document.createElement(options ? 'select' : 'input');
        words.textContent = text;
        made.id = 'geometry-' + name;
        if (options) made.replaceChildren(...options.map((one) => new Option(one, one)));
        else Object.assign(made, {inputMode: 'decimal', autocomplete: 'off', maxLength: 20});
        label.append(words, made);
        return label;
    }

    function choose(number) {
        $('geometry-form').hidden = !token();
        says(token() ? '' : t('Read-only: enter the token to change a tool'));
        if (!token()) return;
        $('geometry-fields').replaceChildren(input(NUMBER, t('Tool')), ...KEYS.map((key) => input(key, t(NAMES[key]), CHOICES[key] ? ['', ...CHOICES[key]] : null)));
        const values = file.tools[number] || {};
        field(NUMBER).value = number || '';
        KEYS.forEach((key) => { field(key).value = values[key] === undefined ? '' : String(values[key]); });
        field(number ? 'flute_length' : NUMBER).focus();
    }

    // ---- what is changed ---------------------------------------------------------------------------------------

    // A number as it is typed: with a point and without an exponent, so that nothing is read otherwise than it looks.
    function number(name, text) {
        if (!/^\d+(\.\d+)?$/.test(text)) throw new Error(`${t(name)}: ${text} ${t('is not a number; write it with a point: 12.5')}`);
        return Number(text);
    }

    function typed() {
        const values = {};
        for (const key of KEYS) {
            const text = field(key).value.trim();
            values[key] = text === '' ? null : CHOICES[key] ? text : number(NAMES[key], text);
        }
        return {tool: number('Tool', field(NUMBER).value.trim()), values, checksum: file.checksum};
    }

    async function save() {
        const wanted = typed();
        const answer = await fetch('tool', {method: 'POST', body: JSON.stringify(wanted),
                                            headers: {'X-Chipwise-Token': token(), 'Content-Type': 'application/json'}});
        const refused = answer.ok ? '' : await answer.text();
        if (refused) await read();
        else file = await answer.json();
        rows();
        if (file.checksum !== wanted.checksum && refused) choose(wanted.tool);      // somebody else has changed it: begin with what it is now
        if (refused) throw new Error(refused);
        says(`${t('Tool')} ${wanted.tool}: ${t('saved in')} ${file.file}`);
    }

    async function read() {
        const answer = await fetch('tools.json');
        if (!answer.ok) throw new Error(await answer.text());
        file = await answer.json();
    }

    async function load() {
        await read();
        put('geometry-file', file.file);
        rows();
        const inside = window.chipwise.state ? window.chipwise.state.tool : 0;
        choose(file.tools[inside] ? inside : numbers()[0] || 0);
    }

    const trouble = (error) => says(error.message, true);
    $('geometry-form').addEventListener('submit', (e) => { e.preventDefault(); says(''); save().catch(trouble); });
    $('geometry-new').addEventListener('click', () => choose(0));
    section('geometry', 'geometry-open', () => { says(''); load().catch(trouble); });
}());
