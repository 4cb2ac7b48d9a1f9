'use strict';
// The shaders of height_view.js: the mesh of a height map with its walls, and its light. SPDX-License-Identifier: GPL-2.0-or-later

const HEIGHT_LIGHT = [-0.4, -0.5, 0.8];
const HEIGHT_AMBIENT = 0.35;
const HEIGHT_FULL = 65535;
const HEIGHT_CUT_MM = 0.01;             // lower than before by this: cut

// A wall of the stock lies somewhere between two vertices, slanted to their rows as a rule, and the cells on it have heights between: drawn as they
// are, they are a row of teeth.  So vertices beside a wall move on to its line, and have the height of the level beside it, never one between.
// A window of cells about the vertex gives the line: the share of each cell above the middle height is what lies behind the wall.
const HEIGHT_WALL = 2.0;                // steeper than this is a wall: mm of height per mm
const HEIGHT_VERTEX = `#version 300 es
    precision highp float; precision highp int; precision highp usampler2D;
    uniform usampler2D heights; uniform mat4 view; uniform ivec2 size, grid; uniform int skip; uniform float cell, high;
    out vec2 at; out float side; out vec3 place;
    float h(ivec2 p) { return float(texelFetch(heights, clamp(p, ivec2(0), size - 1), 0).r) / ${HEIGHT_FULL}.0 * high; }
    void onto(ivec2 c, inout vec2 point, inout float z) {
        float low = z, top = z;
        for (int j = -1; j <= 1; j++) for (int i = -1; i <= 1; i++) {
            float one = h(c + skip * ivec2(i, j));
            low = min(low, one);
            top = max(top, one);
        }
        if (top - low < ${HEIGHT_WALL.toFixed(1)} * cell * float(skip)) return;
        int reach = skip + 1;
        float share = 0.0, count = 0.0;
        vec2 slope = vec2(0.0);
        for (int j = -reach; j <= reach; j++) for (int i = -reach; i <= reach; i++) {
            float f = clamp((h(c + ivec2(i, j)) - low) / (top - low), 0.0, 1.0);
            share += f;
            slope += f * vec2(i, j);
            count += 1.0;
        }
        float wide = 2.0 * float(reach) + 1.0, steep = length(slope);
        if (steep < 0.05 * count) return;
        vec2 up = slope / steep;
        float away = (share / count - 0.5) * wide / max(abs(up.x), abs(up.y));     // cells from the wall's line, above 0 behind it
        if (abs(away) > 1.05 * float(skip) || (share <= 0.0 || share >= count)) return;
        vec2 wall = point - away * up;
        float level = h(ivec2(wall + (away > 0.0 ? 1.5 : -1.5) * up));
        z = level;
        point = vec2(c.x <= 0 || c.x >= size.x - 1 ? point.x : wall.x, c.y <= 0 || c.y >= size.y - 1 ? point.y : wall.y);
    }
    void main() {
        ivec2 g = ivec2(gl_VertexID >> 1, gl_InstanceID + (gl_VertexID & 1));
        bool edge = g.x == 0 || g.y == 0 || g.x == grid.x - 1 || g.y == grid.y - 1;
        ivec2 c = clamp((g - 1) * skip, ivec2(0), size - 1);
        float z = h(c);
        at = vec2(c) + 0.5;
        onto(c, at, z);
        if (edge) z = 0.0;
        side = edge ? 1.0 : 0.0;
        place = vec3(at * cell, z);
        gl_Position = view * vec4(place, 1.0);
    }`;
const HEIGHT_FRAGMENT = `#version 300 es
    precision highp float; precision highp int; precision highp usampler2D;
    uniform usampler2D heights, earlier; uniform ivec2 size, earlierSize; uniform float cell, high; uniform vec3 uncut, shallow, deep;
    in vec2 at; in float side; in vec3 place; out vec4 colour;
    float h(ivec2 p) { return float(texelFetch(heights, clamp(p, ivec2(0), size - 1), 0).r) / ${HEIGHT_FULL}.0 * high; }
    void main() {
        ivec2 p = ivec2(at);
        vec3 face = normalize(cross(dFdx(place), dFdy(place)));
        if (face.z < 0.0) face = -face;
        bool wall = face.z < 0.447;
        vec3 n = normalize(vec3(h(p - ivec2(1, 0)) - h(p + ivec2(1, 0)), h(p - ivec2(0, 1)) - h(p + ivec2(0, 1)), 2.0 * cell));
        if (wall || n.z < 0.447) n = face;                                         // beside a wall the cells have a part of it
        if (wall) {
            vec2 down = vec2(0.0);
            for (int j = -2; j <= 2; j++) for (int i = -2; i <= 2; i++) down -= h(p + ivec2(i, j)) * vec2(i, j);
            n = vec3(down / max(length(down), 1e-6), 0.0);
            p = ivec2(at + 1.5 * n.xy);                                            // what was before the wall
        }
        float was = float(texelFetch(earlier, clamp(p, ivec2(0), earlierSize - 1), 0).r) / ${HEIGHT_FULL}.0 * high;
        float light = ${HEIGHT_AMBIENT} + ${1 - HEIGHT_AMBIENT} * max(0.0, dot(n, normalize(vec3(${HEIGHT_LIGHT.join(',')}))));
        vec3 base = was - place.z > ${HEIGHT_CUT_MM} ? mix(shallow, deep, (high - place.z) / high) : uncut;
        colour = vec4(side > 0.0 ? uncut * 0.6 : base * light, 1.0);
    }`;
