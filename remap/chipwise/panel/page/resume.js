'use strict';
// Resume: says what would go on with the program that was interrupted (resume), and with the token writes and opens it (go-on). Nothing is started.
// SPDX-License-Identifier: GPL-2.0-or-later
(function () {
    const $ = (id) => document.getElementById(id);
    const {t, put, token, section, asked} = window.chipwise;
    let found = null;                   // the last answer of resume

    function says(text, wrong = false) {
        put('resume-says', text);
        $('resume-says').className = wrong ? 'wrong' : '';
    }

    function list(sentences) {
        $('resume-said').replaceChildren(...sentences.map((text) => {
            const item = document.createElement('li');
            item.textContent = text;
            return item;
        }));
    }

    function rights() {
        $('resume-confirm').disabled = !found || !found.file || !token();
    }

    // A number as it is typed, null for an empty field.
    function number(id, pattern) {
        const text = $(id).value.trim();
        if (!text) return null;
        if (!pattern.test(text)) throw new Error(`${text} ${t('is not a number; write it with a point: 12.5')}`);
        return Number(text);
    }

    // What was planned does not belong to these options any more.
    function changed() {
        found = null;
        list([]);
        says('');
        rights();
    }

    async function plan() {
        changed();
        const options = {line: number('resume-line', /^\d+$/), seconds: number('resume-seconds', /^(\d+(\.\d*)?|\.\d+)$/) || 0, broke: $('resume-broke').checked};
        $('resume-plan').disabled = true;
        says(t('The stop is being looked for'));
        try {
            found = await asked('resume', options);
        } finally {
            $('resume-plan').disabled = false;
        }
        put('resume-program', found.program);
        list(found.said);
        rights();
        says(!found.file ? '' : token() ? `${t('Write this program and open it? Nothing moves until you start it')}: ${found.file}` : t('Read-only: enter the token to write it'));
    }

    async function confirm() {
        const wanted = found.resume, name = found.file;
        found = null;
        rights();
        says(`${t('Being done')}: ${name}`);
        await asked('go-on', {resume: wanted});
        says(`${t('It is written and open; look at it, then start it')}: ${name}`);
    }

    const trouble = (error) => { rights(); says(error.message, true); };
    for (const id of ['resume-seconds', 'resume-line', 'resume-broke']) $(id).addEventListener('input', changed);
    $('resume-form').addEventListener('submit', (e) => { e.preventDefault(); plan().catch(trouble); });
    $('resume-confirm').addEventListener('click', () => confirm().catch(trouble));
    section('resume', 'resume-open', () => {
        put('resume-program', '');
        plan().catch(trouble);
    });
}());
