// Draws the coloured body and its mesh by WebGL 2.

const COLOURED = [`#version 300 es
  in vec2 place; in vec2 moved; in float value;
  uniform vec2 centre, scale; uniform float factor;
  out float shown;
  void main() { gl_Position = vec4((place + factor * moved - centre) * scale, 0, 1); shown = value; }`,
`#version 300 es
  precision highp float;
  in float shown;
  uniform sampler2D table; uniform float low, high, bands;
  out vec4 colour;
  void main() {
    float part = high > low ? clamp((shown - low) / (high - low), 0.0, 1.0) : 0.0;
    if (bands > 0.0) part = (min(floor(part * bands), bands - 1.0) + 0.5) / bands;
    colour = vec4(texture(table, vec2(part * 255.0 / 256.0 + 0.5 / 256.0, 0.5)).rgb, 1);
  }`];
const PLAIN = [COLOURED[0], `#version 300 es
  precision highp float;
  in float shown;
  uniform vec4 ink;
  out vec4 colour;
  void main() { colour = ink + 0.0 * shown; }`];

class Body {
  constructor(canvas, run) {
    // The edges of the body are vectors above it, and smooth; without a graphics card smoothing takes three times as long.
    const gl = canvas.getContext("webgl2", { alpha: false, antialias: false });
    if (!gl) throw new Error("this browser has no WebGL 2, which the viewer needs");
    Object.assign(this, { gl, run, canvas });
    this.coloured = libraries.createProgramInfo(gl, COLOURED);
    this.plain = libraries.createProgramInfo(gl, PLAIN);
    this.buffers = libraries.createBufferInfoFromArrays(gl, {
      place: { numComponents: 2, data: run.nodes },
      moved: { numComponents: 2, data: run.nodes.length, drawType: gl.DYNAMIC_DRAW },
      value: { numComponents: 1, data: run.count, drawType: gl.DYNAMIC_DRAW },
      indices: run.triangles,
    });
    this.indices = new Map();
    this.tables = {};
    for (const [name, colours] of Object.entries(run.colours)) {
      this.tables[name] = libraries.createTexture(gl, {
        width: 256, height: 1, src: new Uint8Array(colours.flatMap(of => [...of, 255])), min: gl.LINEAR, wrap: gl.CLAMP_TO_EDGE });
    }
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  // Takes the displacements of a frame.
  move(frame) {
    const { u_x: u, u_y: v } = this.run.frames[frame].columns;
    const moved = new Float32Array(2 * this.run.count);
    for (let k = 0; k < this.run.count; k++) [moved[2 * k], moved[2 * k + 1]] = [u[k], v[k]];
    libraries.setAttribInfoBufferFromArray(this.gl, this.buffers.attribs.moved, moved);
  }

  colour(values) { libraries.setAttribInfoBufferFromArray(this.gl, this.buffers.attribs.value, values); }

  // Buffers of the triangles of a material (−1: all) or of the sides of its elements.
  indexed(kind, material) {
    const key = `${kind} ${material}`;
    if (!this.indices.has(key)) {
      const data = kind === "triangles" ? this.trianglesOf(material) : this.sidesOf(material);
      const buffer = libraries.createBufferFromTypedArray(this.gl, data, this.gl.ELEMENT_ARRAY_BUFFER);
      this.indices.set(key, { buffer, count: data.length });
    }
    return this.indices.get(key);
  }

  trianglesOf(material) {
    const { run } = this;
    if (material < 0) return run.triangles;
    return run.triangles.filter((_, k) => run.materials[run.elementOf(Math.floor(k / 3))] === material);
  }

  // Pairs of nodes; a side of an element of six nodes has two parts. Elements go counterclockwise, so two of them have a
  // side in both directions; that of the boundary is in the overlay.
  sidesOf(material) {
    const { run } = this, found = new Uint32Array(2 * run.order * run.size);
    const around = run.order === 3 ? [0, 1, 2, 0] : [0, 3, 1, 4, 2, 5, 0];
    let count = 0;
    for (let e = 0; e < run.size; e++) {
      if (material >= 0 && run.materials[e] !== material) continue;
      for (let k = 0; k < run.order; k++) {
        const [a, b] = [run.elements[run.order * e + around[k]], run.elements[run.order * e + around[k + 1]]];
        if (a < b) [found[count++], found[count++]] = [a, b];
      }
    }
    return found.subarray(0, count);
  }

  // Draws the body as `view` shows it.
  draw({ centre, zoom, stretch, width, height, factor, material, colours, bands, range }, mesh) {
    const { gl } = this, pixels = [width, height].map(of => Math.round(of * (window.devicePixelRatio || 1)));
    // A new size makes new buffers.
    ["width", "height"].forEach((name, k) => { if (this.canvas[name] !== pixels[k]) this.canvas[name] = pixels[k]; });
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const where = { centre, scale: [2 * zoom * stretch[0] / width, 2 * zoom * stretch[1] / height], factor };
    this.part(this.coloured, this.indexed("triangles", material), gl.TRIANGLES,
      { ...where, low: range.low, high: range.high, bands, table: this.tables[colours] });
    if (mesh) this.part(this.plain, this.indexed("sides", material), gl.LINES, { ...where, ink: [0, 0, 0, 0.25] });
  }

  part(program, { buffer, count }, kind, uniforms) {
    const { gl } = this;
    gl.useProgram(program.program);
    libraries.setBuffersAndAttributes(gl, program, { ...this.buffers, indices: buffer });
    libraries.setUniforms(program, uniforms);
    gl.drawElements(kind, count, gl.UNSIGNED_INT, 0);
  }
}
