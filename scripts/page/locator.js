// Finds the flat triangle around a point, by a grid of cells with lists of the triangles that may meet them.
class Locator {
  // The nodes are displaced `factor` times in a frame.
  constructor(run, frame, factor) {
    const { triangles } = run, count = triangles.length / 3, [low, high] = run.corners(frame, factor);
    Object.assign(this, { run, places: run.places(frame, factor), low, high });
    const [width, height] = [0, 1].map(k => this.high[k] - this.low[k]);
    this.cell = Math.sqrt(width * height / count) || 1;
    this.across = Math.ceil(width / this.cell) + 1;
    this.starts = new Uint32Array(this.across * (Math.ceil(height / this.cell) + 1) + 1);
    for (let t = 0; t < count; t++) this.cells(t, cell => { this.starts[cell + 1]++; });
    for (let k = 1; k < this.starts.length; k++) this.starts[k] += this.starts[k - 1];
    this.lists = new Uint32Array(this.starts[this.starts.length - 1]);
    const next = this.starts.slice();
    for (let t = 0; t < count; t++) this.cells(t, cell => { this.lists[next[cell]++] = t; });
  }

  index(x, axis) { return Math.floor((x - this.low[axis]) / this.cell); }

  corners(t) {
    return [0, 1, 2].map(i => {
      const k = 2 * this.run.triangles[3 * t + i];
      return [this.places[k], this.places[k + 1]];
    });
  }

  // Calls `visit` with each cell that the box around a triangle meets.
  cells(t, visit) {
    const { places, run: { triangles } } = this, [a, b, c] = [triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]];
    const end = (of, axis) => this.index(of(places[2 * a + axis], places[2 * b + axis], places[2 * c + axis]), axis);
    const [right, top] = [end(Math.max, 0), end(Math.max, 1)];
    for (let j = end(Math.min, 1); j <= top; j++) {
      for (let i = end(Math.min, 0); i <= right; i++) visit(j * this.across + i);
    }
  }

  // The element around a point with the barycentric coordinates there; null outside of the body.
  find([x, y], material = -1) {
    if (!(x >= this.low[0] && x <= this.high[0] && y >= this.low[1] && y <= this.high[1])) return null;
    const cell = this.index(y, 1) * this.across + this.index(x, 0);
    for (let k = this.starts[cell]; k < this.starts[cell + 1]; k++) {
      const t = this.lists[k], [a, b, c] = this.corners(t), element = this.run.elementOf(t);
      if (material >= 0 && this.run.materials[element] !== material) continue;
      const twice = (p, q, r) => (q[0] - p[0]) * (r[1] - p[1]) - (r[0] - p[0]) * (q[1] - p[1]);
      const area = twice(a, b, c), parts = [twice([x, y], b, c), twice([x, y], c, a), twice([x, y], a, b)].map(of => of / area);
      if (Math.min(...parts) >= -1e-4) return { element, parts: this.whole(t, parts) };
    }
    return null;
  }

  // Barycentric coordinates in the whole element, from those in one of its four parts.
  whole(t, [a, b, c]) {
    if (this.run.order === 3) return [a, b, c];
    return [
      [a + (b + c) / 2, b / 2, c / 2], [a / 2, a / 2 + b + c / 2, c / 2],
      [a / 2, b / 2, (a + b) / 2 + c], [(a + c) / 2, (a + b) / 2, (b + c) / 2],
    ][t % 4];
  }
}
