  // How a plot is painted: grid, numbers, curves, dots, bands and cells, on a canvas.

  const root = document.documentElement;
  const FONT = "12px " + getComputedStyle(document.body).fontFamily;
  const ABOVE = 26, BELOW = 42, RIGHT = 18; // px around the frame of a plot
  const SHADE = 0.18, DOT = 0.6; // opacities of bands and of clouds of dots
  const FEW = 100; // dots that are drawn larger

  // The colours of the theme in use, read once a theme.
  let inks = new Map();
  root.addEventListener("themechange", () => { inks = new Map(); });
  function ink(name) {
    if (!inks.has(name)) inks.set(name, getComputedStyle(root).getPropertyValue("--" + name).trim());
    return inks.get(name);
  }

  // A canvas fitted to its box and the screen's density, cleared.
  function sheet(canvas, { wide, tall }) {
    const density = Math.min(devicePixelRatio || 1, 3);
    const [w, h] = [Math.round(wide * density), Math.round(tall * density)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const context = canvas.getContext("2d");
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, wide, tall);
    return context;
  }

  // The frame in which a plot is drawn, px, and the ticks around it.
  function laidOut(context, { wide, tall }, x, y) {
    context.font = FONT;
    const broadest = (ticks) => ticks.reduce((most, [, text]) => Math.max(most, context.measureText(text).width), 0);
    const height = Math.max(tall - ABOVE - BELOW, 20);
    const yTicks = upright(y, height);
    const left = Math.min(broadest(yTicks) + 16, 0.4 * wide), width = Math.max(wide - left - RIGHT, 20);
    let xTicks = [];
    for (let count = Math.min(Math.max(Math.floor(width / 56), 2), 12); count > 0; count--) {
      xTicks = x.ticks(count);
      const gap = (broadest(xTicks) + 16) * (x.view[1] - x.view[0]);
      if (x.names || xTicks.every(([inner], k) => k === 0 || (inner - xTicks[k - 1][0]) * width > gap)) break;
    }
    return { left, top: ABOVE, width, height, bottom: ABOVE + height, right: left + width, xTicks, yTicks };
  }

  // A tick about every 42 px, and three where that gives fewer; the highest one at the upper end where that can be.
  function upright(y, height) {
    const enough = Math.min(Math.max(Math.floor(height / 42), 2), 8);
    const down = Array.from({ length: enough - 1 }, (_, k) => enough - k), up = Array.from({ length: 11 - enough }, (_, k) => enough + 1 + k);
    const end = y.view[1] - 1e-6 * (y.view[1] - y.view[0]);
    const candidates = [...down, ...up].map((count) => y.ticks(count)).filter((ticks) => ticks.length > 2);
    const inOrder = [enough, ...up].map((count) => y.ticks(count));
    return candidates.find((ticks) => ticks[ticks.length - 1][0] >= end) ?? inOrder.find((ticks) => ticks.length > 2) ?? inOrder[0];
  }

  function clipped(context, text, limit) {
    if (context.measureText(text).width <= limit) return text;
    let kept = text;
    while (kept && context.measureText(kept + "…").width > limit) kept = kept.slice(0, -1);
    return kept + "…";
  }

  function paintFrame(context, frame, x, y, { wide, tall }) {
    const px = (inner) => frame.left + ((inner - x.view[0]) / (x.view[1] - x.view[0])) * frame.width;
    const py = (inner) => frame.bottom - ((inner - y.view[0]) / (y.view[1] - y.view[0])) * frame.height;
    const rule = (colour, x1, y1, x2, y2) => {
      context.strokeStyle = ink(colour);
      context.beginPath();
      context.moveTo(x1, y1);
      context.lineTo(x2, y2);
      context.stroke();
    };
    context.lineWidth = 1;
    for (const [inner] of frame.yTicks) rule("grid", frame.left, py(inner), frame.right, py(inner));
    for (const [inner] of frame.xTicks) rule("grid", px(inner), frame.top, px(inner), frame.bottom);
    rule("axis", frame.left, frame.bottom, frame.right, frame.bottom);
    Object.assign(context, { font: FONT, fillStyle: ink("muted"), textAlign: "right", textBaseline: "middle" });
    for (const [inner, text] of frame.yTicks) context.fillText(text, frame.left - 8, py(inner));
    Object.assign(context, { textAlign: "center", textBaseline: "top" });
    const room = x.names ? frame.width / Math.max(x.names.length, 1) - 6 : Infinity;
    for (const [inner, text] of frame.xTicks) context.fillText(clipped(context, text, room), px(inner), frame.bottom + 7);
    Object.assign(context, { textAlign: "left", textBaseline: "top" });
    context.fillText(clipped(context, y.text, wide - 12), 4, 2);
    Object.assign(context, { textAlign: "right", textBaseline: "bottom" });
    context.fillText(clipped(context, x.text, wide - 12), frame.right, tall - 2);
  }

  // Calls `draw` with the context clipped to the frame.
  function within(context, frame, draw) {
    context.save();
    context.beginPath();
    context.rect(frame.left - 2, frame.top - 2, frame.width + 4, frame.height + 4);
    context.clip();
    draw();
    context.restore();
  }

  // Functions from values to px; far places are drawn in, since a canvas cannot reach them.
  function places(frame, x, y) {
    const bound = (px) => (px > 1e5 ? 1e5 : px < -1e5 ? -1e5 : px);
    return { X: (value) => bound(frame.left + x.at(value) * frame.width), Y: (value) => bound(frame.bottom - y.at(value) * frame.height) };
  }

  function paintSeries(context, place, one, frame) {
    context.strokeStyle = context.fillStyle = ink(one.ink);
    if (one.kind === "points") {
      paintDots(context, place, one, frame);
      return;
    }
    if (one.kind === "band") paintBand(context, place, one);
    Object.assign(context, { lineWidth: one.width, lineJoin: "round", lineCap: one.dash ? "butt" : "round" });
    context.setLineDash(one.dash ? [5, 4] : []);
    paintLine(context, place, one, frame);
    context.setLineDash([]);
  }

  function paintDots(context, { X, Y }, { x, y }, frame) {
    context.globalAlpha = DOT;
    context.lineWidth = y.length > FEW ? 3.8 : 7;
    context.lineCap = "round";
    context.beginPath();
    for (let k = 0; k < y.length; k++) {
      const px = X(x[k]), py = Y(y[k]);
      if (!(px >= frame.left - 4 && px <= frame.right + 4 && py >= frame.top - 4 && py <= frame.bottom + 4)) continue;
      context.moveTo(px, py);
      context.lineTo(px, py + 0.01);
    }
    context.stroke();
    context.globalAlpha = 1;
  }

  function paintBand(context, { X, Y }, { x, low, high }) {
    context.globalAlpha = SHADE;
    const there = (k) => Number.isFinite(X(x[k])) && Number.isFinite(Y(low[k])) && Number.isFinite(Y(high[k]));
    for (let start = 0; start < low.length; start++) {
      if (!there(start)) continue;
      let end = start;
      while (end + 1 < low.length && there(end + 1)) end++;
      context.beginPath();
      for (let k = start; k <= end; k++) context.lineTo(X(x[k]), Y(low[k]));
      for (let k = end; k >= start; k--) context.lineTo(X(x[k]), Y(high[k]));
      context.fill();
      start = end;
    }
    context.globalAlpha = 1;
  }

  // A line; of many samples in a column of px, the first, lowest, highest and last. A sample between gaps is a dot.
  function paintLine(context, { X, Y }, { x, y, rising }, frame) {
    const [first, last] = rising ? seen(x, frame, X) : [0, y.length - 1];
    const dense = rising && last - first > 4 * frame.width;
    let open = false, column = null;
    const go = (px, py) => { if (open) context.lineTo(px, py); else context.moveTo(px, py); open = true; };
    const flush = () => {
      if (!column) return;
      for (const [, py] of [column.first, column.low, column.high, column.last]) go(column.first[0], py);
      column = null;
    };
    const alone = [];
    context.beginPath();
    for (let k = first; k <= last; k++) {
      const px = X(x[k]), py = Y(y[k]);
      if (Number.isNaN(px) || Number.isNaN(py)) {
        flush();
        open = false;
        continue;
      }
      if (!dense) {
        if (!open && !(k < last && !Number.isNaN(Y(y[k + 1])) && !Number.isNaN(X(x[k + 1])))) alone.push([px, py]);
        go(px, py);
        continue;
      }
      const point = [px, py];
      if (column && Math.floor(px) === Math.floor(column.first[0])) {
        if (py > column.low[1]) column.low = point;
        if (py < column.high[1]) column.high = point;
        column.last = point;
      } else {
        flush();
        column = { first: point, low: point, high: point, last: point };
      }
    }
    flush();
    context.stroke();
    for (const spot of alone) disc(context, spot, 2.6);
  }

  // The samples of a rising abscissa in view, and one more at each side.
  function seen(x, frame, X) {
    const edge = (wanted) => {
      let low = 0, high = x.length;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (X(x[middle]) < wanted) low = middle + 1; else high = middle;
      }
      return low;
    };
    return [Math.max(edge(frame.left) - 1, 0), Math.min(edge(frame.right + 1), x.length - 1)];
  }

  function disc(context, [px, py], radius) {
    context.beginPath();
    context.arc(px, py, radius, 0, 7);
    context.fill();
  }

  // The cells of a map as a picture of a px a cell: two inks, one a sign, the stronger the larger.
  function cells({ columns, rows, values, limit }) {
    const picture = document.createElement("canvas");
    [picture.width, picture.height] = [columns, rows];
    const context = picture.getContext("2d"), image = context.createImageData(columns, rows);
    const rgb = (name) => [1, 3, 5].map((k) => parseInt(ink(name).slice(k, k + 2), 16));
    const [negative, positive] = [rgb("lnn"), rgb("baseline")];
    values.forEach((value, k) => {
      const at = 4 * ((rows - 1 - Math.floor(k / columns)) * columns + (k % columns));
      const strength = Math.min(Math.abs(value / limit), 1);
      if (strength > 0) image.data.set([...(value > 0 ? positive : negative), Math.round(255 * strength)], at);
    });
    context.putImageData(image, 0, 0);
    return picture;
  }

  function paintMap(context, plot) {
    const { frame } = plot, part = (axis, end) => (end - axis.view[0]) / (axis.view[1] - axis.view[0]);
    const [left, right] = plot.x.home.map((end) => frame.left + part(plot.x, end) * frame.width);
    const [bottom, top] = plot.y.home.map((end) => frame.bottom - part(plot.y, end) * frame.height);
    plot.picture ??= cells(plot.map);
    context.imageSmoothingEnabled = false;
    context.drawImage(plot.picture, left, top, right - left, bottom - top);
  }
