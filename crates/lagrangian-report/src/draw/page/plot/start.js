  // Makes the static figures of the page live.

  const holder = document.getElementById("plots");
  const page = holder ? JSON.parse(holder.textContent) : { arrays: [], plots: [] };
  const none = new Float64Array(0), read = [];
  const pool = (k) => (k === undefined || k === null ? none : (read[k] ??= unpacked(page.arrays[k])));
  const links = new Map(), live = new Map();

  for (const figure of document.querySelectorAll("[data-plot]")) {
    const plot = new Plot(figure, page.plots[figure.dataset.plot], pool);
    live.set(figure, plot);
    gestures(plot);
    keys(plot);
    figure.querySelector("figcaption").prepend(tools(plot));
    if (plot.map) figure.querySelector("figcaption").append(ramp(plot.map));
    if (plot.sweeps) {
      if (!links.has(plot.x.text)) links.set(plot.x.text, new Link());
      links.get(plot.x.text).add(plot);
    }
    figure.classList.add("live");
  }

  for (const group of document.querySelectorAll(".group")) {
    const plots = [...group.querySelectorAll("[data-plot]")].map((figure) => live.get(figure));
    if (group.classList.contains("shared")) {
      const shared = legend(plots);
      if (shared) group.prepend(shared);
      continue;
    }
    for (const plot of plots) {
      const own = legend([plot]);
      if (own) plot.box.before(own);
    }
  }

  if (live.size) {
    const help = element("p", "unseen", KEYS);
    help.id = "keys";
    document.querySelector("main").append(help, spoken);
    document.querySelector(".group").before(hint());
    const plotOf = new Map([...live.values()].map((plot) => [plot.box, plot]));
    const sight = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) {
        const plot = plotOf.get(target);
        plot.near = isIntersecting;
        if (isIntersecting && plot.stale) later.add(plot);
        else if (isIntersecting) plot.paintCursor();
      }
      next();
    }, { rootMargin: "800px 0px" });
    // What comes into sight is painted one plot a frame, so that the page scrolls smoothly.
    const later = new Set();
    let waiting = 0;
    const next = () => {
      if (waiting || later.size === 0) return;
      waiting = requestAnimationFrame(() => {
        waiting = 0;
        const [plot] = later;
        later.delete(plot);
        if (plot.stale && plot.near) plot.paint();
        next();
      });
    };
    const size = new ResizeObserver((entries) => entries.forEach(({ target }) => plotOf.get(target).draw()));
    for (const box of plotOf.keys()) {
      sight.observe(box);
      size.observe(box);
    }
    root.addEventListener("themechange", () => {
      for (const plot of live.values()) {
        plot.picture = null;
        plot.draw();
      }
    });
    addEventListener("pointerdown", ({ target }) => {
      for (const plot of live.values()) if (plot.cursor && !target.closest?.(".plot")) point(plot, null);
    });
  }
