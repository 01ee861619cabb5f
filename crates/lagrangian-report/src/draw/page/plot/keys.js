  // The keyboard: arrows move the cursor, + and − zoom, 0 resets, l changes the scale; what is read is announced.

  const KEYS = "Arrow keys read values, Shift with them goes faster, Home and End go to the ends; plus and minus zoom, 0 resets, L changes between a linear and a logarithmic scale, Escape leaves.";

  const spoken = element("div", "unseen");
  spoken.setAttribute("aria-live", "polite");

  function announce(plot) {
    const marks = plot.cursor && plot.frame && marked(plot);
    if (!marks) return;
    const values = marks.rows.map(({ name, value }) => (value ? `${name} ${value}` : name));
    spoken.textContent = [marks.head, ...values].filter(Boolean).join(", ");
  }

  function keys(plot) {
    plot.box.addEventListener("keydown", (event) => {
      if (event.altKey || event.metaKey || event.ctrlKey || !plot.frame) return;
      if (!pressed(plot, event.key, event.shiftKey)) return;
      event.preventDefault();
    });
    plot.box.addEventListener("blur", () => point(plot, null));
  }

  // Whether the key means something here.
  function pressed(plot, key, fast) {
    if (key.startsWith("Arrow") || key === "Home" || key === "End") return stepped(plot, key, fast);
    const zoom = { "+": 0.6, "=": 0.6, "-": 1 / 0.6, "−": 1 / 0.6 }[key];
    if (zoom) zoomAt(plot, cursorPart(plot), zoom);
    else if (key === "0") plot.reset();
    else if (key === "l" || key === "L") plot.toggleLog();
    else if (key === "Escape") plot.box.blur();
    else return false;
    if (key !== "Escape") say(plot, key);
    return true;
  }

  function say(plot, key) {
    const range = (axis) => `${axis.label} from ${axis.write(axis.outer(axis.view[0]))} to ${withUnit(axis, axis.outer(axis.view[1]))}`;
    const scale = key === "l" || key === "L" ? (plot.y.log ? "logarithmic scale, " : "linear scale, ") : "";
    spoken.textContent = `${scale}${range(plot.x)}, ${range(plot.y)}`;
  }

  // Where the cursor is, in parts of the frame; the middle where there is none.
  function cursorPart(plot) {
    const marks = plot.cursor && marked(plot);
    if (!marks) return [0.5, 0.5];
    const { frame } = plot;
    return [(marks.px - frame.left) / frame.width, marks.py === undefined ? 0.5 : (frame.bottom - marks.py) / frame.height];
  }

  function stepped(plot, key, fast) {
    const next = plot.map ? nextCell(plot, key, fast) : plot.sweeps ? nextOnSweep(plot, key, fast) : nextPoint(plot, key, fast);
    if (!next) return false;
    reveal(plot, next);
    point(plot, next);
    announce(plot);
    return true;
  }

  const sign = (key) => ({ ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1 })[key] ?? 0;

  // Along the longest curve, by a sample or by what can be seen.
  function nextOnSweep(plot, key, fast) {
    if (key === "ArrowUp" || key === "ArrowDown" || !plot.shown.length) return null;
    const { x } = plot.shown.reduce((most, one) => (one.x.length > most.x.length ? one : most));
    const last = x.length - 1, clamp = (k) => Math.min(Math.max(k, 0), last);
    if (key === "Home" || key === "End") return { x: key === "Home" ? x[0] : x[last] };
    if (!plot.cursor) return { x: x[nearest(x, plot.x.value(key === "ArrowRight" ? 0 : 1))] };
    const from = nearest(x, plot.cursor.x), least = (plot.x.view[1] - plot.x.view[0]) / (fast ? 20 : 200);
    let k = clamp(from + sign(key));
    while (k > 0 && k < last && Math.abs(plot.x.inner(x[k]) - plot.x.inner(x[from])) < least) k += sign(key);
    return { x: x[k] };
  }

  // Along one curve or cloud; up and down, to the next one.
  function nextPoint(plot, key, fast) {
    const all = plot.shown.filter((one) => one.y.length);
    if (!all.length) return null;
    let { one, k } = plot.cursor ?? { one: all[0], k: -1 };
    if (key === "ArrowUp" || key === "ArrowDown") {
      one = all[(Math.max(all.indexOf(one), 0) + all.length - sign(key)) % all.length];
      k = Math.max(k, 0) - 1;
    }
    const count = one.y.length, jump = fast ? Math.max(10, Math.round(count / 20)) : 1;
    const way = key === "ArrowLeft" || key === "End" ? -1 : 1;
    k = key === "Home" ? 0 : key === "End" ? count - 1 : Math.min(Math.max(k + way * (sign(key) && key !== "ArrowUp" && key !== "ArrowDown" ? jump : 1), 0), count - 1);
    while (k > 0 && k < count - 1 && !Number.isFinite(one.y[k])) k += way;
    return { one, k };
  }

  function nextCell(plot, key, fast) {
    const { columns, rows } = plot.map, jump = fast ? 10 : 1;
    let { column, row } = plot.cursor ?? { column: columns >> 1, row: rows >> 1 };
    if (key === "Home" || key === "End") column = key === "Home" ? 0 : columns - 1;
    else if (key === "ArrowLeft" || key === "ArrowRight") column += jump * sign(key);
    else row += jump * sign(key);
    return { column: Math.min(Math.max(column, 0), columns - 1), row: Math.min(Math.max(row, 0), rows - 1) };
  }

  // Moves the view so that the cursor is in it.
  function reveal(plot, cursor) {
    if (plot.map) return;
    const into = (axis, value) => {
      const inner = axis.inner(value), [low, high] = axis.view;
      if (inner < low) axis.pan((inner - low) / (high - low) - 0.05);
      else if (inner > high) axis.pan((inner - high) / (high - low) + 0.05);
      else return;
      plot.changed(true);
    };
    into(plot.x, plot.sweeps ? cursor.x : cursor.one.x[cursor.k]);
    if (!plot.sweeps) into(plot.y, cursor.one.y[cursor.k]);
  }
