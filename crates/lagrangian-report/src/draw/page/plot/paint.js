// The paths that uPlot draws for the kinds of a series, and the cells of a map.

const FEW = 100; // dots that are drawn larger

// The paths of a series in px of the canvas; `s` px are one of the page.
export function paths(u, plot, one, s) {
  const density = devicePixelRatio * s, bound = (px) => (px > 1e5 ? 1e5 : px < -1e5 ? -1e5 : px), { left, top, width, height } = u.bbox;
  const X = (value) => bound(left + plot.x.at(value) * width), Y = (value) => bound(top + (1 - plot.y.at(value)) * height);
  const stroke = new Path2D(), fill = new Path2D();
  if (one.kind === "points") dots(fill, one, X, Y, (one.y.length > FEW ? 1.9 : 3.5) * density);
  else line(stroke, one, X, Y, density, one.y.length > 4 * width);
  if (one.kind === "band") band(fill, one, X, Y);
  return { stroke, fill, clip: null, flags: 3 };
}

function dots(path, { x, y }, X, Y, radius) {
  for (let k = 0; k < y.length; k++) {
    const px = X(x[k]), py = Y(y[k]);
    if (Number.isNaN(px + py)) continue;
    path.moveTo(px + radius, py);
    path.arc(px, py, radius, 0, 7);
  }
}

function band(path, { x, low, high }, X, Y) {
  const there = (k) => k < low.length && !Number.isNaN(X(x[k]) + Y(low[k]) + Y(high[k]));
  for (let start = 0, end; start < low.length; start = end + 1) {
    end = start;
    if (!there(start)) continue;
    while (there(end + 1)) end++;
    for (let k = start; k <= end; k++) path[k === start ? "moveTo" : "lineTo"](X(x[k]), Y(low[k]));
    for (let k = end; k >= start; k--) path.lineTo(X(x[k]), Y(high[k]));
    path.closePath();
  }
}

// A line; of many samples that follow each other in a column of pixels, the first, lowest, highest and last. One between gaps is a dot.
function line(path, { x, y }, X, Y, density, dense) {
  let column = null, drawn = 0;
  const flush = (ended) => {
    if (!column) return;
    const { px, first, low, high, last } = column;
    if (drawn === 0) path.moveTo(px, first);
    if (drawn === 0 && ended && low === high) path.arc(px, first, 1.8 * density, 0, 7);
    for (const py of low === high ? [last] : [first, low, high, last]) path.lineTo(px, py);
    drawn++;
    column = null;
  };
  for (let k = 0; k < y.length; k++) {
    const px = X(x[k]), py = Y(y[k]);
    if (Number.isNaN(px + py)) {
      flush(true);
      drawn = 0;
    } else if (dense && column && Math.floor(px) === Math.floor(column.px)) {
      column.low = Math.max(column.low, py);
      column.high = Math.min(column.high, py);
      column.last = py;
    } else {
      flush(false);
      column = { px, first: py, low: py, high: py, last: py };
    }
  }
  flush(true);
}

// The cells of a map: two inks, one a sign, the stronger the larger.
export function paintMap(u, { x, y, map }, colour) {
  const { columns, rows, values, limit } = map, { ctx, bbox } = u;
  const picture = document.createElement("canvas");
  [picture.width, picture.height] = [columns, rows];
  const context = picture.getContext("2d"), image = context.createImageData(columns, rows);
  const rgb = (name) => [1, 3, 5].map((k) => parseInt(colour(name).slice(k, k + 2), 16));
  const [negative, positive] = [rgb("lnn"), rgb("baseline")];
  values.forEach((value, k) => {
    const strength = Math.min(Math.abs(value / limit), 1), at = 4 * ((rows - 1 - Math.floor(k / columns)) * columns + (k % columns));
    if (strength > 0) image.data.set([...(value > 0 ? positive : negative), Math.round(255 * strength)], at);
  });
  context.putImageData(image, 0, 0);
  const [left, right] = x.home.map((end) => bbox.left + ((end - x.view[0]) / x.width) * bbox.width);
  const [bottom, top] = y.home.map((end) => bbox.top + (1 - (end - y.view[0]) / y.width) * bbox.height);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.imageSmoothingEnabled = false;
  ctx.drawImage(picture, left, top, right - left, bottom - top);
  ctx.restore();
}
