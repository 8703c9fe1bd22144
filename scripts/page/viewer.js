// The state of the page, and what its controls and the pointer do.

const LARGEST_FACTOR = 1e9; // the body is drawn with numbers of four bytes
const MANY = 60000, REST = 300; // sides of elements; milliseconds
const SLENDER = [4, 20]; // a body of such proportions can be stretched, and is at first

class View {
  constructor(run, root) {
    Object.assign(this, { run, root, frame: run.frames.length - 1, cut: [], ends: [], length: run.units.length.name });
    this.canvas = root.querySelector("canvas");
    this.overlay = root.querySelector("svg");
    this.body = new Body(this.canvas, run);
    this.drawing = new Overlay(run);
    this.stressTop = run.stressTop;
    Object.assign(this, { locators: new Map(), ranges: new Map() });
    this.control = name => root.querySelector(`[name=${name}]`);
    this.fill();
    this.charts();
    this.listen();
    this.show(this.frame);
  }

  get isLast() { return this.frame === this.run.frames.length - 1; }
  get moment() { return this.run.frames[this.frame].moment; }
  get field() { return this.control("field").value; }
  get unit() {
    const { label, kind, colours } = this.run.fields[this.field], { name, factor } = this.run.units[kind];
    return { label, name, factor, colours, isStress: kind === "stress" };
  }
  get colours() { return this.unit.colours; }
  get material() { return Number(this.control("material").value); }
  get factor() { return Math.min(Math.max(Number(this.control("factor").value) || 0, 0), LARGEST_FACTOR); }
  get isNarrow() { return this.width < 560; }
  get bands() { return this.control("bands").checked ? 10 : 0; }

  fill() {
    const { run } = this, options = (name, list) => {
      this.control(name).replaceChildren(...list.map(([value, text]) => new Option(text, value)));
    };
    options("field", Object.entries(run.fields).map(([key, { label }]) => [key, label]));
    options("material", [[-1, "whole body"], ...run.materialNames.map((name, k) => [k, name]).filter(([k]) => run.materials.includes(k))]);
    this.control("material").closest("label").hidden = run.materialNames.length < 2;
    this.control("frame").max = run.frames.length - 1;
    this.root.querySelector(".time").hidden = run.frames.length < 2;
    this.control("factor").value = run.automatic;
    const [low, high] = run.corners(this.frame, 0), [width, height] = high.map((of, axis) => of - low[axis]);
    const slender = Math.max(width / height, height / width);
    this.control("stretched").closest("label").hidden = !(slender > SLENDER[0]);
    this.control("stretched").checked = slender > SLENDER[1];
    this.control("range").querySelector("[value=frame]").hidden = run.frames.length < 2;
    for (const name of ["stretched", "loads", "pressure", "foundation", "mesh", "initial", "names", "marks", "directions"]) {
      Object.defineProperty(this, name, { get: () => this.control(name).checked });
    }
    const has = { loads: run.largestLoad, pressure: run.topPressure, foundation: run.curves.length };
    for (const [name, there] of Object.entries(has)) this.control(name).closest("label").hidden = !there;
  }

  charts() {
    const { run } = this, [contact, along] = [".contact", ".along"].map(name => this.root.querySelector(name));
    this.along = along;
    contact.hidden = !run.curves.length;
    const tall = run.box[1][1] - run.box[0][1];
    this.titles = [];
    this.contact = run.curves.map((curve, part) => {
      const place = contact.appendChild(document.createElement("div")), highest = run.topPressure / run.units.stress.factor;
      this.titles.push(place.appendChild(document.createElement("p")));
      return new Chart(place, `arc length (${run.units.length.name})`,
        [`pressure (${run.units.stress.name})`, `gap (${run.units.length.name})`],
        [[0, 1.08 * highest || 1], [Math.min(0, run.leastGap), run.largestGap > 1e-9 * tall ? 1.08 * run.largestGap : tall]]);
    });
  }

  // The name of a part of Γ_C, and the largest pressure if the axis leaves it out.
  titleOf(part) {
    const { run, frame } = this, largest = run.frames[frame].contact[part].pressure.reduce((a, b) => Math.max(a, b), 0);
    const { name, factor } = run.units.stress, isClipped = largest > 1.08 * run.topPressure;
    return run.curves[part].title + (isClipped ? `; clipped: the pressure goes up to ${short(largest / factor)} ${name}` : "");
  }

  listen() {
    const { root, canvas } = this;
    const changed = event => {
      const { name, value } = event.target, { factor } = this;
      if (name === "frame") { this.stop(); return this.show(Number(value)); }
      if (["low", "high"].includes(name)) this.control("range").value = "hand";
      if (name === "stretched") this.fit();
      if (name === "factor") this.hint(factor === Number(value) ? "" : `Displacements are multiplied by 0 to ${LARGEST_FACTOR}; shown is ${factor}.`);
      this.show(this.frame);
    };
    for (const kind of ["input", "change"]) root.addEventListener(kind, changed);
    const actions = {
      play: () => this.timer ? this.stop() : this.play(), fit: () => { this.fit(); this.draw(); },
      auto: () => { this.control("factor").value = this.run.automatic; this.show(this.frame); },
      one: () => { this.control("factor").value = 1; this.show(this.frame); },
      line: () => this.startLine(), csv: () => this.saveLine(), png: () => this.savePicture("png"), svg: () => this.savePicture("svg"),
    };
    root.addEventListener("click", event => { actions[event.target.dataset?.action]?.(); });
    new ResizeObserver(() => { this.fit(); this.draw(); }).observe(canvas.parentElement);
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      this.zoomBy(Math.exp(-0.0015 * event.deltaY), this.pixel(event));
    }, { passive: false });
    const held = new Map();
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      held.set(event.pointerId, this.pixel(event));
      if (held.size === 1) this.pressed = this.pixel(event);
    });
    canvas.addEventListener("pointermove", event => {
      const now = this.pixel(event), before = held.get(event.pointerId);
      if (before) {
        const others = [...held].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const apart = at => Math.hypot(at[0] - others[0][0], at[1] - others[0][1]) || 1;
        if (others.length) this.zoomBy(apart(now) / apart(before), others[0]);
        else this.moveBy([now[0] - before[0], now[1] - before[1]]);
        held.set(event.pointerId, now);
      }
      this.tell(now);
    });
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, event => {
      const now = this.pixel(event);
      if (kind === "pointerup" && this.pressed && Math.hypot(now[0] - this.pressed[0], now[1] - this.pressed[1]) < 4) this.click(now);
      held.delete(event.pointerId);
    });
    canvas.addEventListener("dblclick", () => { this.fit(); this.draw(); });
    root.addEventListener("keydown", event => {
      if (event.target.matches("input, select, button")) return;
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (step) { this.stop(); this.show(Math.min(Math.max(this.frame + step, 0), this.run.frames.length - 1)); }
      if (event.key === " ") { event.preventDefault(); actions.play(); }
    });
  }

  pixel(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  // Pixels of a place of the picture, and back.
  screen([x, y]) {
    const [across, up] = this.stretch;
    return [this.width / 2 + this.zoom * across * (x - this.centre[0]), this.height / 2 - this.zoom * up * (y - this.centre[1])];
  }
  place([x, y]) {
    const [across, up] = this.stretch;
    return [this.centre[0] + (x - this.width / 2) / this.zoom / across, this.centre[1] - (y - this.height / 2) / this.zoom / up];
  }

  hint(words) { this.root.querySelector("output.hint").value = words; }
  isSeen([x, y]) { return x >= 0 && y >= 0 && x <= this.width && y <= this.height; }

  // Shows the whole body, between margins for its loads, the labels and the colour bar.
  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement, [[left, bottom], [right, top]] = this.box();
    Object.assign(this, { width, height });
    const [before, after, above, below] = this.isNarrow ? [50, 50, 80, 105] : [70, 130, 60, 70];
    const zooms = [(width - before - after) / (right - left || 1), (height - above - below) / (top - bottom || 1)];
    this.zoom = Math.max(Math.min(...zooms), 1e-12);
    this.stretch = zooms.map(of => this.stretched ? Math.max(of / this.zoom, 1) : 1);
    this.centre = [(left + right + (after - before) / this.zoom / this.stretch[0]) / 2,
      (bottom + top + (above - below) / this.zoom / this.stretch[1]) / 2];
  }

  // Corners around the body as it is shown, and around those of `run`, which contain the foundation, for a usual factor.
  box() {
    const [low, high] = this.run.corners(this.frame, this.factor), [[left, bottom], [right, top]] = this.run.box;
    if (this.factor > this.run.automatic) return [low, high];
    return [[Math.min(left, low[0]), Math.min(bottom, low[1])], [Math.max(right, high[0]), Math.max(top, high[1])]];
  }

  zoomBy(by, [x, y]) {
    const fixed = this.place([x, y]);
    this.zoom *= by;
    const now = this.place([x, y]);
    this.centre = this.centre.map((of, axis) => of + fixed[axis] - now[axis]);
    this.draw();
  }

  moveBy([dx, dy]) {
    this.centre = [this.centre[0] - dx / this.zoom / this.stretch[0], this.centre[1] + dy / this.zoom / this.stretch[1]];
    this.draw();
  }

  // Shows a frame with the chosen field.
  show(frame) {
    if (!this.run.frames[frame].columns) return;
    this.frame = frame;
    this.control("frame").value = frame;
    this.root.querySelector("output.moment").value = this.moment;
    this.shown = this.run.values(frame, this.field);
    this.body.move(frame);
    this.body.colour(this.shown);
    this.range = this.chosenRange();
    this.extremes = this.run.extremes(this.field, frame, this.material);
    if (!this.width) this.fit();
    this.contact.forEach((chart, part) => chart.show(contactData(this.run, frame, part)));
    this.titles.forEach((title, part) => { title.textContent = this.titleOf(part); });
    this.showLine();
    this.draw();
    if (this.pointed) this.tell(this.pointed);
  }

  chosenRange() {
    const kind = this.control("range").value, { factor } = this.unit, { run, field, material, frame } = this;
    const all = [...run.frames.keys()].filter(k => run.frames[k].columns), key = `${field} ${material}`;
    if (kind === "frame") return this.written(run.range(field, [frame], material));
    if (!this.ranges.has(key)) this.ranges.set(key, run.range(field, all, material));
    const found = { ...this.ranges.get(key) };
    if (kind !== "hand") return this.written(found);
    const [low, high] = ["low", "high"].map(name => this.control(name).valueAsNumber * factor);
    return Number.isFinite(high - low) && low < high ? { ...found, low, high } : found;
  }

  // Writes the range into its fields, from which one goes on by hand.
  written(range) {
    for (const name of ["low", "high"]) this.control(name).value = short(range[name] / this.unit.factor);
    return range;
  }

  // Draws before the next repaint, and the mesh of many elements when the picture rests.
  draw() {
    cancelAnimationFrame(this.asked);
    clearTimeout(this.rest);
    const paint = mesh => { this.body.draw(this, mesh); this.overlay.innerHTML = this.drawing.draw(this); };
    const isLater = this.mesh && this.run.order * this.run.size > MANY;
    this.asked = requestAnimationFrame(() => paint(this.mesh && !isLater));
    if (isLater) this.rest = setTimeout(paint, REST, true);
  }

  // The locator of the shown state, or of the undeformed body.
  locator(factor = this.factor) {
    const key = factor ? `${this.frame} ${factor}` : "undeformed", { locators } = this;
    if (!locators.has(key)) {
      for (const old of locators.keys()) if (old !== "undeformed") locators.delete(old);
      locators.set(key, new Locator(this.run, this.frame, factor));
    }
    return locators.get(key);
  }

  // Says what is under the pointer: place in the undeformed body, value, material.
  tell(pixel) {
    this.pointed = pixel;
    const spot = this.timer ? null : this.locator().find(this.place(pixel), this.material), { run } = this;
    this.root.querySelector("output.value").value = spot ? this.said(spot) : "";
  }

  said(spot) {
    const { run, unit } = this, at = [run.x, run.y].map((of, axis) => run.interpolate(of, spot) + run.origin[axis]);
    const value = run.interpolate(this.shown, spot) / unit.factor, name = run.materialNames[run.materials[spot.element]];
    // Places have six digits of the body's size, stresses five of the largest one.
    const size = Math.max(...run.box[1].map((high, axis) => high - run.box[0][axis]));
    const decimals = Math.min(Math.max(5 - Math.floor(Math.log10(size)), 0), 100);
    const noise = unit.isStress ? 1e-7 * run.stressTop / unit.factor : 0;
    const digits = (x, least = 0) => Math.abs(x) < least ? "0" : String(Number(x.toPrecision(6)));
    const material = run.materialNames.length > 1 ? `, ${name}` : "";
    return `(${at.map(x => Number(x.toFixed(decimals))).join(", ")}) ${run.units.length.name}: ${unit.label} ${digits(value, noise)} ${unit.name}${material}${this.contactAt(spot)}`;
  }

  // Pressure and gap at the nearest node of Γ_C, if that is a node of the element.
  contactAt({ element, parts }) {
    const { run } = this, corner = parts.indexOf(Math.max(...parts)), node = run.elements[run.order * element + corner];
    for (const [c, { nodes }] of run.curves.entries()) {
      const k = nodes.indexOf(node), { pressure, gap } = run.frames[this.frame].contact[c];
      if (k >= 0) return `; at the contact node pressure ${short(pressure[k] / run.units.stress.factor)} ${run.units.stress.name}, gap ${short(gap[k])} ${run.units.length.name}`;
    }
    return "";
  }

  // One click begins a line, the next one ends it.
  startLine() {
    this.ends = [];
    this.cut = [];
    this.isAsking = true;
    this.hint("Click on the body where the line begins, and where it ends.");
  }

  click(pixel) {
    if (!this.isAsking) return;
    const spot = this.locator().find(this.place(pixel));
    if (!spot) return;
    this.ends.push([this.run.x, this.run.y].map(of => this.run.interpolate(of, spot)));
    if (this.ends.length < 2) return;
    this.isAsking = false;
    this.hint("");
    this.cut = cutBetween(this.run, this.locator(0), ...this.ends);
    this.showLine();
    this.draw();
  }

  lineData() {
    const { factor } = this.unit;
    return [this.cut.map(of => of.distance), this.cut.map(({ spot }) => spot ? this.run.interpolate(this.shown, spot) / factor : null)];
  }

  showLine() {
    this.along.hidden = !this.cut.length;
    if (!this.cut.length) return;
    const label = `${this.unit.label}${this.unit.name ? ` (${this.unit.name})` : ""}`, length = this.length;
    if (this.lineLabel !== label) {
      this.line?.remove();
      this.line = new Chart(this.along.querySelector("div"), `distance (${length})`, [label], [null]);
      this.lineLabel = label;
    }
    const [from, to] = this.ends.map(end => `(${end.map((x, axis) => short(x + this.run.origin[axis])).join(", ")})`);
    this.along.querySelector("p").textContent = [`${this.unit.label} from ${from} to ${to}`, this.moment].filter(Boolean).join(", ");
    this.line.show(this.lineData());
  }

  // The numbers are in the units of the scene, as in all other files.
  saveLine() {
    const [distances, shown] = this.lineData(), { origin } = this.run, { factor } = this.unit;
    const values = shown.map(value => value === null ? "" : value * factor);
    const rows = this.cut.map(({ at }, k) => [distances[k], ...at.map((x, axis) => x + origin[axis]), values[k]].join(","));
    saved(`${this.run.name}-line.csv`, new Blob([["distance,x,y," + this.field, ...rows, ""].join("\n")], { type: "text/csv" }));
  }

  // The picture as text: the coloured body as an image, the rest as vectors.
  picture() {
    this.body.draw(this, this.mesh);
    const { width, height } = this;
    return `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" font-family="sans-serif" font-size="12">`
      + `<image href="${this.canvas.toDataURL()}" width="${width}" height="${height}"/>${this.drawing.draw(this)}</svg>`;
  }

  savePicture(kind) {
    const blob = new Blob([this.picture()], { type: "image/svg+xml" }), name = `${this.run.name}-${this.field}`;
    if (kind === "svg") return saved(`${name}.svg`, blob);
    const image = new Image();
    image.onload = () => {
      const canvas = Object.assign(document.createElement("canvas"), { width: 2 * this.width, height: 2 * this.height });
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob(found => saved(`${name}.png`, found));
    };
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(this.picture())}`;
  }

  play() {
    const last = this.run.frames.length - 1;
    if (last < 1) return;
    if (this.frame === last) this.frame = -1;
    this.root.querySelector("[data-action=play]").textContent = "stop";
    this.timer = setInterval(() => {
      this.show(this.frame + 1);
      if (this.frame === last) this.stop();
    }, Math.max(40, Math.min(250, 6000 / last)));
  }

  stop() {
    clearInterval(this.timer);
    this.timer = null;
    this.root.querySelector("[data-action=play]").textContent = "play";
  }
}

const root = document.getElementById("viewer");
Run.read().then(async run => {
  const view = new View(run, root), last = run.frames.length - 1;
  // The last state is seen while the others are read.
  await new Promise(done => requestAnimationFrame(() => setTimeout(done)));
  for (let k = 0; k < last; k++) await run.readFrame(k);
  view.ranges.clear();
  view.show(view.frame);
  root.view = view;
}).catch(error => {
  root.querySelector("output.hint").value = `This browser cannot show the fields: ${error.message}.`;
});
