  // One plot: its data, its view, its canvases, and what it shows.

  const MANY = 6; // curves from which values stand beneath the plot of a phone (style.css), where they would hide it

  function element(name, className, text = "") {
    const made = document.createElement(name);
    made.className = className;
    made.textContent = text;
    return made;
  }

  class Plot {
    constructor(figure, spec, pool) {
      this.figure = figure;
      this.title = spec.title;
      this.map = spec.map && { ...spec.map, values: pool(spec.map.values) };
      this.x = new Axis(spec.x);
      this.y = new Axis(spec.y);
      this.series = spec.series.map((one) => ({ ...one, x: pool(one.x), y: pool(one.y), low: pool(one.low), high: pool(one.high), shown: true }));
      for (const one of this.series) one.rising = one.kind !== "points" && rises(one.x);
      // Whether each place on the abscissa has one value a curve: then the pointer reads all of them at once.
      this.sweeps = !this.map && this.series.length > 0 && this.series.every((one) => one.rising);
      this.cursor = null; // where values are read: { x } of a sweep, { one, k } of a point, { column, row } of a cell
      this.near = false; // whether it is in sight, or almost
      this.stale = true;
      this.canBeLog = this.y.log || this.positive;
      this.settle();
      this.build(spec.words);
    }

    get shown() { return this.series.filter((one) => one.shown); }

    // The box that is pointed at and focused, and in it the canvases and the values.
    build(words) {
      this.box = element("div", "plot");
      this.base = element("canvas", "base");
      this.over = element("canvas", "over");
      this.readout = element("div", "readout");
      this.marquee = element("div", "marquee");
      this.readout.hidden = this.marquee.hidden = true;
      for (const part of [this.base, this.over, this.readout, this.marquee]) part.setAttribute("aria-hidden", "true");
      this.box.append(this.base, this.over, this.marquee, this.readout);
      if (this.series.length >= MANY) {
        this.box.classList.add("many");
        this.box.style.setProperty("--lines", 1 + Math.ceil(this.series.length / 2));
      }
      const attributes = { tabindex: 0, role: "application", "aria-roledescription": "interactive figure", "aria-label": this.title, "aria-describedby": words + " keys" };
      for (const [name, value] of Object.entries(attributes)) this.box.setAttribute(name, value);
      this.figure.querySelector("svg.static").before(this.box);
    }

    // Ends and reach of both axes: those of the visible curves, unless the figure fixes them.
    settle() {
      if (this.map) return;
      const extent = (axis, arrays) => span(arrays.map((values) => (axis.log ? values.map((value) => axis.inner(value)) : values)));
      const visible = this.shown.length ? this.shown : this.series;
      const xs = extent(this.x, this.series.map((one) => one.x));
      this.x.settle(this.x.home, xs);
      const ys = extent(this.y, visible.flatMap((one) => [one.y, one.low, one.high]));
      if (ys[0] > ys[1]) return;
      // As the page was drawn, until something is hidden or the scale is another one.
      this.asDrawn ??= { log: this.y.log, ends: this.y.home };
      const whole = this.y.log === this.asDrawn.log && (this.y.fixed || visible.length === this.series.length);
      this.y.settle(whole ? this.asDrawn.ends : atTicks(ys, 6, this.y.log), ys);
    }

    // Whether the ordinate can be logarithmic: it is, or all its values are positive.
    get positive() {
      if (this.map || this.y.names) return false;
      const [low, high] = span(this.series.filter((one) => !shade(one)).flatMap((one) => [one.y, one.low, one.high]));
      return low > 0 && high > 3 * low;
    }

    toggleLog() {
      if (!this.canBeLog) return;
      this.y.view = [...this.y.home];
      this.y.log = !this.y.log;
      this.settle();
      this.y.view = [...this.y.home];
      this.changed();
    }

    get zoomed() { return this.x.zoomed || this.y.zoomed; }

    reset() {
      this.x.view = [...this.x.home];
      this.y.view = [...this.y.home];
      this.changed(true);
    }

    // After a new view: the plots that share the abscissa follow where `along` says so.
    changed(along = false) {
      this.draw();
      if (along) this.link?.follow(this);
      this.onchange?.();
    }

    draw() {
      this.stale = true;
      if (!this.near || this.pending) return;
      this.pending = requestAnimationFrame(() => {
        this.pending = 0;
        this.paint();
      });
    }

    paint() {
      const size = (this.size = { wide: this.box.clientWidth, tall: this.base.clientHeight });
      if (size.wide === 0) return;
      this.stale = false;
      const context = sheet(this.base, size);
      const frame = (this.frame = laidOut(context, size, this.x, this.y));
      paintFrame(context, frame, this.x, this.y, size);
      const place = (this.place = places(frame, this.x, this.y));
      within(context, frame, () => {
        if (this.map) paintMap(context, this);
        const order = [...this.shown].sort((a, b) => a.depth - b.depth);
        for (const one of order) paintSeries(context, place, one, frame);
      });
      this.paintCursor();
    }

    // The crosshair and the values at it.
    paintCursor() {
      if (!this.near || !this.frame) return;
      const marks = this.cursor ? marked(this) : null;
      if (!marks && this.readout.hidden) return;
      const context = sheet(this.over, this.size);
      this.readout.hidden = !marks;
      if (!marks) return;
      const { frame } = this;
      within(context, frame, () => {
        Object.assign(context, { strokeStyle: ink("muted"), lineWidth: 1 });
        context.beginPath();
        context.moveTo(Math.round(marks.px) + 0.5, frame.top);
        context.lineTo(Math.round(marks.px) + 0.5, frame.bottom);
        if (marks.py !== undefined) {
          context.moveTo(frame.left, Math.round(marks.py) + 0.5);
          context.lineTo(frame.right, Math.round(marks.py) + 0.5);
        }
        context.stroke();
        for (const { spot, ink: name } of marks.dots) {
          context.fillStyle = ink("surface");
          disc(context, spot, 5.5);
          context.fillStyle = ink(name);
          disc(context, spot, 4);
        }
      });
      this.write(marks);
    }

    // The values beside the crosshair, on the side with more room; many of them stand beneath the plot of a phone.
    write({ px, head, rows, dots }) {
      const lines = rows.map(({ name, value, ink: colour, kind }) => {
        const line = element("div", "row");
        if (colour) line.append(element("span", `swatch ${kind} ${colour}`));
        line.append(element("span", "name", name), element("span", "value", value));
        return line;
      });
      this.readout.replaceChildren(...(head ? [element("div", "head", head)] : []), ...lines);
      if (this.box.clientHeight > this.size.tall) {
        this.readout.style.transform = "";
        return;
      }
      const wide = this.readout.offsetWidth, { left, right, top, bottom } = this.frame;
      const at = px > (left + right) / 2 ? px - wide - 12 : px + 12;
      const inside = Math.min(Math.max(at, 2), Math.max(this.box.clientWidth - wide - 2, 2));
      // Where it hides least: above points that are low, below points that are high.
      const heights = dots.map(({ spot }) => spot[1]).filter(Number.isFinite);
      const mean = heights.reduce((sum, height) => sum + height, 0) / Math.max(heights.length, 1);
      const low = heights.length > 0 && mean < (top + bottom) / 2;
      const down = low ? bottom - this.readout.offsetHeight - 4 : top + 4;
      this.readout.style.transform = `translate(${Math.round(inside)}px,${Math.round(down)}px)`;
    }
  }
