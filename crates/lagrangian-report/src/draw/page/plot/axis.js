// An axis: its view, its ends, and how its values are written.

const LARGEST = 1e300; // larger values have no place: the arithmetic of axes would overflow

const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = (k) => "10" + (k < 0 ? "⁻" : "") + [...String(Math.abs(k))].map((digit) => RAISED[digit]).join("");
const minus = (text) => text.replace("-", "−");
const decade = (size) => 10 ** Math.floor(Math.log10(size));

// A value, with the digits that tell it from another at a distance of `step`.
export function decimal(value, step) {
  if (!Number.isFinite(value)) return "–";
  if (Math.abs(value) < 0.5 * step) return "0";
  const places = Math.max(0, -Math.floor(Math.log10(step * (1 + 1e-9))));
  if (places <= 5 && Math.abs(value) < 1e6) return minus(value.toFixed(places));
  const k = Math.floor(Math.log10(Math.abs(value)));
  const digits = Math.min(Math.max(Math.round(k - Math.log10(step)), 0), 6);
  return minus((value / 10 ** k).toFixed(digits)) + "×" + power(k);
}
export const significant = (value) => (value === 0 ? "0" : decimal(value, decade(Math.abs(value)) / 100));

// An axis: its view, and how its values are written. Views are of inner values: logarithms on a logarithmic axis.
export class Axis {
  constructor({ label, unit, log = false, names, range }) {
    Object.assign(this, { label, unit, log, names, range, home: [0, 1], view: [0, 1], reach: [0, 1] });
  }

  get text() { return this.unit ? `${this.label} (${this.unit})` : this.label; }
  get zoomed() { return this.view[0] !== this.home[0] || this.view[1] !== this.home[1]; }
  get width() { return this.view[1] - this.view[0]; }
  inner(value) { return !(Math.abs(value) < LARGEST) ? NaN : !this.log ? value : value > 0 ? Math.log10(value) : NaN; }
  outer(inner) { return this.log ? 10 ** inner : inner; }
  at(value) { return (this.inner(value) - this.view[0]) / this.width; }
  value(place) { return this.outer(this.view[0] + place * this.width); }

  // Home, the range of the figure or around the data; and as far as one may pan, home and all the data.
  settle([low, high], margin, round) {
    const zoomed = this.zoomed, fixed = this.range?.map((end) => this.inner(end));
    if (!(fixed?.[0] < fixed?.[1]) && low > high) return;
    this.home = fixed?.[0] < fixed?.[1] ? fixed : around(low, high, margin, round, this.log);
    this.reach = [Math.min(this.home[0], low), Math.max(this.home[1], high)];
    if (!zoomed) this.view = [...this.home];
  }

  // Shows from `low` to `high`, as far as there is anything.
  show(low, high) {
    const least = 1e-9 * Math.max(this.home[1] - this.home[0], 1e-3 * Math.abs(this.home[1]), 1e-290);
    const [first, last] = this.reach, width = Math.min(Math.max(high - low, least), last - first);
    const start = Math.min(Math.max(low, first), last - width), near = (a, b) => Math.abs(a - b) < 1e-6 * width;
    this.view = near(start, this.home[0]) && near(start + width, this.home[1]) ? [...this.home] : [start, start + width];
  }

  zoom(factor, place) {
    const fixed = this.view[0] + place * this.width;
    this.show(fixed - (fixed - this.view[0]) * factor, fixed + (this.view[1] - fixed) * factor);
  }

  pan(part) { this.show(this.view[0] + part * this.width, this.view[1] + part * this.width); }

  // A value, with the digits that can be told apart in this view, and three at least unless it is next to nothing in it.
  write(value) {
    if (!Number.isFinite(value)) return "–";
    if (this.names) return this.names[Math.round(value)] ?? "";
    const three = decade(Math.abs(value) || 1) / 100;
    return decimal(value, this.log ? three : Math.min(decade(this.width) / 1e3, Math.max(three, decade(this.width) / 1e6)));
  }

  withUnit(value) { return [this.write(value), this.unit].filter(Boolean).join(" "); }

  // Inner values of ticks that uPlot does not place: whole decades, or 1, 2 and 5 times them.
  decades(space) {
    const [low, high] = this.view, first = Math.ceil(low - 1e-9), last = Math.floor(high + 1e-9);
    const every = Math.ceil((last - first) / space) || 1, all = [];
    for (let k = first - 1; k <= last; k++) {
      if (last - first < 2) all.push(k, k + Math.log10(2), k + Math.log10(5));
      else if (k % every === 0) all.push(k);
    }
    return all.filter((inner) => inner >= low - 1e-9 && inner <= high + 1e-9);
  }

  // The label of a tick; `step` is the distance of ticks that uPlot places, of which some are 2.5 times a power of ten.
  tick(inner, step) {
    if (this.names) return this.names[inner] ?? "";
    if (!this.log) return decimal(inner, Math.abs(step / decade(step) - 2.5) < 0.01 ? step / 10 : step);
    const k = Math.floor(inner + 1e-9), digit = Math.round(10 ** (inner - k));
    if (k >= -3 && k <= 4) return String(Number((digit * 10 ** k).toPrecision(2)));
    return (digit === 1 ? "" : digit + "×") + power(k);
  }
}

// The ends of an axis around data: by a part of their distance, or at round numbers.
function around(low, high, margin, round, log) {
  if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high), 1e-300))) {
    const half = log || Math.abs(low) < LARGEST ** -1 ? 1 : 0.1 * Math.abs(low);
    [low, high] = [low - half, high + half];
  }
  const step = log ? 1 : decade(high - low) / 2;
  if (round && !(log && high - low < 2)) return [Math.floor(low / step + 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
  return [low - margin * (high - low), high + margin * (high - low)];
}

// The least and the largest of the numbers in arrays.
export function span(arrays) {
  let low = Infinity, high = -Infinity;
  for (const values of arrays) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

// Whether values never fall and none is missing: then a place on the abscissa has one value.
export function rises(x) {
  for (let k = 0; k < x.length; k++) if (!(k === 0 ? Number.isFinite(x[0]) : x[k] >= x[k - 1])) return false;
  return x.length > 0;
}

// The index of the value of a rising array that is nearest to `wanted`.
export function nearest(x, wanted) {
  let low = 0, high = x.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x[middle] > wanted) high = middle; else low = middle;
  }
  return wanted - x[low] <= x[high] - wanted ? low : high;
}
