// The vector part of the picture, as SVG: outline, supports, foundation, loads, pressure, extremes, colour bar, scale.

const SVG = {
  line: (points, style) => points.length < 2 ? "" :
    `<polyline fill="none" points="${points.map(p => p.map(x => x.toFixed(1)).join(",")).join(" ")}" ${style}/>`,
  text: ([x, y], words, style = "") =>
    `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" ${style}>${SVG.escaped(words)}</text>`,
  polygon: (points, fill) => `<polygon points="${points.map(p => p.map(x => x.toFixed(2)).join(",")).join(" ")}" fill="${fill}"/>`,
  // The width of words of the weight `font`, pixels.
  wide(words, font = "400") {
    this.pen ??= document.createElement("canvas").getContext("2d");
    this.pen.font = `${font} 12px sans-serif`;
    return this.pen.measureText(words).width;
  },
  escaped: words => String(words).replace(/[&<>"]/g, letter => `&#${letter.charCodeAt(0)};`),
};
const OPEN_END = 12; // pixels of the arrow ends of the colour bar
const TALL = 15; // pixels of the height of a line of text
const CLOSE = 9; // pixels; arrows that are closer than this to the one before are left out
// Where a label is tried: directions from its point, and distances, pixels; a far one has a line to its point.
const AROUND = [[1, 0], [-1, 0], [1, -1], [1, 1], [-1, -1], [-1, 1], [0, -1], [0, 1]], DISTANCES = [7, 13, 24, 40, 60, 90], FAR = 20;

// A number with four digits, or fewer if the last ones are below a millionth of `scale`.
function short(value, scale = 0) {
  if (Math.abs(value) <= 1e-6 * Math.abs(scale)) return "0";
  return String(Number(value.toPrecision(4)));
}

// Values of at most `count` ticks between two numbers: multiples of 1, 2 or 5 times a power of ten.
function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map(of => of * power).find(of => of >= rough * (1 - 1e-9));
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}

// A line of the screen, moved to its right by so many pixels at each point. Its direction is that between points two pixels away,
// because nodes may be closer than the rounding of pixels.
function beside(line, far) {
  const away = (k, step) => {
    let at = k;
    while (line[at + step] && Math.hypot(line[at][0] - line[k][0], line[at][1] - line[k][1]) < 2) at += step;
    return line[at];
  };
  return line.map(([x, y], k) => {
    const [[ax, ay], [bx, by]] = [away(k, -1), away(k, 1)], part = far(k) / (Math.hypot(bx - ax, by - ay) || 1);
    return [x - part * (by - ay), y + part * (bx - ax)];
  });
}

class Overlay {
  constructor(run) {
    this.run = run;
  }

  // The SVG elements for a view, which has the function `screen` from places to pixels.
  draw(view) {
    const parts = [this.foundation, this.outline, this.supports, this.directions, this.pressure, this.loads, this.marks,
      this.cut, this.colourBar, this.scale, this.labels];
    Object.assign(this, { taken: [], asked: [] });
    return parts.map(part => part.call(this, view)).join("");
  }

  // Words whose place is fixed, at the end of a line if `isRight`.
  fixed([x, y], words, isRight = false, font = "400") {
    const wide = SVG.wide(words, font), left = isRight ? x - wide : x;
    this.taken.push([left, y - 12, left + wide, y - 12 + TALL]);
    return SVG.text([left, y], words, `font-weight="${font}"`);
  }

  // A mark around a point, which labels do not cover.
  circle(view, [x, y], radius, style, title = "") {
    this.taken.push([x - radius, y - radius, x + radius, y + radius]);
    return `<circle cx="${x.toFixed(1)}" cy="${y.toFixed(1)}" r="${radius}" fill="none" ${style}>${title}</circle>`;
  }

  // Words beside points, where they cover no other words; without such a place they are left out.
  labels({ width, height }) {
    const isFree = ([left, top, right, bottom]) => left >= 0 && top >= 0 && right <= width && bottom <= height
      && this.taken.every(([a, b, c, d]) => right < a || c < left || bottom < b || d < top);
    return this.asked.map(({ at: [x, y], words, colour }) => {
      const wide = SVG.wide(words);
      for (const [far, [dx, dy]] of DISTANCES.flatMap(distance => AROUND.map(to => [distance, to]))) {
        const left = x + far * dx - wide * (1 - dx) / 2, top = y + far * dy - TALL * (1 - dy) / 2;
        const box = [left - 2, top - 2, left + wide + 2, top + TALL + 2]; // with the halo
        if (!isFree(box)) continue;
        this.taken.push(box);
        const end = [Math.min(Math.max(x, left), left + wide), Math.min(Math.max(y, top), top + TALL)];
        return (far > FAR ? SVG.line([[x, y], end], `stroke="${colour}" stroke-width="0.7"`) : "")
          + SVG.text([left, top + 12], words, `fill="${colour}" paint-order="stroke" stroke="#fff" stroke-width="3"`);
      }
      return "";
    }).join("");
  }

  node(view, k, factor = view.factor) {
    const { nodes, frames } = this.run, { u_x: u, u_y: v } = frames[view.frame].columns;
    return view.screen([nodes[2 * k] + factor * u[k], nodes[2 * k + 1] + factor * v[k]]);
  }

  outline(view) {
    const lines = factor => this.run.outline.map(path => path.map(k => this.node(view, k, factor)));
    const initial = view.initial && view.factor !== 0
      ? lines(0).map(line => SVG.line(line, `stroke="${INK}" stroke-width="0.9" stroke-dasharray="5 3"`)) : [];
    return [...lines(view.factor).map(line => SVG.line(line, `stroke="${INK}" stroke-width="1"`)), ...initial].join("");
  }

  supports(view) {
    return this.run.boundaries.map(({ name, colour, nodes }) => {
      const line = nodes.map(k => this.node(view, k)), seen = line.filter(at => view.isSeen(at));
      if (view.names && seen.length) this.asked.push({ at: seen[seen.length >> 1], words: name, colour });
      return colour === BLUE ? SVG.line(line, `stroke="${colour}" stroke-width="3"`) : "";
    }).join("");
  }

  // The foundation, as pictures show it at the factor 1 and at the automatic one; between them it is linear.
  foundation(view) {
    if (!view.foundation) return "";
    return this.run.frames[view.frame].foundation.map(({ at, by }) => {
      const line = at.map(([x, y], k) => view.screen([x + view.factor * by[k][0], y + view.factor * by[k][1]]));
      // The body is on the left of the line.
      return SVG.line(beside(line, () => 5), 'stroke="#c3cad2" stroke-width="8"') + SVG.line(line, `stroke="${INK}" stroke-width="2"`);
    }).join("");
  }

  arrow([x, y], [dx, dy], colour) {
    const length = Math.hypot(dx, dy);
    if (length < 3) return "";
    const [ex, ey] = [dx / length, dy / length], head = Math.min(7, length);
    const side = s => [x + dx - head * ex + s * 0.4 * head * ey, y + dy - head * ey - s * 0.4 * head * ex];
    return SVG.line([[x, y], [x + dx, y + dy]], `stroke="${colour}" stroke-width="1.2"`)
      + SVG.line([side(1), [x + dx, y + dy], side(-1)], `stroke="${colour}" stroke-width="1.2"`);
  }

  // Tractions on the displaced boundary; the largest of all times is 50 pixels long.
  loads(view) {
    const { frames, largestLoad } = this.run;
    if (!view.loads || !largestLoad) return "";
    return frames[view.frame].loads.map(({ at, moved, force, presses }) => {
      let last = [-Infinity, 0];
      return at.map(([x, y], k) => {
        const [sx, sy] = view.screen([x + view.factor * moved[k][0], y + view.factor * moved[k][1]]);
        if (Math.hypot(sx - last[0], sy - last[1]) < CLOSE) return "";
        last = [sx, sy];
        const [dx, dy] = [50 * force[k][0] / largestLoad, -50 * force[k][1] / largestLoad];
        return presses[k] ? this.arrow([sx - dx, sy - dy], [dx, dy], RED) : this.arrow([sx, sy], [dx, dy], RED);
      }).join("");
    }).join("");
  }

  // The contact pressure as a curve outside of the body; the top of the scale of all times is 60 pixels away, or 40.
  pressure(view) {
    const { curves, frames, topPressure } = this.run;
    if (!view.pressure || !topPressure) return "";
    return curves.map(({ nodes }, c) => {
      const { pressure } = frames[view.frame].contact[c], line = nodes.map(k => this.node(view, k));
      const off = beside(line, k => (view.isNarrow ? 40 : 60) * Math.min(pressure[k] / topPressure, 1.2));
      const area = [...off, ...line.reverse()].map(p => p.map(x => x.toFixed(1)).join(",")).join(" ");
      return `<polygon points="${area}" fill="${BLUE}" fill-opacity="0.25"/>` + SVG.line(off, `stroke="${BLUE}" stroke-width="1.2"`);
    }).join("");
  }

  // Crosses along the principal directions, 28 along the longer side of the picture: red tension, blue compression. Their
  // areas are in proportion to the stresses.
  directions(view) {
    if (!view.directions) return "";
    const step = Math.max(view.width, view.height) / 28, { columns } = this.run.frames[view.frame], found = [];
    const { largest } = this.run.range("von_mises", [view.frame], view.material), top = view.stressTop || largest || 1;
    for (let y = step / 2; y < view.height; y += step) {
      for (let x = step / 2; x < view.width; x += step) {
        const spot = view.locator().find(view.place([x, y]), view.material);
        if (!spot) continue;
        const [xx, yy, xy] = ["xx", "yy", "xy"].map(name => this.run.interpolate(columns[name], spot));
        const angle = Math.atan2(2 * xy, xx - yy) / 2, middle = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
        [[middle + half, angle], [middle - half, angle + Math.PI / 2]].forEach(([stress, turn]) => {
          const size = Math.sqrt(Math.min(Math.abs(stress) / top, 1)) * 0.45 * step;
          if (size < 1) return;
          const [across, up] = [view.stretch[0] * Math.cos(turn), view.stretch[1] * Math.sin(turn)], long = Math.hypot(across, up);
          const [dx, dy] = [size * across / long, -size * up / long], colour = stress > 0 ? RED : BLUE;
          for (const [stroke, width] of [["#fff", 2.6], [colour, 1.2]]) {
            found.push(SVG.line([[x - dx, y - dy], [x + dx, y + dy]], `stroke="${stroke}" stroke-width="${width}"`));
          }
        });
      }
    }
    return found.join("");
  }

  // The places of the extremes of the shown field, and places where a stress is singular.
  marks(view) {
    if (!view.marks) return "";
    const { least, largest } = view.extremes, { factor, isStress } = view.unit;
    // Equal up to rounding: the field has no extremes.
    const isFlat = largest.value - least.value <= 1e-6 * Math.max(Math.abs(least.value), Math.abs(largest.value));
    const extremes = (isFlat ? [] : [["max", largest], ["min", least]]).map(([word, { value, node }]) => {
      const at = this.node(view, node);
      if (!view.isSeen(at)) return "";
      this.asked.push({ at, words: `${word} ${short(value / factor, (view.range.high - view.range.low) / factor)}`, colour: INK });
      return this.circle(view, at, 4, `stroke="${INK}" stroke-width="1.4"`);
    });
    const named = [];
    const singular = !view.isLast || !isStress ? [] : this.run.singular.map(({ at: node, reason }) => {
      const at = this.node(view, node);
      if (!view.isSeen(at)) return "";
      // Close ones have one label.
      if (!named.some(([x, y]) => Math.hypot(x - at[0], y - at[1]) < 40)) named.push(at) && this.asked.push({ at, words: "singular", colour: RED });
      return this.circle(view, at, 8, `stroke="${RED}" stroke-width="1.6"`, `<title>${SVG.escaped(reason)}</title>`);
    });
    return [...extremes, ...singular].join("");
  }

  cut(view) {
    if (!view.cut.length) return "";
    const line = view.cut.map(({ spot }) => spot && this.spot(view, spot));
    const parts = [[]];
    for (const point of line) point ? parts[parts.length - 1].push(point) : parts.push([]);
    return parts.map(part => SVG.line(part, 'stroke="#fff" stroke-width="4"') + SVG.line(part, `stroke="${RED}" stroke-width="1.6"`)).join("");
  }

  // The pixels of a spot of the body.
  spot(view, spot) {
    const { x, y } = this.run, { u_x: u, u_y: v } = this.run.frames[view.frame].columns;
    const at = (place, moved) => this.run.interpolate(place, spot) + view.factor * this.run.interpolate(moved, spot);
    return view.screen([at(x, u), at(y, v)]);
  }

  // The colour bar on the right, or below in a narrow picture; the texts in the upper corners.
  colourBar(view) {
    const { range, unit, width, height, isNarrow } = view, slack = 1e-3 * (range.high - range.low);
    const [long, thick] = isNarrow ? [width - 56, 12] : [Math.max(height - 110, 60), 16];
    const [low, high] = [range.low / unit.factor, range.high / unit.factor], table = this.run.colours[view.colours];
    const colour = part => `rgb(${table[Math.round(255 * part)].join(",")})`;
    // The pixels at a part of the bar's length, so many pixels away from its edge.
    const at = (part, away) => isNarrow ? [28 + long * part, height - 34 + away] : [width - 92 + away, 44 + long * (1 - part)];
    const bands = view.bands || 64, whole = isNarrow ? [0, height - 48, width, height] : [width - 98, 30, width, 58 + long];
    const boxes = Array.from({ length: bands }, (_, k) => [k / bands, (k + 1) / bands + 0.5 / long]).map(([a, b], k) =>
      SVG.polygon([at(a, 0), at(b, 0), at(b, thick), at(a, thick)], colour((k + 0.5) / bands))).join("");
    const end = (part, tip) => SVG.polygon([at(part, 0), at(part, thick), at(tip, thick / 2)], colour(part));
    const labels = ticks(low, high, isNarrow ? Math.max(2, Math.floor(long / 70)) : 6).map(value => {
      const part = high > low ? (value - low) / (high - low) : 0.5, [x, y] = at(part, thick + 7), words = short(value);
      return SVG.line([at(part, thick), at(part, thick + 4)], `stroke="${INK}"`)
        + SVG.text(isNarrow ? [x - SVG.wide(words) / 2, y + 9] : [x, y + 4], words);
    }).join("");
    const title = `${unit.label}${unit.name ? ` (${unit.name})` : ""}`, [x, y] = view.stretch.map(of => short(Number(of.toPrecision(2))));
    const stretched = x > 1 ? `x × ${x}` : y > 1 ? `y × ${y}` : "", magnified = view.factor === 1 ? "" : `displacements × ${short(view.factor)}`;
    const note = [magnified, stretched].filter(Boolean).join(", ");
    const isCrowded = Math.max(SVG.wide(view.moment), SVG.wide(note)) + SVG.wide(title, "600") > width - 40;
    this.taken.push(whole);
    return `<g class="bar"><rect x="${whole[0]}" y="${whole[1]}" width="${whole[2] - whole[0]}" height="${whole[3] - whole[1]}" fill="#fff" `
      + `fill-opacity="0.75"/>${boxes}` + (range.largest > range.high + slack ? end(1, 1 + OPEN_END / long) : "")
      + (range.least < range.low - slack ? end(0, -OPEN_END / long) : "") + labels + "</g>"
      + this.fixed([width - 8, isCrowded ? 50 : 18], title, true, "600") + this.fixed([8, 18], view.moment)
      + this.fixed([8, view.moment ? 34 : 18], note);
  }

  // A length in place of axes.
  scale({ zoom, stretch, height, width, length, isNarrow }) {
    const pixels = zoom * stretch[0], size = ticks(0, Math.min(160, width / 3) / pixels, 3).pop(), y = isNarrow ? height - 56 : height - 12;
    return SVG.line([[12, y - 6], [12, y], [12 + size * pixels, y], [12 + size * pixels, y - 6]], `stroke="${INK}" stroke-width="1.2"`)
      + this.fixed([16, y - 6], `${short(size)} ${length}`);
  }
}
