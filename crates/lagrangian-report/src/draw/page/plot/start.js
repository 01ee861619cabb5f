// Fills the figures of the page with plots.

import { unpacked } from "./arrays.js";
import { significant } from "./axis.js";
import { KEYS } from "./hands.js";
import { legend } from "./legend.js";
import { element, forgetInks, Plot } from "./plot.js";
import { saving } from "./save.js";

const MANY = 6; // curves from which values stand beneath the plot of a phone (style.css), where they would hide it
const HINTS = {
  fine: "Point at a figure to read values, drag to zoom into a box, drag with Shift to pan, turn the wheel with Ctrl (or after a click) to zoom, double-click to reset. Click a name to hide its curve, double-click to see it alone. Keys: arrows, +, −, 0, L.",
  coarse: "Touch a figure to read values, drag sideways to move along it, pinch to zoom, tap twice to reset. Tap a name to hide its curve.",
};

const { arrays, plots, paper } = JSON.parse(document.getElementById("plots").textContent);
const read = [], links = new Map(), live = new Map();
const pool = (k) => (k === undefined ? undefined : (read[k] ??= unpacked(arrays[k])));
const spoken = element("div", "unseen");
spoken.setAttribute("aria-live", "polite");

// The buttons of a plot: its scale, where it can be another one, the initial view, and files.
function tools(plot, figure) {
  const bar = element("div", "tools"), reset = element("button", "reset", "Reset"), scale = element("button", "scale", "Log");
  reset.type = scale.type = "button";
  scale.hidden = !plot.canBeLog;
  reset.setAttribute("aria-label", "Reset the view: " + plot.title);
  scale.setAttribute("aria-label", "Log scale: " + plot.title);
  reset.addEventListener("click", () => { plot.reset(); plot.box.focus(); });
  scale.addEventListener("click", () => plot.toggleLog());
  plot.onchange = () => {
    reset.hidden = !plot.zoomed;
    scale.setAttribute("aria-pressed", plot.y.log);
  };
  plot.onchange();
  bar.append(reset, scale, saving(plot, figure.id, (name) => paper[name]));
  return bar;
}

// In the card of an animation the plot shows the time of the player, which goes to where the plot is clicked.
function playing(player, plot) {
  const now = element("div", "now");
  let time = Number(player.querySelector(".slider").value);
  const place = () => {
    if (!plot.u) return;
    const px = plot.px(time);
    if (now.parentNode !== plot.u.over) plot.u.over.append(now);
    now.hidden = !(px >= 0 && px <= plot.wide);
    now.style.transform = `translateX(${px}px)`;
  };
  player.addEventListener("timechange", ({ detail }) => { time = detail; place(); });
  plot.box.addEventListener("click", () => plot.cursor && player.dispatchEvent(new CustomEvent("seek", { detail: plot.cursor.x })));
  plot.drawn = place;
}

for (const figure of document.querySelectorAll("[data-plot]")) {
  const { series, words, ...spec } = plots[figure.dataset.plot], box = figure.querySelector(".plot"), caption = figure.querySelector("figcaption");
  if (spec.map) spec.map.values = pool(spec.map.values);
  const plot = new Plot(uPlot, box, spec);
  const attributes = { tabindex: 0, role: "application", "aria-roledescription": "interactive figure", "aria-label": spec.title, "aria-describedby": words + " keys" };
  for (const [name, value] of Object.entries(attributes)) box.setAttribute(name, value);
  plot.announce = (text) => { spoken.textContent = text; };
  plot.set(series.map((one) => ({ ...one, x: pool(one.x), y: pool(one.y), low: pool(one.low) ?? [], high: pool(one.high) ?? [] })));
  if (series.length >= MANY) {
    box.classList.add("many");
    box.style.setProperty("--lines", 1 + Math.ceil(series.length / 2));
  }
  const player = figure.closest(".player");
  if (player) playing(player, plot);
  caption.prepend(tools(plot, figure));
  if (plot.map) {
    const bar = element("div", "ramp");
    bar.append(element("span", "", significant(-plot.map.limit)), element("i"), element("span", "", significant(plot.map.limit)));
    caption.append(bar);
  }
  if (plot.sweeps) {
    plot.link = links.get(plot.x.text) ?? plot.link;
    if (!plot.link.includes(plot)) plot.link.push(plot);
    links.set(plot.x.text, plot.link);
  }
  live.set(box, plot);
  figure.classList.add("live");
}

for (const group of document.querySelectorAll(".group")) {
  const own = [...group.querySelectorAll("[data-plot] .plot")].map((box) => live.get(box));
  if (group.classList.contains("shared")) group.prepend(legend(own) ?? "");
  else for (const plot of own) plot.box.before(legend([plot]) ?? "");
}

const help = element("p", "unseen", KEYS);
help.id = "keys";
document.querySelector("main").append(help, spoken);
document.querySelector(".section > .group")?.before(element("p", "caption hint", HINTS[matchMedia("(pointer: coarse)").matches ? "coarse" : "fine"]));

// What comes into sight is drawn one plot a frame, so that the page scrolls smoothly.
const later = new Set();
const next = () => {
  const [plot] = later;
  later.delete(plot);
  if (plot?.near && plot.unseen) plot.draw();
  if (later.size) requestAnimationFrame(next);
};
const sight = new IntersectionObserver((entries) => {
  const idle = later.size === 0;
  for (const { target, isIntersecting } of entries) {
    const plot = live.get(target);
    plot.near = isIntersecting;
    if (isIntersecting && plot.unseen) later.add(plot);
  }
  if (idle && later.size) requestAnimationFrame(next);
}, { rootMargin: "800px 0px" });
const size = new ResizeObserver((entries) => entries.forEach(({ target }) => live.get(target).changed(false)));
for (const box of live.keys()) {
  sight.observe(box);
  size.observe(box);
}
document.documentElement.addEventListener("themechange", () => {
  forgetInks();
  for (const plot of live.values()) plot.changed(false);
});
addEventListener("pointerdown", ({ target }) => {
  for (const plot of live.values()) if (plot.cursor && !target.closest?.(".plot")) plot.point(null);
});

// Paper shows a picture of each plot, on white and in sharp lines, of plots that were never in sight too.
addEventListener("beforeprint", () => {
  for (const plot of live.values()) {
    plot.still(3, (name) => paper[name]).then((canvas) => {
      canvas.className = "printed";
      plot.box.append(canvas);
    });
  }
});
addEventListener("afterprint", () => document.querySelectorAll(".printed").forEach((canvas) => canvas.remove()));
