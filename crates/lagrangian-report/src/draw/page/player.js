(() => {
  "use strict";
  const root = document.documentElement;
  const inks = new Map(); // those of the theme, which frames ask for again and again
  function ink(name) {
    if (!inks.has(name)) inks.set(name, getComputedStyle(root).getPropertyValue("--" + name).trim());
    return inks.get(name);
  }
  root.addEventListener("themechange", () => inks.clear());
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  const TRAIL = 2.4; // s

  // A canvas fitted to its box and the screen's density; returns its context and size in px.
  function fitted(canvas) {
    const { clientWidth: w, clientHeight: h } = canvas;
    const density = Math.min(devicePixelRatio || 1, 3);
    if (canvas.width !== Math.round(w * density) || canvas.height !== Math.round(h * density)) {
      canvas.width = Math.round(w * density);
      canvas.height = Math.round(h * density);
    }
    const context = canvas.getContext("2d");
    context.setTransform(density, 0, 0, density, 0, 0);
    context.clearRect(0, 0, w, h);
    return { context, w, h };
  }

  const digits = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const power = (k) => "10" + (k < 0 ? "⁻" : "") + [...String(Math.abs(k))].map((d) => digits[d]).join("");
  function percent(share) {
    if (!Number.isFinite(share)) return "";
    const value = 100 * share;
    if (value === 0) return "0 %";
    const k = Math.floor(Math.log10(value));
    if (k >= -2 && k < 5) return value.toFixed(Math.max(0, 2 - Math.max(k, 0))) + " %";
    return (value / 10 ** k).toFixed(1) + "×" + power(k) + " %";
  }

  // The values of a fractional frame: Catmull–Rom between frames, so that fast turns stay round.
  function values(panel, place) {
    const n = panel.width;
    const last = panel.values.length / n - 1;
    if (last < 0 || place > last + 1e-6) return null;
    const k = Math.min(Math.floor(place), Math.max(0, last - 1));
    const u = place - k;
    const found = [];
    for (let i = 0; i < n; i++) {
      const at = (f) => panel.values[Math.min(Math.max(f, 0), last) * n + i];
      const [a, b, c, d] = [at(k - 1), at(k), at(k + 1), at(k + 2)];
      if (b === null || c === null) return null;
      const p = a ?? b, q = d ?? c;
      found.push((b + 0.5 * u * (c - p + u * (2 * p - 5 * b + 4 * c - q + u * (3 * (b - c) + q - p)))) / panel.unit);
    }
    return found;
  }

  // The points of a fractional frame, in parts of the radius of the stage from its middle.
  function points(panel, place) {
    const own = values(panel, place);
    if (!own) return null;
    if (panel.joined) return panel.joined.map((_, k) => [own[2 * k], own[2 * k + 1]]);
    const spots = [[0, 0]];
    own.forEach((angle, i) => {
      const [x, y] = spots[i];
      spots.push([x + panel.lengths[i] * Math.sin(angle), y - panel.lengths[i] * Math.cos(angle)]);
    });
    return spots;
  }

  function player(box) {
    const data = JSON.parse(box.querySelector("script").textContent);
    const views = [...box.querySelectorAll(".panels figure")];
    const outputs = views.map((view) => view.querySelector("output"));
    const [play, clock, slider] = [".play", ".clock", ".slider"].map((name) => box.querySelector(name));
    const [speed, trails] = [".speed", ".trails"].map((name) => box.querySelector(name));
    const truth = data.panels.find((panel) => panel.ink === "truth");
    let time = 0, playing = false, visible = true, before = 0, next = 0;

    function joined(context, panel, spots, place, colour, width, bob) {
      context.strokeStyle = context.fillStyle = colour;
      context.lineWidth = width;
      context.lineJoin = context.lineCap = "round";
      context.beginPath();
      spots.forEach((spot, k) => {
        if (k === 0) return;
        const parent = panel.joined ? panel.joined[k] : k - 1;
        context.moveTo(...place(spots[parent] ?? spots[0]));
        context.lineTo(...place(spot));
      });
      context.stroke();
      spots.forEach((spot, k) => {
        context.beginPath();
        context.arc(...place(spot), k === 0 ? 0.45 * bob : bob, 0, 7);
        context.fill();
      });
    }

    function trail(context, panel, place, colour) {
      context.strokeStyle = colour;
      context.lineWidth = 1.8;
      context.lineCap = "butt";
      const bands = 16, steps = 8;
      for (let band = 0; band < bands; band++) {
        context.globalAlpha = 0.75 * ((band + 1) / bands) ** 1.6;
        context.beginPath();
        for (let step = 0; step <= steps; step++) {
          const t = time - TRAIL * (1 - (band + step / steps) / bands);
          const spots = t < 0 ? null : points(panel, t / data.dt);
          if (spots) context.lineTo(...place(spots[spots.length - 1]));
        }
        context.stroke();
      }
      context.globalAlpha = 1;
    }

    // Draws a panel; returns what is said below it.
    function drawPanel(panel, view) {
      const { context, w, h } = fitted(view.querySelector("canvas"));
      const radius = 0.455 * Math.min(w, h);
      const place = ([x, y]) => [w / 2 + x * radius, h / 2 - y * radius];
      const colour = ink(panel.ink), bob = Math.max(5, 0.024 * Math.min(w, h)) * (panel.joined ? 0.6 : 1);
      context.strokeStyle = ink("grid");
      context.lineWidth = 1;
      context.beginPath();
      context.arc(w / 2, h / 2, radius, 0, 7);
      context.stroke();
      const ghost = truth && panel !== truth && points(truth, time / data.dt);
      if (ghost) joined(context, truth, ghost, place, ink("axis"), 1.6, 0.7 * bob);
      if (trails.checked) trail(context, panel, place, colour);
      const spots = points(panel, time / data.dt);
      if (spots) joined(context, panel, spots, place, colour, 2.6, bob);
      if (!spots) return "ended at " + panel.end.toFixed(1) + " s";
      const error = panel.error ? panel.error[Math.round(time / data.dt)] : null;
      return error === null || error === undefined ? "" : "energy error " + percent(error);
    }

    function say(place, words) {
      if (place.textContent !== words) place.textContent = words;
    }

    // All is drawn before anything is written: a size that is read after words have changed lays the page out again.
    function draw() {
      const words = data.panels.map((panel, k) => drawPanel(panel, views[k]));
      words.forEach((own, k) => say(outputs[k], own));
      say(clock, time.toFixed(1) + " / " + data.duration.toFixed(0) + " s");
      slider.value = time;
      box.dispatchEvent(new CustomEvent("timechange", { detail: time })); // the plot of energy errors shows it
    }

    function tick(now) {
      if (!playing || !visible) return;
      time += Math.min(Math.max((now - before) / 1000, 0), 0.1) * Number(speed.value);
      before = now;
      if (time > data.duration) time = 0;
      draw();
      next = requestAnimationFrame(tick);
    }

    function run(yes) {
      playing = yes;
      play.textContent = yes ? "Pause" : "Play";
      before = performance.now();
      cancelAnimationFrame(next);
      if (yes) next = requestAnimationFrame(tick);
    }

    function seek(to) {
      time = Math.min(Math.max(to, 0), data.duration);
      draw();
    }

    play.addEventListener("click", () => run(!playing));
    slider.addEventListener("input", () => seek(Number(slider.value)));
    trails.addEventListener("change", draw);
    box.addEventListener("seek", ({ detail }) => seek(detail));
    root.addEventListener("themechange", draw);
    new ResizeObserver(draw).observe(box);
    new IntersectionObserver(([entry]) => {
      visible = entry.isIntersecting;
      if (visible && playing) run(true);
    }).observe(box);
    const start = new URLSearchParams(location.search).get("t");
    seek(start === null ? 0 : Number(start) || 0);
    run(!calm && start === null);
  }

  document.querySelectorAll(".player").forEach(player);
})();
