  // What stands around plots: legends that show and hide curves, buttons, and how to use them.

  // A legend of the curves of some plots; a second click in short turn leaves one curve alone.
  function legend(plots) {
    const named = new Map();
    for (const one of plots.flatMap((plot) => plot.series)) if (one.name && !named.has(one.name)) named.set(one.name, one);
    if (named.size === 0) return null;
    const list = element("div", "legend");
    list.setAttribute("role", "group");
    list.setAttribute("aria-label", "Curves");
    const curves = (name) => plots.flatMap((plot) => plot.series.filter((one) => one.name === name || (!one.name && one.ink === named.get(name).ink)));
    const isShown = (name) => curves(name)[0].shown;
    const show = (wanted) => {
      for (const button of list.children) {
        const shown = wanted(button.dataset.name);
        button.setAttribute("aria-pressed", shown);
        for (const one of curves(button.dataset.name)) one.shown = shown;
      }
      for (const plot of plots) {
        plot.settle();
        plot.changed();
      }
    };
    for (const [name, one] of named) {
      const button = element("button", "curve");
      button.type = "button";
      button.dataset.name = name;
      button.setAttribute("aria-pressed", "true");
      button.append(element("span", `swatch ${swatchKind(one)} ${one.ink}`), element("span", "name", name));
      button.addEventListener("click", () => show((other) => (other === name) !== isShown(other)));
      button.addEventListener("dblclick", () => {
        const alone = [...named.keys()].every((other) => isShown(other) === (other === name));
        show((other) => alone || other === name);
      });
      list.append(button);
    }
    return list;
  }

  // The buttons of a plot: its scale, where it can be another one, the initial view, and files.
  function tools(plot) {
    const bar = element("div", "tools"), reset = element("button", "reset", "Reset"), scale = element("button", "scale", "Log");
    reset.type = scale.type = "button";
    reset.hidden = true;
    scale.hidden = !plot.canBeLog;
    scale.setAttribute("aria-label", "Log scale: " + plot.title);
    reset.setAttribute("aria-label", "Reset the view: " + plot.title);
    scale.setAttribute("aria-pressed", plot.y.log);
    reset.addEventListener("click", () => { plot.reset(); plot.box.focus(); });
    scale.addEventListener("click", () => plot.toggleLog());
    plot.onchange = () => {
      reset.hidden = !plot.zoomed;
      scale.setAttribute("aria-pressed", plot.y.log);
    };
    bar.append(reset, scale, saving(plot));
    return bar;
  }

  // The colours of a map and what they stand for.
  function ramp({ limit }) {
    const bar = element("div", "ramp");
    bar.append(element("span", "", significant(-limit)), element("i", ""), element("span", "", significant(limit)));
    return bar;
  }

  function hint() {
    const touch = matchMedia("(pointer: coarse)").matches;
    const text = touch
      ? "Touch a figure to read values, drag sideways to move along it, pinch to zoom, tap twice to reset. Tap a name to hide its curve."
      : "Point at a figure to read values, drag to zoom into a box, drag with Shift to pan, turn the wheel with Ctrl (or after a click) to zoom, double-click to reset. Click a name to hide its curve, double-click to see it alone. Keys: arrows, +, −, 0, L.";
    return element("p", "caption hint", text);
  }
