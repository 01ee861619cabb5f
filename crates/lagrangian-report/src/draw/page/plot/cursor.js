  // What is read at a place of a plot, and the crosshair that plots of one abscissa share.

  const REACH = 48; // px from the pointer within which a point is read

  // The px of the crosshair, the points that it marks, and the values there; null where it is out of view.
  function marked(plot) {
    if (plot.map) return markedCell(plot);
    return plot.sweeps ? markedSweep(plot) : markedPoint(plot);
  }

  function markedSweep(plot) {
    const { cursor, place, frame } = plot, px = place.X(cursor.x);
    if (!(px >= frame.left - 1 && px <= frame.right + 1)) return null;
    const rows = [], dots = [];
    for (const one of plot.shown) {
      if ((!one.name && plot.shown.length > 1) || shade(one)) continue;
      const between = bracket(one, cursor.x), read = (values) => plot.y.outer(at(values, between, plot.y));
      const value = between ? read(one.y) : NaN;
      rows.push({ name: one.name || plot.y.label, value: written(plot, one, value, read), ink: one.ink, kind: swatchKind(one) });
      if (Number.isFinite(place.Y(value))) dots.push({ spot: [px, place.Y(value)], ink: one.ink });
    }
    return { px, dots, rows, head: `${plot.x.label} ${withUnit(plot.x, cursor.x)}` };
  }

  function markedPoint(plot) {
    const { one, k } = plot.cursor;
    if (!one.shown) return null;
    const [px, py] = [plot.place.X(one.x[k]), plot.place.Y(one.y[k])];
    const rows = [
      { name: plot.x.label, value: withUnit(plot.x, one.x[k]) },
      { name: plot.y.label, value: withUnit(plot.y, one.y[k]) },
    ];
    if (one.name) rows.unshift({ name: one.name, value: "", ink: one.ink, kind: swatchKind(one) });
    return { px, py, dots: [{ spot: [px, py], ink: one.ink }], rows };
  }

  function markedCell(plot) {
    const { columns, rows: count, values } = plot.map, { column, row } = plot.cursor;
    const middle = (axis, part) => axis.outer(axis.home[0] + part * (axis.home[1] - axis.home[0]));
    const [x, y] = [middle(plot.x, (column + 0.5) / columns), middle(plot.y, (row + 0.5) / count)];
    const rows = [
      { name: plot.x.label, value: withUnit(plot.x, x) },
      { name: plot.y.label, value: withUnit(plot.y, y) },
      { name: "value", value: significant(values[row * columns + column]) },
    ];
    return { px: plot.place.X(x), py: plot.place.Y(y), dots: [], rows };
  }

  const significant = (value) => (value === 0 ? "0" : decimal(value, 10 ** (Math.floor(Math.log10(Math.abs(value))) - 2)));
  const withUnit = (axis, value) => [axis.write(value), axis.unit].filter(Boolean).join(" ");
  // Whether it is a band without a line.
  const shade = (one) => one.kind === "band" && !one.y.some(Number.isFinite);
  const swatchKind = (one) => (one.dash ? "line dash" : shade(one) ? "band shade" : one.kind);

  // A value with its unit, and its band.
  function written(plot, one, value, read) {
    if (!Number.isFinite(value)) return "–";
    const text = withUnit(plot.y, value);
    return one.low.length > 0 ? `${text} (${plot.y.write(read(one.low))} … ${plot.y.write(read(one.high))})` : text;
  }

  // The samples around a place on the abscissa, and how far it is from the first to the second; null outside of the curve.
  function bracket({ x }, wanted) {
    const last = x.length - 1, slack = (1e-6 * (x[last] - x[0])) / Math.max(last, 1);
    if (wanted < x[0] - slack || wanted > x[last] + slack) return null;
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

  // The cursor of a pointer at a place of the box, px; null where nothing can be read.
  function cursorAt(plot, [px, py]) {
    const { frame } = plot;
    if (!frame || px < frame.left - 6 || px > frame.right + 6 || py < frame.top - 20 || py > frame.bottom + 20) return null;
    const [u, v] = [(px - frame.left) / frame.width, (frame.bottom - py) / frame.height];
    if (plot.map) return cellAt(plot, u, v);
    if (!plot.sweeps) return pointAt(plot, px, py);
    return sweepAt(plot, plot.x.value(Math.min(Math.max(u, 0), 1)));
  }

  // The nearest sample of the longest visible curve, so that what is read was computed there.
  function sweepAt(plot, wanted) {
    const has = plot.shown.filter((one) => bracket(one, wanted));
    const best = has.sort((a, b) => b.x.length - a.x.length)[0];
    return best ? { x: best.x[nearest(best.x, wanted)] } : null;
  }

  function pointAt(plot, px, py) {
    let best = null, least = REACH ** 2;
    for (const one of plot.shown) {
      for (let k = 0; k < one.y.length; k++) {
        const far = (plot.place.X(one.x[k]) - px) ** 2 + (plot.place.Y(one.y[k]) - py) ** 2;
        if (far < least) [best, least] = [{ one, k }, far];
      }
    }
    return best;
  }

  function cellAt(plot, u, v) {
    const part = (axis, place) => (axis.inner(axis.value(place)) - axis.home[0]) / (axis.home[1] - axis.home[0]);
    const index = (part, count) => Math.min(Math.max(Math.floor(part * count), 0), count - 1);
    return { column: index(part(plot.x, u), plot.map.columns), row: index(part(plot.y, v), plot.map.rows) };
  }

  // Plots of one abscissa: one crosshair, and one view where they begin and end alike.
  class Link {
    constructor() { this.plots = []; }

    add(plot) {
      this.plots.push(plot);
      plot.link = this;
    }

    point(cursor) {
      for (const plot of this.plots) {
        plot.cursor = cursor;
        plot.paintCursor();
      }
    }

    follow(leader) {
      const [low, high] = leader.x.home, near = (a, b) => Math.abs(a - b) <= 1e-6 * (high - low);
      for (const plot of this.plots) {
        if (plot === leader || !near(plot.x.home[0], low) || !near(plot.x.home[1], high)) continue;
        plot.x.view = [...leader.x.view];
        plot.changed();
      }
    }
  }

  function point(plot, cursor) {
    if (plot.link) {
      plot.link.point(cursor);
      return;
    }
    plot.cursor = cursor;
    plot.paintCursor();
  }
