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
    const FEED = [0.0, 0.4, 0.8, 1], RAPID = [0.8, 0.4, 0.0, 1];
    let feeds = [], rapids = [], marks = [];

    // The path, as pieces of feed moves and of traverses: x y z in mm from the corner, and whether the piece that ends there is a traverse.
    function pieces(text) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0)), path = new Float32Array(bytes.buffer);
        [feeds, rapids] = [[], []];
        for (let k = 4; k < path.length; k += 4) (path[k + 3] > 0.5 ? rapids : feeds).push(...path.subarray(k - 4, k - 1), ...path.subarray(k, k + 3));
    }

    // Over the stock: the path, and a link for each finding where it is.
    view.over = (matrix) => {
        view.drawLine(feeds, view.gl.LINES, FEED);
        view.drawLine(rapids, view.gl.LINES, RAPID);
        for (const [link, x, y, z] of marks) {
            const at = [0, 1].map((i) => matrix[i] * x + matrix[4 + i] * y + matrix[8 + i] * z + matrix[12 + i]);
            link.style.left = `${(at[0] + 1) / 2 * canvas.clientWidth}px`;
            link.style.top = `${(1 - at[1]) / 2 * canvas.clientHeight}px`;
            link.hidden = Math.abs(at[0]) > 1 || Math.abs(at[1]) > 1;
        }
    };

    function heights(text) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        return new Uint16Array(bytes.buffer);
    }

    function load(stock, after) {
        view.begin(stock);
        view.before(heights(stock.before));
        view.put(0, 0, stock.columns, stock.rows, heights(after ? stock.after : stock.before));
        pieces(stock.path);
        viewer.querySelectorAll('a').forEach((link) => link.remove());
        marks = stock.marks.map(([x, y, z, label, title, row]) => {
            const link = document.createElement('a');
            Object.assign(link, {textContent: `\u25cb ${label}`, title, href: `#${row}`});
            viewer.appendChild(link);
            return [link, x, y, z];
        });
        view.draw();
    }

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
    viewer.className = 'viewer turned';
    viewer.appendChild(canvas);
    view.listen(() => view.draw());
    if (places.length) {
        places[0].appendChild(viewer);
        load(stocks[0], true);
    }
}());
