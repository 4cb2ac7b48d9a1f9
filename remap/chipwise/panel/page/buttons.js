'use strict';
// Buttons that cannot be pressed now, with the reason, the two guards, and New part. SPDX-License-Identifier: GPL-2.0-or-later
// Such a button keeps the focus and is heard: a finger that presses it gets the reason as text, a pointer over it as a hint.
(function () {
    const TOLD_MS = 8000;               // a reason stays for so long
    const $ = (id) => document.getElementById(id);
    const {t, put, change, token, hooks, show} = window.chipwise;
    const whys = new Map(), told = new Map();   // button: why not; place of words: [reason, until]
    let switching = false, beginning = false;

    // Whether a button can be pressed: why not, '' if it can; where: the place of words that shows it to a finger.
    window.chipwise.able = (id, why, where) => {
        const button = $(id);
        if (whys.get(id) === undefined) button.addEventListener('click', (e) => pressed(e, id), true);
        whys.set(id, [why, where]);
        if (why) button.setAttribute('aria-disabled', 'true'); else button.removeAttribute('aria-disabled');
        if (button.title !== why) button.title = why;
    };

    function pressed(event, id) {
        const [why, where] = whys.get(id);
        if (!why) return;
        event.preventDefault();
        event.stopImmediatePropagation();
        told.set(where, [why, Date.now() + TOLD_MS]);
        put(where, why);
        setTimeout(() => { if ($(where).textContent === why) put(where, ''); show(); }, TOLD_MS + 100);
    }

    // The reason that is shown at a place of words, '' after its time.
    window.chipwise.told = (where) => {
        const [why, until] = told.get(where) || ['', 0];
        return Date.now() < until ? why : '';
    };

    // ---- the guards: whether they are on; with the token they can be switched ------------------------------------

    // Why nothing of the machine can be changed now.
    function locked() {
        const task = window.chipwise.state.task;
        return !window.chipwise.canChange ? t('Read-only: set [CHIPWISE]PANEL_TOKEN to change something') : !token() ? t('Locked: enter the token first')
            : !task ? t('LinuxCNC does not answer') : !task.idle ? t('A program or a command is under way') : '';
    }

    function guards() {
        const state = window.chipwise.state, why = locked();
        for (const [name, words] of [['rapid', t('Guard of rapids')], ['flute', t('Guard of flutes')]]) {
            const on = state.guards[name];
            put('guard-' + name, `${words}: ${on ? t('on') : t('off')}`);
            $('guard-' + name).className = on ? '' : 'guard-off';
            window.chipwise.able('guard-' + name, switching ? t('Being switched') : why, 'guard-answer');
        }
    }

    async function switchGuard(name) {
        const on = !window.chipwise.state.guards[name];
        switching = true;               // until it is answered, one at a time
        show();
        put('guard-answer', await change('guard', {guard: name, on}).finally(() => { switching = false; }));
        show();
    }

    for (const name of ['rapid', 'flute']) {
        window.chipwise.able('guard-' + name, t('LinuxCNC does not answer'), 'guard-answer');
        $('guard-' + name).addEventListener('click', () => switchGuard(name));
    }
    // ---- a whole stock in place of the assumed one that was cut ---------------------------------------------------

    async function newPart() {
        beginning = true;
        show();
        put('part-answer', await change('part', {}).finally(() => { beginning = false; }));
        show();
    }

    window.chipwise.able('new-part', t('LinuxCNC does not answer'), 'part-answer');
    $('new-part').addEventListener('click', newPart);
    hooks.push(() => window.chipwise.able('new-part', beginning ? t('Being done') : locked(), 'part-answer'));
    hooks.push(guards);
    hooks.push(() => window.chipwise.able('gauge-next', viewsOf(window.chipwise.state).length > 1 ? '' : t('No other limit is known'), 'stock-note'));
    hooks.push(() => {
        const why = window.chipwise.earlier ? '' : t('No program has begun on this stock yet');
        for (const id of ['this-run', 'before']) window.chipwise.able(id, why, 'stock-note');
    });
}());
