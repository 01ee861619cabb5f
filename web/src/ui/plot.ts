// A plot of a view: that of pages, with its values and its legend beneath.

import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { legend } from "../../../crates/lagrangian-report/src/draw/page/plot/legend.js";
import { Plot as Drawn, forgetInks, ink } from "../../../crates/lagrangian-report/src/draw/page/plot/plot.js";
import { short } from "./controls";
import { el } from "./element";
import { withNextFrame } from "./frame";

export interface Curve {
  name: string;
  /** A colour of the style sheet, such as `--truth`. */
  colour: string;
  x: number[];
  y: number[];
  dashed?: boolean;
  /** Points and no line. */
  dots?: boolean;
}

/** A point that is marked. */
export interface Spot {
  x: number;
  y: number;
  colour: string;
}

export interface Settings {
  title: string;
  /** What the axes show, with their units after a comma. */
  x: string;
  y: string;
  logarithmic?: boolean;
}

const axis = (text: string) => ({ label: text.replace(/, [^,]*$/, ""), unit: /, ([^,]*)$/.exec(text)?.[1] ?? "" });

export class Plot {
  readonly element: HTMLElement;
  private readonly box = el("div", { class: "chart", tabindex: 0, role: "img" });
  private readonly empty = el("p", { class: "faint" }, "nothing yet");
  private readonly names = el("div", {});
  private readonly reading = el("span", { class: "reading", "aria-live": "off" });
  private readonly drawn: Drawn;
  private shown = "";
  private cursor: number | undefined;
  private spots: Spot[] = [];
  private readonly later = withNextFrame(() => this.drawn.u?.redraw(false));

  constructor(private readonly settings: Settings) {
    const said = (marks: { head?: string; rows: { name: string; value: string }[] } | null) => {
      const values = marks?.rows.map(({ name, value }) => `${name} ${value}`.trim()).join(" · ");
      this.reading.textContent = marks ? [marks.head, values].filter(Boolean).join(": ") : "";
    };
    const spec = { title: settings.title, x: axis(settings.x), y: { ...axis(settings.y), log: Boolean(settings.logarithmic) } };
    this.drawn = new Drawn(uPlot, this.box, spec, { said, drawn: (u: uPlot) => this.marked(u) });
    this.drawn.near = true;
    this.box.append(this.empty);
    this.element = el("figure", { class: "plot" }, el("figcaption", {}, settings.title), this.box, this.reading, this.names);
    this.show([]);
    // A view that is left takes its plots out of the page: then uPlot lets go of the window.
    new ResizeObserver(() => (this.box.isConnected ? this.drawn.changed(false) : this.drawn.discard())).observe(this.box);
    const themed = () => {
      forgetInks();
      this.drawn.changed(false);
    };
    this.box.addEventListener("theme", themed, { capture: true });
  }

  /** Shows other curves, over a range of y of at least `span`. */
  show(curves: Curve[], span = 0): void {
    const filled = curves.filter((curve) => curve.x.length > 0);
    this.empty.hidden = filled.length > 0;
    this.drawn.least = span;
    this.drawn.set(filled.map(({ name, colour, x, y, dashed, dots }) => ({ name, ink: colour.slice(2), kind: dots ? "points" : "line", dash: dashed, x, y })));
    const names = filled.map((curve) => curve.name).join("\n");
    if (names !== this.shown) this.names.replaceChildren(...(filled.length > 1 ? [legend([this.drawn]) ?? ""] : []));
    this.shown = names;
    const ends = curves.map((curve) => `${curve.name}: ${short(curve.y.at(-1) ?? NaN)}`).join(", ");
    this.box.setAttribute("aria-label", `${this.settings.title}. Last values: ${ends || "none yet"}`);
  }

  /** Marks a value of x, or none. */
  mark(x: number | undefined): void {
    this.cursor = x;
    this.later();
  }

  /** Marks points, as the cursor does a value of x. */
  spot(spots: Spot[]): void {
    this.spots = spots;
    this.later();
  }

  /** Names the axes anew. */
  name(x: string, y: string): void {
    Object.assign(this.drawn.x, axis(x));
    Object.assign(this.drawn.y, axis(y));
    this.drawn.changed(false);
  }

  private marked({ ctx, bbox }: uPlot): void {
    const across = (x: number) => bbox.left + this.drawn.x.at(x) * bbox.width;
    ctx.fillStyle = ink("accent");
    if (this.cursor !== undefined) ctx.fillRect(across(this.cursor), bbox.top, devicePixelRatio, bbox.height);
    for (const { x, y, colour } of this.spots) {
      ctx.fillStyle = ink(colour.slice(2));
      ctx.beginPath();
      ctx.arc(across(x), bbox.top + (1 - this.drawn.y.at(y)) * bbox.height, 5 * devicePixelRatio, 0, 2 * Math.PI);
      ctx.fill();
    }
  }
}
