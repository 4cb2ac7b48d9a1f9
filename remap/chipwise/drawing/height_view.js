'use strict';
// A height map as a lit picture: in WebGL 2 it can be turned and zoomed, without it is flat. SPDX-License-Identifier: GPL-2.0-or-later
//
//     const view = makeHeightView(canvas, colours);
//     view.begin({rows, columns, cell, high});           a map, everything at its bottom; cell and high in mm
//     view.put(column, row, columns, rows, heights);     a part; Uint16Array, 0 the bottom, 65535 the top
//     view.before(heights);                              the map as it was: what is lower is drawn as cut (default: the top)
//     view.path(points); view.tool({x, y, z, radius});   mm from the map's corner and bottom
//     view.over = (matrix) => ..;                        draws over it, in WebGL; view.overFlat = (context, mm -> pixels) => ..
//     view.recolour(colours); view.draw();
//
// colours: {background, uncut, shallow, deep, path, tool}, each [r, g, b] from 0 to 1. Used by the page of `chipwise check` and by
// that of `chipwise panel`. The heights are a texture and the mesh is made of it in the vertex shader: a part that has changed
// costs its own size only. height_shaders.js comes before this file.

const HEIGHT_VERTICES = 100000;         // of the mesh, about

// What both views have: the map, and how hands and keys turn it.
class HeightBase {
    constructor(canvas, colours) {
        Object.assign(this, {canvas, colours, map: null, points: [], cutter: null, turn: -0.6, tilt: 0.9, zoom: 1.0});
    }

    // Turn and zoom by mouse, touch and keys.
    listen(changed) {
        const hands = new Map(), canvas = this.canvas;
        const turned = (dx, dy) => {
            this.turn += dx * 0.01;
            this.tilt = Math.min(Math.PI / 2, Math.max(0, this.tilt - dy * 0.01));
        };
        const zoomed = (factor) => { this.zoom = Math.min(50, Math.max(0.2, this.zoom * factor)); };
        canvas.addEventListener('pointerdown', (e) => { hands.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); });
        canvas.addEventListener('pointerup', (e) => hands.delete(e.pointerId));
        canvas.addEventListener('pointercancel', (e) => hands.delete(e.pointerId));
        canvas.addEventListener('pointermove', (e) => {
            const before = hands.get(e.pointerId);
            if (!before) return;
            if (hands.size === 1) {
                turned(e.clientX - before.clientX, e.clientY - before.clientY);
            } else {
                const other = Array.from(hands.values()).find((h) => h.pointerId !== e.pointerId);
                const distance = (h) => Math.hypot(h.clientX - other.clientX, h.clientY - other.clientY) + 1;
                zoomed(distance(e) / distance(before));
            }
            hands.set(e.pointerId, e);
            changed();
        });
        canvas.addEventListener('wheel', (e) => { e.preventDefault(); zoomed(Math.exp(-e.deltaY * 0.001)); changed(); }, {passive: false});
        const keys = {ArrowLeft: [-12, 0], ArrowRight: [12, 0], ArrowUp: [0, -12], ArrowDown: [0, 12]};
        canvas.addEventListener('keydown', (e) => {
            if (keys[e.key]) turned(...keys[e.key]);
            else if (e.key === '+' || e.key === '-') zoomed(e.key === '+' ? 1.2 : 1 / 1.2);
            else return;
            e.preventDefault();
            changed();
        });
        window.addEventListener('resize', changed);
    }

    path(points) { this.points = points; }

    recolour(colours) { this.colours = colours; }

    tool(cutter) { this.cutter = cutter; }

    // From above, or slanted again.
    above(on) {
        [this.turn, this.tilt, this.zoom] = on ? [0, 0, 1] : [-0.6, 0.9, 1];
    }

    resize() {
        const scale = window.devicePixelRatio || 1;
        const wide = Math.max(1, Math.round(this.canvas.clientWidth * scale)), high = Math.max(1, Math.round(this.canvas.clientHeight * scale));
        if (this.canvas.width !== wide || this.canvas.height !== high) Object.assign(this.canvas, {width: wide, height: high});
    }
}

const LINE_VERTEX = `#version 300 es
    in vec3 place; uniform mat4 view;
    void main() { gl_Position = view * vec4(place, 1.0); }`;
const LINE_FRAGMENT = `#version 300 es
    precision mediump float; uniform vec4 ink; out vec4 colour;
    void main() { colour = ink; }`;

class HeightView extends HeightBase {
    constructor(canvas, colours, gl) {
        super(canvas, colours);
        this.gl = gl;
        this.surface = this.link(HEIGHT_VERTEX, HEIGHT_FRAGMENT);
        this.line = this.link(LINE_VERTEX, LINE_FRAGMENT);
        this.buffer = gl.createBuffer();
        this.heights = this.texture();
        this.earlier = this.texture();
        gl.enable(gl.DEPTH_TEST);
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    }

    link(vertex, fragment) {
        const gl = this.gl, program = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) || 'no shader');
        return program;
    }

    texture() {
        const gl = this.gl, made = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, made);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
        for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, name, gl.CLAMP_TO_EDGE);
        return made;
    }

    fill(texture, columns, rows, heights) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.R16UI, columns, rows, 0, gl.RED_INTEGER, gl.UNSIGNED_SHORT, heights);
    }

    begin(map) {
        this.map = map;
        this.fill(this.heights, map.columns, map.rows, new Uint16Array(map.rows * map.columns));
        this.before(null);
    }

    before(heights) {
        this.earlierSize = heights ? [this.map.columns, this.map.rows] : [1, 1];
        this.fill(this.earlier, ...this.earlierSize, heights || new Uint16Array([HEIGHT_FULL]));
    }

    put(column, row, columns, rows, heights) {
        const gl = this.gl;
        gl.bindTexture(gl.TEXTURE_2D, this.heights);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, column, row, columns, rows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, heights);
    }

    // Parallel view: turned about Z, tilted about the screen's X, as columns of a matrix of mm from the corner.
    matrix() {
        const {rows, columns, cell, high} = this.map, size = Math.max(rows, columns) * cell;
        const c = Math.cos(this.turn), s = Math.sin(this.turn), u = Math.cos(this.tilt), v = Math.sin(this.tilt);
        const kx = 1.6 * this.zoom / size * Math.min(1, this.canvas.height / this.canvas.width);
        const ky = 1.6 * this.zoom / size * Math.min(1, this.canvas.width / this.canvas.height), kz = 0.3 / size / Math.max(1, this.zoom / 4);
        const rowsOf = [[kx * c, -kx * s, 0], [ky * s * u, ky * c * u, ky * v], [kz * s * v, kz * c * v, -kz * u]];
        const middle = [columns * cell / 2, rows * cell / 2, high / 2];
        const shift = rowsOf.map((row) => -row.reduce((sum, k, i) => sum + k * middle[i], 0));
        return new Float32Array([0, 1, 2].flatMap((i) => [rowsOf[0][i], rowsOf[1][i], rowsOf[2][i], 0]).concat(shift, [1]));
    }

    draw() {
        const gl = this.gl;
        this.resize();
        gl.viewport(0, 0, this.canvas.width, this.canvas.height);
        gl.clearColor(...this.colours.background, 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        if (!this.map) return;
        const view = this.matrix();
        this.drawSurface(view);
        gl.useProgram(this.line);
        gl.uniformMatrix4fv(gl.getUniformLocation(this.line, 'view'), false, view);
        this.drawLine(this.points.flat(), gl.LINE_STRIP, [...this.colours.path, 1]);
        if (this.over) this.over(view);
        if (this.cutter) this.drawTool();
    }

    drawSurface(view) {
        const gl = this.gl, program = this.surface, {rows, columns, cell, high} = this.map, colours = this.colours;
        const skip = Math.max(1, Math.ceil(Math.sqrt(rows * columns / HEIGHT_VERTICES)));
        const grid = [columns, rows].map((n) => Math.ceil((n - 1) / skip) + 3);
        const at = (name) => gl.getUniformLocation(program, name);
        gl.useProgram(program);
        [this.heights, this.earlier].forEach((texture, unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(gl.TEXTURE_2D, texture);
        });
        gl.activeTexture(gl.TEXTURE0);
        gl.uniform1i(at('heights'), 0);
        gl.uniform1i(at('earlier'), 1);
        gl.uniformMatrix4fv(at('view'), false, view);
        gl.uniform2i(at('size'), columns, rows);
        gl.uniform2i(at('earlierSize'), ...this.earlierSize);
        gl.uniform2i(at('grid'), ...grid);
        gl.uniform1i(at('skip'), skip);
        gl.uniform1f(at('cell'), cell);
        gl.uniform1f(at('high'), high);
        for (const name of ['uncut', 'shallow', 'deep']) gl.uniform3fv(at(name), colours[name]);
        gl.enable(gl.POLYGON_OFFSET_FILL);          // a path on the surface lies before it
        gl.polygonOffset(2, 2);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 2 * grid[0], grid[1] - 1);
        gl.disable(gl.POLYGON_OFFSET_FILL);
    }

    drawLine(numbers, kind, ink) {
        if (!numbers.length) return;
        const gl = this.gl, place = gl.getAttribLocation(this.line, 'place');
        gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(numbers), gl.DYNAMIC_DRAW);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
        gl.uniform4fv(gl.getUniformLocation(this.line, 'ink'), ink);
        gl.drawArrays(kind, 0, numbers.length / 3);
        gl.disableVertexAttribArray(place);
    }

    // A cylinder one can see through.
    drawTool() {
        const gl = this.gl, {x, y, z} = this.cutter, wall = [], cap = [], radius = 0.98 * this.cutter.radius;      // within its own cut
        const length = Math.max(this.map.high, 4 * radius);
        for (let k = 0; k <= 32; k++) {
            const px = x + radius * Math.cos(k * Math.PI / 16), py = y + radius * Math.sin(k * Math.PI / 16);
            wall.push(px, py, z, px, py, z + length);
            cap.push(px, py, z + length);
        }
        gl.enable(gl.BLEND);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
        gl.depthMask(false);
        this.drawLine(wall, gl.TRIANGLE_STRIP, [...this.colours.tool, 0.35]);
        this.drawLine(cap, gl.TRIANGLE_FAN, [...this.colours.tool, 0.35]);
        gl.depthMask(true);
        gl.disable(gl.BLEND);
    }
}

// Without WebGL: from above, the same colours and light.
class FlatView extends HeightBase {
    constructor(canvas, colours) {
        super(canvas, colours);
        this.context = canvas.getContext('2d');
        this.sheet = document.createElement('canvas');
    }

    begin(map) {
        this.map = map;
        this.values = new Uint16Array(map.rows * map.columns);
        this.earlier = null;
        Object.assign(this.sheet, {width: map.columns, height: map.rows});
    }

    before(heights) { this.earlier = heights; }

    recolour(colours) {
        super.recolour(colours);
        if (this.map) this.paint(0, 0, this.map.columns, this.map.rows);
    }

    put(column, row, columns, rows, heights) {
        for (let j = 0; j < rows; j++) {
            this.values.set(heights.subarray(j * columns, (j + 1) * columns), (row + j) * this.map.columns + column);
        }
        this.paint(Math.max(0, column - 1), Math.max(0, row - 1), Math.min(this.map.columns, column + columns + 1), Math.min(this.map.rows, row + rows + 1));
    }

    paint(left, low, right, up) {
        const {rows, columns, cell, high} = this.map, {uncut, shallow, deep} = this.colours, values = this.values;
        const image = new ImageData(right - left, up - low), norm = Math.hypot(...HEIGHT_LIGHT), mm = high / HEIGHT_FULL;
        const inside = (i, most) => Math.min(Math.max(i, 0), most - 1);
        for (let j = low; j < up; j++) {
            for (let i = left; i < right; i++) {
                const z = values[j * columns + i], was = this.earlier ? this.earlier[j * columns + i] : HEIGHT_FULL;
                const row = j * columns, dx = (values[row + inside(i - 1, columns)] - values[row + inside(i + 1, columns)]) * mm;
                const dy = (values[inside(j - 1, rows) * columns + i] - values[inside(j + 1, rows) * columns + i]) * mm;
                const dot = (dx * HEIGHT_LIGHT[0] + dy * HEIGHT_LIGHT[1] + 2 * cell * HEIGHT_LIGHT[2]) / Math.hypot(dx, dy, 2 * cell) / norm;
                const light = 255 * (HEIGHT_AMBIENT + (1 - HEIGHT_AMBIENT) * Math.max(0, dot)), share = 1 - z / HEIGHT_FULL;
                const cut = (was - z) * mm > HEIGHT_CUT_MM, k = ((up - 1 - j) * (right - left) + i - left) * 4;
                for (let n = 0; n < 3; n++) image.data[k + n] = light * (cut ? shallow[n] + (deep[n] - shallow[n]) * share : uncut[n]);
                image.data[k + 3] = 255;
            }
        }
        this.sheet.getContext('2d').putImageData(image, left, rows - up);
    }

    draw() {
        this.resize();
        const {canvas, context, map} = this, css = (c, alpha) => `rgba(${c.map((v) => Math.round(v * 255)).join(',')},${alpha})`;
        context.fillStyle = css(this.colours.background, 1);
        context.fillRect(0, 0, canvas.width, canvas.height);
        if (!map) return;
        const scale = 0.8 * this.zoom * Math.min(canvas.width, canvas.height) / Math.max(map.columns, map.rows), k = scale / map.cell;
        const left = (canvas.width - map.columns * scale) / 2, low = (canvas.height + map.rows * scale) / 2;
        context.imageSmoothingEnabled = false;
        context.drawImage(this.sheet, left, low - map.rows * scale, map.columns * scale, map.rows * scale);
        context.strokeStyle = css(this.colours.path, 1);
        context.beginPath();
        for (const [x, y] of this.points) context.lineTo(left + x * k, low - y * k);
        context.stroke();
        if (this.overFlat) this.overFlat(context, ([x, y]) => [left + (x - map.x) * k, low - (y - map.y) * k]);
        if (!this.cutter) return;
        context.fillStyle = css(this.colours.tool, 0.35);
        context.beginPath();
        context.arc(left + this.cutter.x * k, low - this.cutter.y * k, Math.max(2, this.cutter.radius * k), 0, 2 * Math.PI);
        context.fill();
    }
}

// The view that this browser can show; flat: without WebGL.
function makeHeightView(canvas, colours, flat = false) {
    const gl = flat ? null : canvas.getContext('webgl2', {alpha: false, antialias: false, preserveDrawingBuffer: true});
    if (gl) {
        try {
            return new HeightView(canvas, colours, gl);
        } catch (error) {
            const other = canvas.cloneNode();           // a canvas has one kind of context for ever
            canvas.replaceWith(other);
            return new FlatView(other, colours);
        }
    }
    return new FlatView(canvas, colours);
}
