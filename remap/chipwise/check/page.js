'use strict';
// The stock in WebGL: drag turns it, the wheel or a pinch zooms. Without WebGL the flat pictures stay.
// One viewer for the page, moved to the program that is looked at: a browser allows few of them. drawing/height_view.js draws.
(function () {
    const stocks = JSON.parse(document.getElementById('stocks').textContent);
    const places = Array.from(document.querySelectorAll('.stock'));
    const canvas = document.createElement('canvas');
    canvas.tabIndex = 0;
    const view = makeHeightView(canvas, {
        background: [0.93, 0.95, 0.96], uncut: [0.72, 0.60, 0.42], shallow: [0.62, 0.70, 0.78], deep: [0.62, 0.70, 0.78],
        path: [0, 0, 0], tool: [0, 0, 0]});
    if (!(view instanceof HeightView)) return;

    function heights(text) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        return new Uint16Array(bytes.buffer);
    }

    function load(stock, after) {
        view.begin(stock);
        view.before(heights(stock.before));
        view.put(0, 0, stock.columns, stock.rows, heights(after ? stock.after : stock.before));
        view.draw();
    }

    view.listen(() => view.draw());
    places.forEach((place, number) => {
        const controls = document.createElement('p');
        ['before', 'after'].forEach((name) => {
            const button = document.createElement('button');
            button.textContent = 'turn the stock ' + name;
            button.addEventListener('click', () => {
                place.appendChild(viewer);
                load(stocks[number], name === 'after');
            });
            controls.appendChild(button);
            controls.append(' ');
        });
        controls.className = 'viewer';
        place.insertBefore(controls, place.firstChild);
    });
    const viewer = document.createElement('div');
    viewer.className = 'viewer';
    viewer.appendChild(canvas);
    if (places.length) {
        places[0].appendChild(viewer);
        load(stocks[0], true);
    }
}());
