'use strict';
// The stock in WebGL: drag turns it, the wheel or a pinch zooms. Without WebGL the flat pictures stay.
// One viewer for the page, moved to the program that is looked at: a browser allows few of them.
(function () {
    const stocks = JSON.parse(document.getElementById('stocks').textContent);
    const places = Array.from(document.querySelectorAll('.stock'));
    const canvas = document.createElement('canvas');
    const gl = canvas.getContext('webgl2', {antialias: true});
    if (!gl) return;

    const VERTEX = `#version 300 es
        in vec3 place; in vec3 normal; in float cut;
        uniform mat4 view; out vec3 n; out float c;
        void main() { gl_Position = view * vec4(place, 1.0); n = normal; c = cut; }`;
    const FRAGMENT = `#version 300 es
        precision mediump float;
        in vec3 n; in float c; out vec4 colour;
        void main() {
            float light = 0.35 + 0.65 * max(0.0, dot(normalize(n), normalize(vec3(-0.4, -0.5, 0.8))));
            colour = vec4(mix(vec3(0.72, 0.60, 0.42), vec3(0.62, 0.70, 0.78), c) * light, 1.0);
        }`;

    function shader(kind, source) {
        const made = gl.createShader(kind);
        gl.shaderSource(made, source);
        gl.compileShader(made);
        return made;
    }

    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);

    function heights(text, stock) {
        const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
        return Float32Array.from(new Uint16Array(bytes.buffer), (v) => v / 65535 * stock.high);
    }

    // Vertices of the heights with a ring at the bottom around them: the sides of the stock. Lengths relative to `size`.
    function mesh(stock, after) {
        const rows = stock.rows + 2, columns = stock.columns + 2;
        const before = heights(stock.before, stock), z = after ? heights(stock.after, stock) : before;
        const size = Math.max(stock.rows, stock.columns) * stock.cell;
        const at = (j, i) => j < 1 || i < 1 || j > stock.rows || i > stock.columns ? 0 : z[(j - 1) * stock.columns + i - 1];
        const data = new Float32Array(rows * columns * 7);
        for (let j = 0, k = 0; j < rows; j++) {
            for (let i = 0; i < columns; i++) {
                const x = Math.min(Math.max(i, 1), stock.columns) - 0.5 - stock.columns / 2;
                const y = Math.min(Math.max(j, 1), stock.rows) - 0.5 - stock.rows / 2;
                const inner = (v, most) => Math.min(Math.max(v, 1), most);
                const sx = at(j, inner(i - 1, stock.columns)) - at(j, inner(i + 1, stock.columns));
                const sy = at(inner(j - 1, stock.rows), i) - at(inner(j + 1, stock.rows), i);
                const edge = i < 1 || j < 1 || i > stock.columns || j > stock.rows;
                const cell = !edge && before[(j - 1) * stock.columns + i - 1] - at(j, i) > 0.01 ? 1 : 0;
                data.set([x * stock.cell / size, y * stock.cell / size, at(j, i) / size, sx, sy, 2 * stock.cell, cell], k);
                k += 7;
            }
        }
        const index = new Uint32Array((rows - 1) * (columns - 1) * 6);
        for (let j = 0, k = 0; j < rows - 1; j++) {
            for (let i = 0; i < columns - 1; i++, k += 6) {
                const a = j * columns + i, b = a + columns;
                index.set([a, a + 1, b, b, a + 1, b + 1], k);
            }
        }
        return {data, index, middle: stock.high / size / 2};
    }

    const points = gl.createBuffer(), faces = gl.createBuffer();
    let shape = null, turn = -0.6, tilt = 0.9, zoom = 1.0;

    function load(stock, after) {
        shape = mesh(stock, after);
        gl.bindBuffer(gl.ARRAY_BUFFER, points);
        gl.bufferData(gl.ARRAY_BUFFER, shape.data, gl.STATIC_DRAW);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, shape.index, gl.STATIC_DRAW);
        [['place', 3, 0], ['normal', 3, 12], ['cut', 1, 24]].forEach(([name, count, from]) => {
            const where = gl.getAttribLocation(program, name);
            gl.enableVertexAttribArray(where);
            gl.vertexAttribPointer(where, count, gl.FLOAT, false, 28, from);
        });
        draw();
    }

    // Parallel view: turned about Z, tilted about the screen's X, as columns of a matrix.
    function draw() {
        if (!shape) return;
        canvas.width = canvas.clientWidth * (window.devicePixelRatio || 1);
        canvas.height = canvas.clientHeight * (window.devicePixelRatio || 1);
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(0.93, 0.95, 0.96, 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        const c = Math.cos(turn), s = Math.sin(turn), u = Math.cos(tilt), v = Math.sin(tilt);
        const across = Math.max(1, canvas.width / canvas.height), up = Math.max(1, canvas.height / canvas.width);
        const kx = 1.4 * zoom / across, ky = 1.4 * zoom / up, m = shape.middle;
        gl.uniformMatrix4fv(gl.getUniformLocation(program, 'view'), false, new Float32Array([
            kx * c, ky * s * u, -0.3 * s * v * -1, 0,
            -kx * s, ky * c * u, 0.3 * c * v, 0,
            0, ky * v, -0.3 * u, 0,
            0, -ky * v * m, 0.3 * u * m, 1]));
        gl.drawElements(gl.TRIANGLES, shape.index.length, gl.UNSIGNED_INT, 0);
    }

    const hands = new Map();
    canvas.addEventListener('pointerdown', (e) => { hands.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); });
    canvas.addEventListener('pointerup', (e) => hands.delete(e.pointerId));
    canvas.addEventListener('pointercancel', (e) => hands.delete(e.pointerId));
    canvas.addEventListener('pointermove', (e) => {
        const before = hands.get(e.pointerId);
        if (!before) return;
        if (hands.size === 1) {
            turn += (e.clientX - before.clientX) * 0.01;
            tilt = Math.min(Math.PI / 2, Math.max(0, tilt - (e.clientY - before.clientY) * 0.01));
        } else {
            const other = Array.from(hands.values()).find((h) => h.pointerId !== e.pointerId);
            const distance = (h) => Math.hypot(h.clientX - other.clientX, h.clientY - other.clientY) + 1;
            zoom = Math.min(50, Math.max(0.2, zoom * distance(e) / distance(before)));
        }
        hands.set(e.pointerId, e);
        draw();
    });
    canvas.addEventListener('wheel', (e) => {
        e.preventDefault();
        zoom = Math.min(50, Math.max(0.2, zoom * Math.exp(-e.deltaY * 0.001)));
        draw();
    }, {passive: false});
    window.addEventListener('resize', draw);

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
