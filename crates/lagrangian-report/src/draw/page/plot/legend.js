// Legends that show and hide curves.

import { element, swatchKind } from "./plot.js";

// A legend of the curves of some plots; a second click in short turn leaves one curve alone.
export function legend(plots) {
  const named = new Map();
  for (const one of plots.flatMap((plot) => plot.series)) if (one.name && !named.has(one.name)) named.set(one.name, one);
  if (named.size === 0) return null;
  const list = element("div", "legend"), names = [...named.keys()];
  list.setAttribute("role", "group");
  list.setAttribute("aria-label", "Curves");
  const curves = (name) => plots.flatMap((plot) => plot.series.filter((one) => one.name === name || (!one.name && one.ink === named.get(name).ink)));
  const isShown = (name) => curves(name)[0].shown;
  const show = (wanted) => {
    const shown = names.map(wanted);
    names.forEach((name, k) => {
      list.children[k].setAttribute("aria-pressed", shown[k]);
      for (const one of curves(name)) one.shown = shown[k];
    });
    for (const plot of plots) {
      plot.settle();
      plot.changed(false);
    }
  };
  for (const [name, one] of named) {
    const button = element("button", "curve");
    button.type = "button";
    button.setAttribute("aria-pressed", isShown(name));
    button.append(element("span", `swatch ${swatchKind(one)} ${one.ink}`), element("span", "name", name));
    button.addEventListener("click", () => show((other) => (other === name) !== isShown(other)));
    button.addEventListener("dblclick", () => {
      const alone = names.every((other) => isShown(other) === (other === name));
      show((other) => alone || other === name);
    });
    list.append(button);
  }
  return list;
}
