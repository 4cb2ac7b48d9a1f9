'use strict';
// The path ahead of the tool and the contours of G77, G78 and G79, drawn over the stock of height_view.js. SPDX-License-Identifier: GPL-2.0-or-later
//
//     const ahead = makeAhead(view, colours);        colours(): {ahead, rapid, target}, each [r, g, b] from 0 to 1
//     ahead.path(bytes); ahead.loops(rows);          the messages A and C of the stream (ahead.py)
//     ahead.now(state.ahead, tip);                   where the tool is on the path
//     ahead.show({path, loops});                     which of them are drawn
//
// Places are in mm, machine coordinates. They are drawn over everything: what is ahead lies in the stock as a rule.

const AHEAD_VERTEX = `#version 300 es
    in vec4 place; uniform mat4 view; uniform vec3 corner; uniform vec2 shift; flat out float rapid;
    void main() { gl_Position = view * vec4(place.xyz - corner, 1.0) + vec4(shift, 0.0, 0.0); rapid = place.w; }`;
const AHEAD_FRAGMENT = `#version 300 es
    precision mediump float; uniform vec3 ink, other; flat in float rapid; out vec4 colour;
    void main() { colour = vec4(rapid > 0.5 ? other : ink, 1.0); }`;
const THICK = [[0, 0], [1, 0], [0, 1], [1, 1]];        // pixels: WebGL has thin lines only

function makeAhead(view, colours) {
    let epoch = -1, first = 0, rows = new Float32Array(0), loops = [], from = null, join = null, on = {path: true, loops: true};
    let gpu = null, stale = true;

    // Four floats for each point of the contours, and [first point, points] of each.
    function ofLoops() {
        const ranges = [];
        let count = 0;
        for (const loop of loops) {
            ranges.push([count, loop.length]);
            count += loop.length;
        }
        return [new Float32Array(loops.flat().flatMap((p) => [...p, 0])), ranges];
    }

    function onGpu(gl) {
        if (!gpu) gpu = {program: view.link(AHEAD_VERTEX, AHEAD_FRAGMENT), path: gl.createBuffer(), join: gl.createBuffer(), loops: gl.createBuffer(), ranges: []};
        if (!stale) return;
        const [points, ranges] = ofLoops();
        for (const [buffer, data] of [[gpu.path, rows], [gpu.loops, points]]) {
            gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
            gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
        }
        gpu.ranges = ranges;
        stale = false;
    }

    function strips(gl, buffer, ranges, ink, other, shifts) {
        const at = (name) => gl.getUniformLocation(gpu.program, name), place = gl.getAttribLocation(gpu.program, 'place');
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.enableVertexAttribArray(place);
        gl.vertexAttribPointer(place, 4, gl.FLOAT, false, 0, 0);
        gl.uniform3fv(at('ink'), ink);
        gl.uniform3fv(at('other'), other);
        for (const [x, y] of shifts) {
            gl.uniform2f(at('shift'), 2 * x / view.canvas.width, 2 * y / view.canvas.height);
            for (const [start, count] of ranges) if (count > 1) gl.drawArrays(gl.LINE_STRIP, start, count);
        }
        gl.disableVertexAttribArray(place);
    }

    const pathRanges = () => (on.path && from !== null && from >= first ? [[from - first, rows.length / 4 - (from - first)]] : []);

    // Over the lit picture; matrix: of mm from the map's corner.
    view.over = (matrix) => {
        const gl = view.gl, {ahead, rapid, target} = colours(), map = view.map;
        onGpu(gl);
        gl.useProgram(gpu.program);
        gl.uniformMatrix4fv(gl.getUniformLocation(gpu.program, 'view'), false, matrix);
        gl.uniform3f(gl.getUniformLocation(gpu.program, 'corner'), map.x, map.y, map.z);
        gl.disable(gl.DEPTH_TEST);
        const ranges = pathRanges();
        strips(gl, gpu.path, ranges, ahead, rapid, [[0, 0]]);
        if (ranges.length && join) {
            gl.bindBuffer(gl.ARRAY_BUFFER, gpu.join);
            gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(join), gl.DYNAMIC_DRAW);
            strips(gl, gpu.join, [[0, 2]], ahead, rapid, [[0, 0]]);
        }
        if (on.loops) strips(gl, gpu.loops, gpu.ranges, target, target, THICK);
        gl.enable(gl.DEPTH_TEST);
        gl.useProgram(view.line);
    };

    // Over the flat picture; at: mm -> pixels of the canvas.
    view.overFlat = (context, at) => {
        const {ahead, rapid, target} = colours(), css = (c) => `rgb(${c.map((v) => Math.round(v * 255)).join(',')})`;
        const line = (points, ink, wide) => {
            context.strokeStyle = css(ink);
            context.lineWidth = wide;
            context.beginPath();
            points.forEach((p, k) => { if (k % 2) context.lineTo(...at(p)); else context.moveTo(...at(p)); });
            context.stroke();
        };
        const pieces = [[], []], point = (k) => [rows[4 * k], rows[4 * k + 1]];
        for (const [start, count] of pathRanges()) {
            for (let k = start + 1; k < start + count; k++) pieces[rows[4 * k + 3] > 0.5 ? 1 : 0].push(point(k - 1), point(k));
            if (join && count) pieces[join[7] > 0.5 ? 1 : 0].push(join.slice(0, 2), join.slice(4, 6));
        }
        line(pieces[0], ahead, 1);
        line(pieces[1], rapid, 1);
        if (on.loops) for (const loop of loops) line(loop.slice(1).flatMap((p, k) => [loop[k], p]), target, 2);
        context.lineWidth = 1;
    };

    return {
        path(bytes) {
            const head = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
            [epoch, first] = [head.getUint32(0, true), head.getUint32(4, true)];
            rows = new Float32Array(bytes.slice(8).buffer);
            stale = true;
        },
        loops(found) {
            loops = found;
            stale = true;
        },
        now(found, tip) {
            from = found.epoch === epoch ? found.from : null;
            const at = from === null ? -1 : 4 * (from - first);
            join = found.joined && at >= 0 && at < rows.length ? [...tip, 0, ...rows.subarray(at, at + 4)] : null;
        },
        show(what) { on = {...on, ...what}; },
        get points() { return pathRanges().map(([start, count]) => Array.from(rows.subarray(4 * start, 4 * (start + count)))).flat(); },
        get contours() { return loops; },
    };
}
