// A figure as a plot. uPlot lays out axes, draws them and the curves, zooms into boxes and shares crosshairs; which values a figure
// has, where its view is, and what is read of it stand here, for pages and the laboratory alike.

const REACH = 48; // px from the pointer within which a point is read
const LEAN = 24; // px of height from which a box zooms the ordinate of a sweep as well
const NONE = new Float64Array(0);
const GONE = { left: -10, top: -10 };

import { Axis, nearest, rises, significant, span } from "./axis.js";
import { hands } from "./hands.js";
import { paintMap, paths } from "./paint.js";

export function element(name, className = "", text = "") {
  const made = document.createElement(name);
  made.className = className;
  made.textContent = text;
  return made;
}

// The colours of the theme in use, read once a theme.
const inks = new Map();
export function ink(name) {
  if (!inks.has(name)) inks.set(name, getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim());
  return inks.get(name);
}
export const forgetInks = () => inks.clear();

// Whether it is a band without a line.
const shade = (one) => one.kind === "band" && !one.y.some(Number.isFinite);
export const swatchKind = (one) => (one.dash ? "line dash" : shade(one) ? "band shade" : one.kind);

// The samples around a place on the abscissa, and how far it is from the first to the second; null outside of the curve.
function bracket({ x }, wanted) {
  const last = x.length - 1, slack = (1e-6 * (x[last] - x[0])) / Math.max(last, 1);
  if (!(wanted >= x[0] - slack && wanted <= x[last] + slack)) return null;
  const k = nearest(x, wanted);
  if (Math.abs(x[k] - wanted) <= slack) return { from: k, to: k, part: 0 };
  const from = x[k] < wanted ? k : k - 1;
  return { from, to: from + 1, part: (wanted - x[from]) / (x[from + 1] - x[from]) };
}

// The value of a curve as it is drawn: that of a sample, or on the line between two; an inner value of the axis.
function at(values, { from, to, part }, axis) {
  const [first, second] = [axis.inner(values[from]), axis.inner(values[to])];
  return part === 0 ? first : first + part * (second - first);
}

export class Plot {
  series = []; // as a figure lists them
  order = []; // as they are drawn
  link = [this]; // plots that show the same abscissa
  cursor = null; // where values are read: { x } of a sweep, { one, k } of a point, { column, row } of a cell
  near = false; // whether it is in sight, or almost
  unseen = true; // whether it must be drawn once it is
  stale = true; // whether uPlot has other data
  least = 0; // the least span of the ordinate
  /** @type {any} */
  u = null;
  announce = (text) => {};
  onchange = () => {};

  // `box` is pointed at and focused; `said` is called with what is read, or null, and `drawn` after each drawing.
  constructor(uPlot, box, { title, x, y, map = null }, { said, drawn } = {}) {
    this.uPlot = uPlot;
    this.box = box;
    this.title = title;
    this.map = map;
    this.x = new Axis(x);
    this.y = new Axis(y);
    this.said = said ?? ((marks) => this.write(marks));
    this.drawn = drawn ?? (() => {});
    this.mount = element("div", "mount");
    this.readout = element("div", "readout");
    this.readout.hidden = true;
    for (const part of [this.mount, this.readout]) part.setAttribute("aria-hidden", "true");
    box.append(this.mount, this.readout);
    this.hands = hands(this);
  }

  get shown() { return this.series.filter((one) => one.shown); }
  get zoomed() { return this.x.zoomed || this.y.zoomed; }

  // Shows these series: { name, ink, kind, width, dash, depth, x, y, low, high }.
  set(series) {
    const style = (all) => JSON.stringify(all.map(({ name, ink, kind, width, dash }) => [name, ink, kind, width, dash]));
    const before = new Map(this.series.map((one) => [one.name, one.shown])), alike = style(series) === style(this.series);
    this.series = series.map((one) => ({ low: NONE, high: NONE, depth: 0, ...one, rising: one.kind !== "points" && rises(one.x), shown: before.get(one.name) ?? true }));
    this.order = [...this.series].sort((a, b) => a.depth - b.depth);
    // Whether each place on the abscissa has one value a curve: then the pointer reads all of them at once.
    this.sweeps = !this.map && this.series.length > 0 && this.series.every((one) => one.rising);
    // Whether the ordinate can be logarithmic: it is, or all its values are positive.
    const [low, high] = span(this.series.filter((one) => !shade(one)).flatMap((one) => [one.y, one.low, one.high]));
    this.canBeLog = !this.map && !this.y.names && (this.y.log || (low > 0 && high > 3 * low));
    this.settle();
    if (!alike) this.discard();
    this.changed();
  }

  // Ends and reach of both axes: those of the curves that are shown, unless the figure fixes them.
  settle() {
    const of = (axis, arrays) => span(arrays.map((values) => Float64Array.from(values, (value) => axis.inner(value))));
    const visible = this.shown.length ? this.shown : this.series;
    this.x.settle(of(this.x, this.series.map((one) => one.x)), this.sweeps ? 0 : 0.04, false);
    this.y.settle(of(this.y, visible.flatMap((one) => [one.y, one.low, one.high])), 0.06, !visible.some((one) => one.kind === "points"));
    if (this.least > this.y.home[1] - this.y.home[0]) {
      const middle = (this.y.home[0] + this.y.home[1]) / 2;
      this.y.home = this.y.view = this.y.reach = [middle - this.least / 2, middle + this.least / 2];
    }
  }

  toggleLog() {
    if (!this.canBeLog) return;
    this.y.log = !this.y.log;
    this.y.view = this.y.home;
    this.settle();
    this.discard();
    this.changed();
  }

  reset() {
    for (const axis of [this.x, this.y]) axis.view = [...axis.home];
    this.moved();
  }

  // After a new view: plots of the same abscissa follow where they begin and end alike.
  moved() {
    const [low, high] = this.x.home, near = (a, b) => Math.abs(a - b) <= 1e-6 * (high - low);
    for (const plot of this.link) {
      if (plot !== this && !(near(plot.x.home[0], low) && near(plot.x.home[1], high))) continue;
      plot.x.view = [...this.x.view];
      plot.changed(false);
    }
  }

  // Draws anew, with new data or in another view; a plot out of sight waits.
  changed(data = true) {
    this.onchange();
    this.stale ||= data;
    if (!this.near) this.unseen = true;
    else this.draw();
  }

  draw() {
    const { clientWidth: width, clientHeight: height } = this.mount, { u, x, y } = this;
    if (!width || !height || !(this.order.length || this.map)) return;
    this.unseen = false;
    if (!u) {
      this.u = new this.uPlot(this.options(width, height), this.data(), this.mount);
    } else {
      u.batch(() => {
        if (u.width !== width || u.height !== height) u.setSize({ width, height });
        if (this.stale) u.setData(this.data(), false);
        this.order.forEach((one, k) => { u.series[k + 1].show = one.shown; });
        u.setScale("y", { min: y.view[0], max: y.view[1] });
        u.setScale("x", { min: x.view[0], max: x.view[1] });
      });
    }
    this.stale = false;
  }

  discard() {
    this.u?.destroy();
    this.u = null;
  }

  data() {
    const of = (axis, values) => Float64Array.from(values, (value) => axis.inner(value));
    if (this.map) return [null, [this.x.home, this.y.home]];
    return [null, ...this.order.map((one) => [of(this.x, one.x), of(this.y, one.y)])];
  }

  // A picture of it, `s` px for one, in other colours.
  async still(s, colour) {
    const [width, height] = [this.mount.clientWidth || 560, this.mount.clientHeight || 300];
    const u = new this.uPlot({ ...this.options(s * width, s * height, colour, s), cursor: { show: false } }, this.data(), element("div"));
    await null;
    const { canvas } = u.ctx;
    u.destroy();
    return canvas;
  }

  options(width, height, colour = ink, s = 1) {
    const font = `${12 * s}px ${getComputedStyle(document.body).fontFamily}`, line = { width: s };
    const clipped = (u, text, room) => {
      u.ctx.font = font.replace(/\d+(?=px)/, (size) => size * devicePixelRatio);
      let kept = text;
      while (kept && u.ctx.measureText(kept === text ? text : kept + "…").width > room) kept = kept.slice(0, -1);
      return kept === text ? text : kept + "…";
    };
    const axis = (own, across) => ({
      scale: across ? "x" : "y", font, labelFont: font, labelSize: 17 * s, labelGap: 0, gap: 6 * s, space: (across ? 64 : 40) * s,
      label: (u) => clipped(u, own.text, (across ? u.bbox.width : u.bbox.height) + 20),
      stroke: () => colour("muted"), grid: { ...line, stroke: () => colour("grid") }, ticks: { show: false },
      border: { ...line, show: across, stroke: () => colour("axis") },
      ...(own.names && { splits: () => own.names.map((_, k) => k) }),
      ...(own.log && { splits: (u) => own.decades((across ? u.bbox.width / 64 : u.bbox.height / 40) / devicePixelRatio / s) }),
      values: (u, splits, k, space, step) => splits.map((inner) => clipped(u, own.tick(inner, step), own.names ? u.bbox.width / own.names.length : Infinity)),
      size: across ? 20 * s : (u, labels) => {
        u.ctx.font = font;
        return (labels ?? []).reduce((most, label) => Math.max(most, u.ctx.measureText(label).width), 0) + 10 * s;
      },
    });
    const facets = ["x", "y"].map((scale) => ({ scale, auto: false }));
    const scale = ({ view: [min, max] }) => ({ time: false, auto: false, range: (_, low, high) => [low, high], min, max });
    const curve = (one, k) => ({
      facets, auto: false, show: one.shown, width: one.kind === "points" ? 0 : s * (one.width ?? 1.8), cap: one.dash ? "butt" : "round",
      dash: one.dash ? [5 * s, 4 * s] : [], points: { show: false },
      stroke: () => colour(this.order[k].ink),
      fill: () => ({ band: colour(this.order[k].ink) + "2e", points: colour(this.order[k].ink) + "99" })[one.kind] ?? null,
      paths: (u) => paths(u, this, this.order[k], s),
    });
    const curves = this.map ? [{ facets, auto: false, paths: () => null, points: { show: false } }] : this.order.map(curve);
    return {
      mode: 2, width, height, padding: [10 * s, 16 * s, 0, 4 * s], legend: { show: false }, series: [{}, ...curves],
      scales: { x: scale(this.x), y: scale(this.y) }, axes: [axis(this.x, true), axis(this.y, false)],
      cursor: this.crosshair(),
      hooks: {
        drawAxes: [(u) => this.map && paintMap(u, this, colour)],
        draw: [(u) => this.drawn(u)],
        setCursor: [() => this.read()],
        setSelect: [(u) => this.into(u.select)],
      },
    };
  }

  crosshair() {
    const index = (k) => {
      const one = this.order[k - 1], { cursor } = this;
      if (!cursor || !one?.shown || shade(one)) return null;
      if (!this.sweeps) return cursor.one === one ? cursor.k : null;
      const at = nearest(one.x, cursor.x);
      return Number.isFinite(this.y.inner(one.y[at])) && Math.abs(this.px(one.x[at]) - this.px(cursor.x)) < 2 ? at : null;
    };
    return {
      y: !this.sweeps,
      sync: { key: this.sweeps ? this.x.text : null, scales: ["x", null], filters: { pub: (type) => type === "mousemove" } },
      drag: { x: true, y: true, uni: LEAN, dist: 5, setScale: false },
      move: (_, left, top) => this.pointed(left, top),
      dataIdx: (_, k) => index(k),
      points: { size: 9, width: 1.5, stroke: () => ink("surface"), fill: (_, k) => ink(this.order[k - 1]?.ink ?? "muted") },
      bind: {
        mousedown: (_, target, pressed) => (event) => (event.shiftKey ? this.hands.pans(event) : event.button === 0 && pressed(event)),
        dblclick: () => () => this.reset(),
      },
    };
  }

  // The place of a value in the frame, px, and the size of the frame.
  get wide() { return this.u.bbox.width / devicePixelRatio; }
  get tall() { return this.u.bbox.height / devicePixelRatio; }
  px(value) { return this.x.at(value) * this.wide; }
  py(value) { return (1 - this.y.at(value)) * this.tall; }

  // Zooms into a box that was drawn; all the height where it is a stroke along the abscissa of a sweep.
  into({ left, top, width, height }) {
    const show = (axis, from, to) => axis.show(axis.view[0] + from * axis.width, axis.view[0] + to * axis.width);
    if (width > 3) show(this.x, left / this.wide, (left + width) / this.wide);
    if (height > 3) show(this.y, 1 - (top + height) / this.tall, 1 - top / this.tall);
    this.u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.moved();
  }

  // Notes what is read at a place of the frame, and returns the place of the crosshair: a sweep is read at its samples.
  pointed(left, top) {
    this.cursor = left < 0 ? null : this.map ? this.cellAt(left, top) : this.sweeps ? this.sweepAt(this.x.value(left / this.wide)) : this.pointAt(left, top);
    return [this.sweeps && this.cursor ? Math.min(Math.max(this.px(this.cursor.x), 0), this.wide) : left, top];
  }

  // The nearest sample of the longest visible curve, so that what is read was computed there.
  sweepAt(wanted) {
    const has = this.shown.filter((one) => bracket(one, wanted)).sort((a, b) => b.x.length - a.x.length)[0];
    return has ? { x: has.x[nearest(has.x, wanted)] } : null;
  }

  pointAt(left, top) {
    let best = null, least = REACH ** 2;
    for (const one of this.shown) {
      for (let k = 0; k < one.y.length; k++) {
        const far = (this.px(one.x[k]) - left) ** 2 + (this.py(one.y[k]) - top) ** 2;
        if (far < least) [best, least] = [{ one, k }, far];
      }
    }
    return best;
  }

  cellAt(left, top) {
    const part = (axis, place) => (axis.inner(axis.value(place)) - axis.home[0]) / (axis.home[1] - axis.home[0]);
    const index = (part, count) => Math.min(Math.max(Math.floor(part * count), 0), count - 1);
    return { column: index(part(this.x, left / this.wide), this.map.columns), row: index(part(this.y, 1 - top / this.tall), this.map.rows) };
  }

  // The place of a cursor as a value of each axis; the ordinate of a sweep is its middle.
  placeOf({ x, one, k, column, row }) {
    if (this.sweeps) return [x, this.y.value(0.5)];
    if (!this.map) return [one.x[k], one.y[k]];
    const middle = ({ home }, part) => home[0] + part * (home[1] - home[0]);
    return [middle(this.x, (column + 0.5) / this.map.columns), middle(this.y, (row + 0.5) / this.map.rows)];
  }

  // Puts the crosshair to a cursor, or away.
  point(cursor) {
    if (!this.u) return;
    const [x, y] = cursor ? this.placeOf(cursor) : [];
    this.u.setCursor(cursor ? { left: this.px(x), top: this.py(y) } : GONE, true, true);
  }

  read() {
    if (this.near) this.said(this.marks());
  }

  // What is read: a heading, and rows of a name with its value; null where nothing is.
  marks() {
    const { cursor, x, y } = this;
    if (!cursor) return null;
    if (!this.sweeps) {
      const rows = [x, y].map((axis, k) => ({ name: axis.label, value: axis.withUnit(this.placeOf(cursor)[k]) }));
      if (this.map) rows.push({ name: "value", value: significant(this.map.values[cursor.row * this.map.columns + cursor.column]) });
      else if (cursor.one.name) rows.unshift({ name: cursor.one.name, value: "", ...cursor.one, kind: swatchKind(cursor.one) });
      return { rows };
    }
    const rows = this.shown.filter((one) => (one.name || this.shown.length === 1) && !shade(one)).map((one) => {
      const between = bracket(one, cursor.x), read = (values) => y.outer(at(values, between, y));
      const value = between ? read(one.y) : NaN, text = Number.isFinite(value) ? y.withUnit(value) : "–";
      const band = one.low.length && Number.isFinite(value) ? ` (${y.write(read(one.low))} … ${y.write(read(one.high))})` : "";
      return { name: one.name || y.label, value: text + band, ink: one.ink, kind: swatchKind(one), height: this.py(value) };
    });
    return { head: `${x.label} ${x.withUnit(cursor.x)}`, rows };
  }

  // The values beside the crosshair, where they hide least; many of them stand beneath the plot of a phone.
  write(marks) {
    this.readout.hidden = !marks;
    if (!marks) return;
    const lines = marks.rows.map(({ name, value, ink: colour, kind }) => {
      const line = element("div", "row");
      if (colour) line.append(element("span", `swatch ${kind} ${colour}`));
      line.append(element("span", "name", name), element("span", "value", value));
      return line;
    });
    this.readout.replaceChildren(...(marks.head ? [element("div", "head", marks.head)] : []), ...lines);
    this.readout.style.transform = "";
    if (this.box.clientHeight > this.mount.clientHeight) return;
    const [wide, tall] = [this.readout.offsetWidth, this.readout.offsetHeight], { bbox, cursor } = this.u;
    const edge = bbox.left / devicePixelRatio, px = edge + cursor.left;
    const at = cursor.left > this.wide / 2 ? px - wide - 12 : px + 12;
    const heights = marks.rows.map(({ height }) => height).filter(Number.isFinite);
    const mean = heights.reduce((sum, height) => sum + height, 0) / Math.max(heights.length, 1);
    const top = bbox.top / devicePixelRatio, down = heights.length && mean < this.tall / 2 ? top + this.tall - tall - 4 : top + 4;
    this.readout.style.transform = `translate(${Math.round(Math.min(Math.max(at, 2), Math.max(this.box.clientWidth - wide - 2, 2)))}px,${Math.round(down)}px)`;
  }
}
