// The data of the page: meshes and frames from their compressed blocks, and the fields made of them.

// The columns of a frame, each with a value per node.
const COLUMNS = ["u_x", "u_y", "damage", "xx", "yy", "xy", "zz"];

// By field: its value at node k of the columns `c`.
const mean = (c, k) => (c.xx[k] + c.yy[k]) / 2;
const radius = (c, k) => Math.hypot((c.xx[k] - c.yy[k]) / 2, c.xy[k]);
const FIELDS = {
  damage: (c, k) => c.damage[k],
  zeta: (c, k) => 1 - c.damage[k],
  // √(½((σ_xx − σ_yy)² + (σ_yy − σ_zz)² + (σ_zz − σ_xx)²) + 3σ_xy²)
  von_mises: (c, k) => Math.sqrt(((c.xx[k] - c.yy[k]) ** 2 + (c.yy[k] - c.zz[k]) ** 2 + (c.zz[k] - c.xx[k]) ** 2) / 2
    + 3 * c.xy[k] ** 2),
  // ½(σ_xx + σ_yy) ± √(¼(σ_xx − σ_yy)² + σ_xy²)
  stress_1: (c, k) => mean(c, k) + radius(c, k),
  stress_2: (c, k) => mean(c, k) - radius(c, k),
  stress_xx: (c, k) => c.xx[k],
  stress_yy: (c, k) => c.yy[k],
  stress_xy: (c, k) => c.xy[k],
  stress_zz: (c, k) => c.zz[k],
  displacement: (c, k) => Math.hypot(c.u_x[k], c.u_y[k]),
  u_x: (c, k) => c.u_x[k],
  u_y: (c, k) => c.u_y[k],
};

// The bytes of a block: base64 of zlib, with the first bytes of all numbers first, then the second, …, because that compresses well.
async function unpacked(id) {
  const text = atob(document.getElementById(id).textContent);
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 4, numbers = new Uint8Array(bytes.length);
  for (let byte = 0; byte < 4; byte++) {
    for (let k = 0; k < count; k++) numbers[4 * k + byte] = bytes[byte * count + k];
  }
  return numbers.buffer;
}

// A run: nodes (x, y in turn, from the centre of the body), elements with `order` 3 or 6 nodes, and frames.
class Run {
  static async read() {
    const run = Object.assign(new Run(), JSON.parse(document.getElementById("run").textContent));
    const mesh = await unpacked("mesh");
    run.nodes = new Float32Array(mesh, 0, 2 * run.count);
    [run.x, run.y] = [0, 1].map(axis => Float32Array.from({ length: run.count }, (_, k) => run.nodes[2 * k + axis]));
    run.elements = new Uint32Array(mesh, 8 * run.count, run.order * run.size);
    run.materials = new Uint32Array(mesh, 8 * run.count + 4 * run.order * run.size, run.size);
    await run.readFrame(run.frames.length - 1);
    run.triangles = run.cut();
    run.sample();
    return run;
  }

  async readFrame(k) {
    const values = new Float32Array(await unpacked(`frame${k}`)), columns = {}, { count } = this;
    COLUMNS.forEach((name, c) => { columns[name] = values.subarray(c * count, (c + 1) * count); });
    // Pressures and gaps at the nodes of all curves of Γ_C, one curve after the other.
    let at = COLUMNS.length * count;
    const contact = this.curves.map(({ nodes: { length: n } }) => {
      at += 2 * n;
      return { pressure: values.subarray(at - 2 * n, at - n), gap: values.subarray(at - n, at) };
    });
    Object.assign(this.frames[k], { columns, contact });
  }

  // Flat triangles: an element of six nodes is cut into four.
  cut() {
    if (this.order === 3) return this.elements;
    const parts = [0, 3, 5, 3, 1, 4, 5, 4, 2, 3, 4, 5], found = new Uint32Array(12 * this.size);
    for (let e = 0; e < this.size; e++) {
      parts.forEach((part, k) => { found[12 * e + k] = this.elements[6 * e + part]; });
    }
    return found;
  }

  // The element that a flat triangle belongs to.
  elementOf(triangle) { return this.order === 3 ? triangle : triangle >> 2; }

  // A field of a frame at all nodes.
  values(frame, field) {
    const of = FIELDS[field], { columns } = this.frames[frame];
    const found = new Float32Array(this.count);
    for (let k = 0; k < this.count; k++) found[k] = of(columns, k);
    return found;
  }

  // Up to 4000 elements, each of which stands for the same area, by material (−1: all).
  sample() {
    const areas = new Float64Array(this.size), { nodes: p, elements: e, order: n } = this;
    for (let k = 0; k < this.size; k++) {
      const [a, b, c] = [0, 1, 2].map(i => 2 * e[n * k + i]);
      areas[k] = Math.abs((p[b] - p[a]) * (p[c + 1] - p[a + 1]) - (p[c] - p[a]) * (p[b + 1] - p[a + 1])) / 2;
    }
    this.samples = new Map([-1, ...this.materialNames.keys()].map(material => {
      const is = k => material < 0 || this.materials[k] === material;
      let [total, passed] = [0, 0];
      for (let k = 0; k < this.size; k++) if (is(k)) total += areas[k];
      const chosen = [];
      for (let k = 0; k < this.size; k++) {
        if (!is(k)) continue;
        passed += areas[k];
        while ((chosen.length + 0.5) * total / 4000 < passed && chosen.length < 4000) chosen.push(k);
      }
      return [material, chosen];
    }));
  }

  // The ends of the colours for a field in these frames, and its extremes there. A peak on a small part of the area must not
  // darken the rest: the colours leave it out if it is `peak` times as far away as the others.
  range(field, frames, material) {
    const chosen = this.samples.get(material), of = FIELDS[field], n = this.order;
    const { part, factor, singular } = this.peak;
    const peak = this.singular.length && this.fields[field].kind === "stress" ? singular : factor;
    const found = { low: Infinity, high: -Infinity, least: Infinity, largest: -Infinity };
    for (const frame of frames) {
      const { columns } = this.frames[frame];
      const means = Float64Array.from(chosen, k => {
        let sum = 0;
        for (let i = 0; i < 3; i++) sum += of(columns, this.elements[n * k + i]);
        return sum / 3;
      }).sort();
      const quantile = part => means[Math.floor(part * (means.length - 1))];
      found.low = Math.min(found.low, quantile(part));
      found.high = Math.max(found.high, quantile(1 - part));
      const { least, largest } = this.extremes(field, frame, material);
      found.least = Math.min(found.least, least.value);
      found.largest = Math.max(found.largest, largest.value);
    }
    const { low, high, least, largest } = found;
    if (high - least <= peak * (high - low)) found.low = least;
    if (largest - low <= peak * (high - low)) found.high = largest;
    // Colours begin at 0 if that is near, or if the field has one value.
    const isFlat = found.high - found.low <= 1e-6 * Math.max(Math.abs(found.low), Math.abs(found.high));
    if (found.low > -1e-3 * found.high && found.low < 0.2 * found.high || isFlat && found.low > 0) found.low = 0;
    else if (isFlat && found.high < 0) found.high = 0;
    return found;
  }

  // The nodes with the least and the largest value.
  extremes(field, frame, material) {
    const of = FIELDS[field], { columns } = this.frames[frame];
    const found = { least: { value: Infinity }, largest: { value: -Infinity } };
    const take = node => {
      const value = of(columns, node);
      if (value < found.least.value) found.least = { value, node };
      if (value > found.largest.value) found.largest = { value, node };
    };
    if (material < 0) for (let k = 0; k < this.count; k++) take(k);
    else this.elements.forEach((node, k) => { if (this.materials[Math.floor(k / this.order)] === material) take(node); });
    return found;
  }

  // The nodes, displaced `factor` times in a frame.
  places(frame, factor) {
    const { u_x: u, u_y: v } = this.frames[frame].columns;
    return this.nodes.map((x, k) => x + factor * (k % 2 ? v : u)[k >> 1]);
  }

  // The lower left and the upper right corner around the nodes, displaced `factor` times in a frame.
  corners(frame, factor) {
    const found = [[Infinity, Infinity], [-Infinity, -Infinity]];
    this.places(frame, factor).forEach((x, k) => {
      found[0][k % 2] = Math.min(found[0][k % 2], x);
      found[1][k % 2] = Math.max(found[1][k % 2], x);
    });
    return found;
  }

  // Σ N_i(λ) v_i with the Lagrange functions N_i of the element.
  interpolate(values, { element, parts: [a, b, c] }) {
    const node = k => values[this.elements[this.order * element + k]];
    if (this.order === 3) return a * node(0) + b * node(1) + c * node(2);
    return a * (2 * a - 1) * node(0) + b * (2 * b - 1) * node(1) + c * (2 * c - 1) * node(2)
      + 4 * (a * b * node(3) + b * c * node(4) + c * a * node(5));
  }
}
