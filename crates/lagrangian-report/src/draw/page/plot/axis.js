  // An axis: values to the unit interval, its view, its ticks, and how its values are written.

  const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const power = (k) => "10" + (k < 0 ? "⁻" : "") + [...String(Math.abs(k))].map((digit) => RAISED[digit]).join("");
  const minus = (text) => text.replace("-", "−");

  // A value, with the digits that tell it from another at a distance of `step`.
  function decimal(value, step) {
    if (!Number.isFinite(value)) return "–";
    if (Math.abs(value) < 0.5 * step) return "0";
    const places = Math.max(0, -Math.floor(Math.log10(step * (1 + 1e-9))));
    if (places <= 5 && Math.abs(value) < 1e6) return minus(value.toFixed(places));
    const k = Math.floor(Math.log10(Math.abs(value)));
    const digits = Math.min(Math.max(Math.round(k - Math.log10(step)), 0), 6);
    return minus((value / 10 ** k).toFixed(digits)) + "×" + power(k);
  }

  // The smallest of 1, 2, 5 times a power of ten that is not below `least`.
  function niceStep(least) {
    const unit = 10 ** Math.floor(Math.log10(least));
    return ([1, 2, 5].find((digit) => digit * unit >= least * (1 - 1e-9)) ?? 10) * unit;
  }

  class Axis {
    // `ends` are inner values: logarithms on a logarithmic axis.
    constructor({ label, unit, log, names, ends, fixed }) {
      Object.assign(this, { label, unit, log, names, fixed });
      this.text = unit ? `${label} (${unit})` : label;
      this.home = ends;
      this.view = [...ends];
      this.reach = [...ends];
    }

    inner(value) { return this.log ? (value > 0 ? Math.log10(value) : NaN) : value; }
    outer(inner) { return this.log ? 10 ** inner : inner; }
    at(value) { return (this.inner(value) - this.view[0]) / (this.view[1] - this.view[0]); }
    value(place) { return this.outer(this.view[0] + place * (this.view[1] - this.view[0])); }
    get zoomed() { return this.view[0] !== this.home[0] || this.view[1] !== this.home[1]; }

    // Home, and as far as one may pan: home and all the data.
    settle(home, data) {
      const zoomed = this.zoomed;
      this.home = home;
      this.reach = [Math.min(home[0], data[0]), Math.max(home[1], data[1])];
      if (!zoomed) this.view = [...home];
    }

    // Shows from `low` to `high`, as far as there is anything.
    show(low, high) {
      const least = 1e-9 * Math.max(this.home[1] - this.home[0], 1e-3 * Math.abs(this.home[1]), 1e-290);
      const [first, last] = this.reach;
      const width = Math.min(Math.max(high - low, least), last - first);
      const start = Math.min(Math.max(low, first), last - width);
      const near = (a, b) => Math.abs(a - b) < 1e-6 * width;
      this.view = near(start, this.home[0]) && near(start + width, this.home[1]) ? [...this.home] : [start, start + width];
    }

    zoom(factor, place) {
      const [low, high] = this.view, fixed = low + place * (high - low);
      this.show(fixed - (fixed - low) * factor, fixed + (high - fixed) * factor);
    }

    pan(part) {
      const shift = part * (this.view[1] - this.view[0]);
      this.show(this.view[0] + shift, this.view[1] + shift);
    }

    // A value, with the digits that can be told apart in this view, and three at least unless it is next to nothing in it.
    write(value) {
      if (!Number.isFinite(value)) return "–";
      if (this.names) return this.names[Math.round(value)] ?? "";
      const decade = (size) => 10 ** Math.floor(Math.log10(size)), width = this.view[1] - this.view[0];
      const three = decade(Math.abs(value) || 1) / 100;
      return decimal(value, this.log ? three : Math.min(decade(width) / 1e3, Math.max(three, decade(width) / 1e6)));
    }

    // [inner value, label] of about `count` ticks.
    ticks(count) {
      if (this.names) return this.names.map((name, k) => [k, name]).filter(([k]) => k >= this.view[0] && k <= this.view[1]);
      return this.log ? this.decades(count) : steps(this.view, count);
    }

    decades(count) {
      const [low, high] = this.view;
      const first = Math.ceil(low - 1e-9), last = Math.floor(high + 1e-9);
      const label = (digit, k) => (k >= -3 && k <= 4 ? String(Number((digit * 10 ** k).toPrecision(2))) : (digit === 1 ? "" : digit + "×") + power(k));
      if (last - first >= 2) {
        const every = Math.floor((last - first) / count) + 1, ticks = [];
        for (let k = first; k <= last; k++) if (((k % every) + every) % every === 0) ticks.push([k, label(1, k)]);
        return ticks;
      }
      const between = [];
      for (let k = first - 1; k <= last; k++) for (const digit of [1, 2, 5]) between.push([k + Math.log10(digit), label(digit, k)]);
      const inside = between.filter(([inner]) => inner >= low - 1e-9 && inner <= high + 1e-9);
      return inside.length > 1 ? inside : steps([10 ** low, 10 ** high], count).map(([value, text]) => [Math.log10(value), text]);
    }
  }

  function steps([low, high], count) {
    const step = niceStep((high - low) / Math.max(count, 1));
    const first = Math.ceil(low / step - 1e-9), last = Math.min(Math.floor(high / step + 1e-9), first + 50);
    const ticks = [];
    for (let k = first; k <= last; k++) ticks.push([k * step, decimal(k * step, step)]);
    return ticks;
  }

  // The ends of `data` moved outwards to ticks, so that the highest value lies below a label.
  function atTicks([low, high], count, log) {
    if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high), 1e-300))) {
      const half = log || Math.abs(low) < 1e-300 ? 1 : 0.1 * Math.abs(low);
      [low, high] = [low - half, high + half];
    }
    const step = log ? Math.max(1, Math.floor((high - low) / count) + 1) : niceStep((high - low) / count);
    if (log && high - low < 2) return [low - 0.06 * (high - low), high + 0.06 * (high - low)];
    return [Math.floor(low / step + 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
  }
