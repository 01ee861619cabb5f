// What hands do with a plot beside what uPlot knows: keys, fingers, the wheel, and a drag with Shift.

import { nearest } from "./axis.js";

export const KEYS = "Arrow keys read values, Shift with them goes faster, Home and End go to the ends; plus and minus zoom, 0 resets, L changes between a linear and a logarithmic scale, Escape leaves.";

const within = (value, most) => Math.min(Math.max(value, 0), most);

export function hands(plot) {
  const { box } = plot, fingers = new Map();
  let tap = null, tapped = -1e9; // a press of one finger, and when the last one ended
  const spot = ({ clientX, clientY }) => {
    const edge = plot.u.over.getBoundingClientRect();
    return [clientX - edge.left, clientY - edge.top];
  };

  // Zooms around a place of the frame, px: a sweep along its abscissa, and along its ordinate where the pointer is beside it.
  function zoomAt([left, top], factor) {
    if (left >= 0) plot.x.zoom(factor, within(left / plot.wide, 1));
    if (left < 0 || !plot.sweeps) plot.y.zoom(factor, within(1 - top / plot.tall, 1));
    plot.moved();
  }

  function pan(across, up) {
    plot.x.pan(across / plot.wide);
    plot.y.pan(up / plot.tall);
    plot.moved();
  }

  function pans(event) {
    let last = spot(event);
    const go = (event) => {
      const now = spot(event);
      pan(last[0] - now[0], now[1] - last[1]);
      last = now;
    };
    addEventListener("mousemove", go);
    addEventListener("mouseup", () => removeEventListener("mousemove", go), { once: true });
  }

  // One finger reads values, two move and stretch the view; a finger that goes up or down scrolls the page.
  function finger(event) {
    if (event.pointerType !== "touch" || !plot.u) return;
    const at = spot(event), before = [...fingers.values()];
    if (event.type === "pointerdown") fingers.set(event.pointerId, at);
    else if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, at);
    const now = [...fingers.values()];
    if (event.type === "pointerdown") tap = now.length === 1 ? at : null;
    else if (tap && Math.hypot(at[0] - tap[0], at[1] - tap[1]) > 5) tap = null;
    if (now.length === 1) {
      plot.u.setCursor({ left: within(at[0], plot.wide), top: within(at[1], plot.tall) }, true, true);
    } else if (now.length === 2 && before.length === 2) {
      const middle = ([a, b]) => [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2], apart = ([a, b]) => Math.hypot(a[0] - b[0], a[1] - b[1]);
      const [from, to] = [middle(before), middle(now)];
      pan(from[0] - to[0], plot.sweeps ? 0 : to[1] - from[1]);
      zoomAt(to, apart(before) / Math.max(apart(now), 1));
    }
  }

  // A second tap in short turn resets.
  function lifted(event) {
    if (!fingers.delete(event.pointerId) || !tap || event.type !== "pointerup") return;
    const again = event.timeStamp - tapped < 320;
    tapped = again ? -1e9 : event.timeStamp;
    if (again) plot.reset();
  }

  function turned(event) {
    if (!plot.u || !(event.ctrlKey || document.activeElement === box)) return;
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    if (Math.abs(event.deltaX) > Math.abs(event.deltaY) || event.shiftKey) pan((event.deltaX || event.deltaY) * lines, 0);
    else zoomAt(spot(event), Math.exp(within(event.deltaY * lines + 120, 240) * 0.0025 - 0.3));
  }

  const acts = { "+": 0.6, "=": 0.6, "-": 1 / 0.6, "−": 1 / 0.6 };
  function pressed(event) {
    if (event.altKey || event.metaKey || event.ctrlKey || !plot.u) return;
    const { key } = event, { x, y } = plot;
    const range = (axis) => `${axis.label} from ${axis.write(axis.outer(axis.view[0]))} to ${axis.withUnit(axis.outer(axis.view[1]))}`;
    if (key.startsWith("Arrow") || key === "Home" || key === "End") {
      const next = stepped(plot, key, event.shiftKey);
      if (!next) return;
      reveal(plot, next);
      plot.point(next);
      const { head, rows } = plot.marks() ?? { rows: [] };
      plot.announce([head, ...rows.map(({ name, value }) => (value ? `${name} ${value}` : name))].filter(Boolean).join(", "));
    } else if (key === "Escape") {
      box.blur();
    } else if (acts[key] || key === "0" || key.toLowerCase() === "l") {
      if (acts[key]) zoomAt(plot.cursor ? [plot.u.cursor.left, plot.u.cursor.top] : [plot.wide / 2, plot.tall / 2], acts[key]);
      else if (key === "0") plot.reset();
      else plot.toggleLog();
      plot.announce(`${key.toLowerCase() === "l" ? (y.log ? "logarithmic scale, " : "linear scale, ") : ""}${range(x)}, ${range(y)}`);
    } else {
      return;
    }
    event.preventDefault();
  }

  for (const kind of ["pointerdown", "pointermove"]) box.addEventListener(kind, finger);
  for (const kind of ["pointerup", "pointercancel"]) box.addEventListener(kind, lifted);
  box.addEventListener("wheel", turned, { passive: false });
  box.addEventListener("keydown", pressed);
  box.addEventListener("blur", () => plot.point(null));
  return { pans };
}

// The next cursor of a key; null where the key means nothing.
function stepped(plot, key, fast) {
  const way = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 }[key] ?? 0, aside = key === "ArrowUp" || key === "ArrowDown";
  const to = (count, from, jump) => (key === "Home" ? 0 : key === "End" ? count - 1 : within(from + way * jump, count - 1));
  if (plot.map) {
    const { columns, rows } = plot.map, { column, row } = plot.cursor ?? { column: columns >> 1, row: rows >> 1 };
    return aside ? { column, row: to(rows, row, fast ? 10 : 1) } : { column: to(columns, column, fast ? 10 : 1), row };
  }
  const all = plot.shown.filter((one) => one.y.length);
  if (!all.length || (plot.sweeps && aside)) return null;
  if (plot.sweeps) {
    // Along the longest curve, by a sample or by what can be seen.
    const { x } = all.reduce((most, one) => (one.x.length > most.x.length ? one : most)), { view, width } = plot.x;
    if (!plot.cursor && way) return { x: x[nearest(x, plot.x.outer(view[way > 0 ? 0 : 1]))] };
    const from = way && nearest(x, plot.cursor.x);
    let k = to(x.length, from, 1);
    while (way && k > 0 && k < x.length - 1 && Math.abs(plot.x.inner(x[k]) - plot.x.inner(x[from])) < width / (fast ? 20 : 200)) k += way;
    return { x: x[k] };
  }
  // Along one curve or cloud; up and down, to the next one.
  let { one, k } = plot.cursor ?? { one: all[0], k: -1 };
  if (aside) [one, k] = [all[(Math.max(all.indexOf(one), 0) + all.length - way) % all.length], Math.max(k, 0)];
  const count = one.y.length, back = key === "ArrowLeft" || key === "End" ? -1 : 1;
  k = aside ? Math.min(k, count - 1) : to(count, k, fast ? Math.max(10, Math.round(count / 20)) : 1);
  while (k + back >= 0 && k + back < count && !Number.isFinite(plot.y.inner(one.y[k]))) k += back;
  return { one, k };
}

// Moves the view so that a cursor is in it.
function reveal(plot, cursor) {
  plot.placeOf(cursor).forEach((value, k) => {
    const axis = [plot.x, plot.y][k], inner = axis.inner(value), [low, high] = axis.view;
    if (inner < low) axis.pan((inner - low) / axis.width - 0.05);
    else if (inner > high) axis.pan((inner - high) / axis.width + 0.05);
    else return;
    plot.moved();
  });
}
