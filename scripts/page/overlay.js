// The vector part of the picture, as SVG: outline, supports, foundation, loads, pressure, extremes, colour bar, scale.

const SVG = {
  line: (points, style) => points.length < 2 ? "" :
    `<polyline fill="none" points="${points.map(p => p.map(x => x.toFixed(1)).join(",")).join(" ")}" ${style}/>`,
  text: ([x, y], words, style = "") =>
    `<text x="${x.toFixed(1)}" y="${y.toFixed(1)}" ${style}>${SVG.escaped(words)}</text>`,
  escaped: words => String(words).replace(/[&<>"]/g, letter => `&#${letter.charCodeAt(0)};`),
};
const OPEN_END = 12; // pixels of the arrow ends of the colour bar

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
      this.cut, this.colourBar, this.scale];
    return parts.map(part => part.call(this, view)).join("");
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
      const line = nodes.map(k => this.node(view, k)), [x, y] = line[line.length >> 1];
      const label = view.names ? SVG.text([x + 5, y - 5], name,
        `fill="${colour}" paint-order="stroke" stroke="#fff" stroke-width="3"`) : "";
      return (colour === BLUE ? SVG.line(line, `stroke="${colour}" stroke-width="3"`) : "") + label;
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
    return frames[view.frame].loads.map(({ at, moved, force, presses }) => at.map(([x, y], k) => {
      const [sx, sy] = view.screen([x + view.factor * moved[k][0], y + view.factor * moved[k][1]]);
      const [dx, dy] = [50 * force[k][0] / largestLoad, -50 * force[k][1] / largestLoad];
      return presses[k] ? this.arrow([sx - dx, sy - dy], [dx, dy], RED) : this.arrow([sx, sy], [dx, dy], RED);
    }).join("")).join("");
  }

  // The contact pressure as a curve outside of the body; the top of the scale of all times is 60 pixels away.
  pressure(view) {
    const { curves, frames, topPressure } = this.run;
    if (!view.pressure || !topPressure) return "";
    return curves.map(({ nodes }, c) => {
      const { pressure } = frames[view.frame].contact[c], line = nodes.map(k => this.node(view, k));
      const off = beside(line, k => 60 * Math.min(pressure[k] / topPressure, 1.2));
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
          const [dx, dy] = [size * Math.cos(turn), -size * Math.sin(turn)], colour = stress > 0 ? RED : BLUE;
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
    const { least, largest } = this.run.extremes(view.field, view.frame, view.material);
    const halo = 'paint-order="stroke" stroke="#fff" stroke-width="3"';
    // Equal up to rounding: the field has no extremes.
    const isFlat = largest.value - least.value <= 1e-6 * Math.max(Math.abs(least.value), Math.abs(largest.value));
    const shown = isFlat ? [] : [["min", least], ["max", largest]];
    const extremes = shown.map(([word, { value, node }]) => {
      const [x, y] = this.node(view, node);
      return `<circle cx="${x}" cy="${y}" r="4" fill="none" stroke="${INK}" stroke-width="1.4"/>`
        + SVG.text([x + 7, y + 4], `${word} ${short(value / view.unit.factor, (view.range.high - view.range.low) / view.unit.factor)}`, halo);
    });
    const singular = !view.isLast || !view.unit.isStress ? [] : this.run.singular.map(({ at, reason }) => {
      const [x, y] = this.node(view, at);
      return `<circle cx="${x}" cy="${y}" r="8" fill="none" stroke="${RED}" stroke-width="1.6"><title>`
        + `${SVG.escaped(reason)}</title></circle>` + SVG.text([x + 10, y + 18], "singular", `fill="${RED}" ${halo}`);
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

  colourBar(view) {
    const { range, unit, width, height } = view, [x, top, tall] = [width - 92, 44, Math.max(height - 110, 60)];
    const [low, high] = [range.low / unit.factor, range.high / unit.factor], table = this.run.colours[view.colours];
    const colour = part => `rgb(${table[Math.round(255 * part)].join(",")})`;
    const bands = view.bands || 64;
    const boxes = Array.from({ length: bands }, (_, k) => `<rect x="${x}" y="${(top + tall * (1 - (k + 1) / bands)).toFixed(2)}" `
      + `width="16" height="${(tall / bands + 0.5).toFixed(2)}" fill="${colour((k + 0.5) / bands)}"/>`).join("");
    const end = (base, tip, part) => `<polygon points="${x},${base} ${x + 16},${base} ${x + 8},${tip}" fill="${colour(part)}"/>`;
    const labels = ticks(low, high, 6).map(value => {
      const y = high > low ? top + tall * (1 - (value - low) / (high - low)) : top + tall / 2;
      return SVG.line([[x + 16, y], [x + 20, y]], `stroke="${INK}"`) + SVG.text([x + 23, y + 4], short(value));
    }).join("");
    const title = `${unit.label}${unit.name ? ` (${unit.name})` : ""}`;
    return `<rect x="${x - 6}" y="${top - 14}" width="98" height="${tall + 28}" fill="#fff" fill-opacity="0.75"/>` + boxes
      + (range.largest > range.high * (1 + 1e-6) ? end(top, top - OPEN_END, 1) : "")
      + (range.least < range.low - 1e-6 * Math.abs(range.low) ? end(top + tall, top + tall + OPEN_END, 0) : "") + labels
      + SVG.text([width - 8, 18], title, `text-anchor="end" font-weight="600"`) + SVG.text([8, 18], view.moment)
      + SVG.text([8, 34], view.factor === 1 ? "" : `displacements × ${short(view.factor)}`);
  }

  // A length in place of axes.
  scale({ zoom, height, length }) {
    const size = ticks(0, 160 / zoom, 3).pop();
    return SVG.line([[12, height - 18], [12, height - 12], [12 + size * zoom, height - 12], [12 + size * zoom, height - 18]],
      `stroke="${INK}" stroke-width="1.2"`) + SVG.text([16, height - 18], `${short(size)} ${length}`);
  }
}
