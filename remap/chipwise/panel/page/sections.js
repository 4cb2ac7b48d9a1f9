'use strict';
// Sections of the page in the place of the stock, one at a time. SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const $ = (id) => document.getElementById(id);
    const sections = new Map();         // id: what to do when it is opened

    function show(name) {
        for (const id of sections.keys()) $(id).hidden = id !== name;
        document.body.dataset.open = name;
        if (name) sections.get(name)(); else window.chipwise.show();
    }

    // A section and the button that opens and closes it; it has a button of its own, ID-close.
    window.chipwise.section = (id, button, opened) => {
        sections.set(id, opened);
        $(button).addEventListener('click', () => show($(id).hidden ? id : ''));
        $(id + '-close').addEventListener('click', () => show(''));
    };

    // The answer to an object that is sent, with the token if there is one.
    window.chipwise.asked = async (what, body) => {
        const headers = {'Content-Type': 'application/json'};
        if (window.chipwise.token()) headers['X-Chipwise-Token'] = window.chipwise.token();
        const answer = await fetch(what, {method: 'POST', body: JSON.stringify(body), headers});
        if (!answer.ok) throw new Error(await answer.text());
        const content = await answer.json();
        if (content.error) throw new Error(content.error);
        return content;
    };

    // A table's rows, from lists of texts; names: classes of rows.
    window.chipwise.fill = (body, rows, names = []) => {
        const key = JSON.stringify([rows, names]);
        if (body.dataset.key === key) return;
        body.dataset.key = key;
        body.replaceChildren(...rows.map((cells, k) => {
            const row = document.createElement('tr');
            cells.forEach((text) => { row.insertCell().textContent = text; });
            row.className = names[k] || '';
            return row;
        }));
    };
}());
