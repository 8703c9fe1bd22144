// Curves beside the body, by uPlot: pressure and gap along Γ_C, and a field along a line.

class Chart {
  // `names` are the labels of the curves; `scales` their scales, each with an axis of its own.
  constructor(place, abscissa, names, scales) {
    this.place = place;
    const colours = [BLUE, RED];
    const axis = { stroke: INK, grid: { stroke: "#eceff2" }, size: place.clientWidth < 400 ? 52 : 64, values: (_, ticks) => ticks.map(tick => short(tick)) };
    this.plot = new libraries.uPlot({
      width: this.width(), height: 240, cursor: { drag: { x: true, y: false } },
      scales: { x: { time: false }, ...Object.fromEntries(scales.map((range, k) => [`y${k}`, range ? { range } : {}])) },
      series: [{ label: abscissa, value: (_, value) => value == null ? "–" : short(value) }, ...names.map((label, k) => ({
        label, scale: `y${k}`, stroke: colours[k], width: 1.6, points: { show: false },
        value: (_, value) => value == null ? "–" : short(value) }))],
      axes: [{ ...axis, size: 44, label: abscissa, labelSize: 18 }, ...names.map((label, k) => ({
        ...axis, scale: `y${k}`, side: k ? 1 : 3, label, labelSize: 18, stroke: colours[k], grid: k ? { show: false } : axis.grid }))],
    }, [[], ...names.map(() => [])], place);
    new ResizeObserver(() => this.plot.setSize({ width: this.width(), height: 240 })).observe(place);
  }

  width() { return Math.max(this.place.clientWidth, 200); }

  show(data) { this.plot.setData(data); }

  remove() { this.plot.destroy(); }
}

// Curves of a part of Γ_C in a frame: arc length, pressure, gap.
function contactData(run, frame, part) {
  const { arc } = run.curves[part], { pressure, gap } = run.frames[frame].contact[part];
  return [arc, Array.from(pressure, p => p / run.units.stress.factor), Array.from(gap)];
}

// A straight line through the undeformed body: 400 spots with their distances from its start.
function cutBetween(run, locator, from, to) {
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  return Array.from({ length: 401 }, (_, k) => {
    const at = from.map((x, axis) => x + k / 400 * (to[axis] - x));
    return { distance: k / 400 * length, at, spot: locator.find(at) };
  });
}

function saved(name, blob) {
  const link = Object.assign(document.createElement("a"), { download: name, href: URL.createObjectURL(blob) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
