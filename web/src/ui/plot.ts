// A plot on a canvas: curves, a legend that hides them, values under the pointer, a cursor in time.

import { short } from "./controls";
import { el } from "./element";
import { sheet } from "./sheet";
import { withNextFrame } from "./frame";
import { colour } from "./theme";
import { type Axis, axisOver, place, ticks, tickText, valueAt } from "./axes";

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
  /** What the axes show, with their units. */
  x: string;
  y: string;
  logarithmic?: boolean;
  /** Whether both axes have one scale. */
  equal?: boolean;
}

const LEFT = 62;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 36;

export class Plot {
  readonly element: HTMLElement;
  private readonly canvas = el("canvas", { tabindex: 0, role: "img" });
  private readonly legend = el("div", { class: "legend" });
  private readonly reading = el("span", { class: "reading", "aria-live": "off" });
  private curves: Curve[] = [];
  private hidden = new Set<string>();
  private cursor: number | undefined;
  private spots: Spot[] = [];
  private pointer: number | undefined;
  private axes: { x: Axis; y: Axis } | undefined;
  private readonly later = withNextFrame(() => this.draw());
  private span = 0;
  /** What does not change with the cursor, painted once. */
  private readonly painted = el("canvas");
  private stale = true;

  constructor(private readonly settings: Settings) {
    this.element = el("figure", { class: "plot" }, el("figcaption", {}, settings.title), this.canvas, this.reading, this.legend);
    this.show([]);
    this.canvas.addEventListener("pointerdown", (event) => this.point(event.offsetX));
    this.canvas.addEventListener("pointermove", (event) => this.point(event.offsetX));
    // What a finger has read stays when it is lifted.
    this.canvas.addEventListener("pointerleave", (event) => event.pointerType !== "touch" && this.point(undefined));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.repaint()).observe(this.canvas);
    this.canvas.addEventListener("theme", () => this.repaint());
  }

  private repaint(): void {
    this.stale = true;
    this.later();
  }

  /** Shows other curves, over a range of y of at least `span`. */
  show(curves: Curve[], span = 0): void {
    this.span = span;
    const names = (all: Curve[]) => all.map((curve) => curve.name).join("\n");
    const same = names(curves) === names(this.curves);
    this.curves = curves;
    if (!same) this.writeLegend();
    const ends = curves.map((curve) => `${curve.name}: ${short(curve.y.at(-1) ?? NaN)}`).join(", ");
    this.canvas.setAttribute("aria-label", `${this.settings.title}. Last values: ${ends || "none yet"}`);
    this.repaint();
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
    Object.assign(this.settings, { x, y });
    this.repaint();
  }

  private writeLegend(): void {
    const entry = (curve: Curve) => {
      const kind = curve.dashed ? " dashed" : "";
      const swatch = el("span", { class: `swatch ${curve.colour.slice(2)}${kind}`, "aria-hidden": "true" });
      const press = () => {
        if (!this.hidden.delete(curve.name)) this.hidden.add(curve.name);
        item.setAttribute("aria-pressed", String(!this.hidden.has(curve.name)));
        this.repaint();
      };
      const item = el("button", { type: "button", "aria-pressed": "true", click: press }, swatch, curve.name);
      return item;
    };
    this.hidden.clear();
    this.legend.replaceChildren(...(this.curves.length > 1 ? this.curves.map(entry) : []));
  }

  private point(x: number | undefined): void {
    this.pointer = x;
    this.later();
  }

  private key(event: KeyboardEvent): void {
    const width = this.canvas.clientWidth;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === "Escape") this.point(undefined);
    if (!step) return;
    event.preventDefault();
    const from = this.pointer ?? (step > 0 ? LEFT : width - RIGHT);
    this.point(Math.min(width - RIGHT, Math.max(LEFT, from + step * 8)));
  }

  private draw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    const shown = this.curves.filter((curve) => !this.hidden.has(curve.name));
    if (this.stale) this.paint(shown, width, height);
    this.stale = false;
    const context = sheet(this.canvas, width, height);
    context?.drawImage(this.painted, 0, 0, width, height);
    if (context && this.axes) this.lines(context, shown, height);
  }

  private paint(shown: Curve[], width: number, height: number): void {
    const context = sheet(this.painted, width, height);
    this.axes = undefined;
    if (!context) return;
    if (shown.every((curve) => curve.x.length === 0)) {
      context.fillStyle = colour("--faint");
      context.font = "14px system-ui, sans-serif";
      context.textAlign = "center";
      context.fillText("nothing yet", width / 2, height / 2);
      return;
    }
    this.axes = this.fitted(shown, width, height);
    this.grid(context, width, height);
    context.save();
    context.beginPath();
    context.rect(LEFT, TOP, width - LEFT - RIGHT, height - TOP - BOTTOM);
    context.clip();
    shown.forEach((curve) => this.curve(context, curve));
    context.restore();
  }

  private fitted(shown: Curve[], width: number, height: number): { x: Axis; y: Axis } {
    const x = axisOver(shown.flatMap((curve) => extremes(curve.x)), false);
    const ys = shown.flatMap((curve) => (this.settings.logarithmic ? curve.y : extremes(curve.y)));
    const y = axisOver(ys, Boolean(this.settings.logarithmic));
    widen(y, this.span);
    if (this.settings.equal) equalise(x, y, (width - LEFT - RIGHT) / (height - TOP - BOTTOM));
    return { x, y };
  }

  private at(x: number, y: number): [number, number] {
    const [width, height] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const axes = this.axes as { x: Axis; y: Axis };
    const across = LEFT + place(axes.x, x) * (width - LEFT - RIGHT);
    return [across, TOP + (1 - place(axes.y, y)) * (height - TOP - BOTTOM)];
  }

  private grid(context: CanvasRenderingContext2D, width: number, height: number): void {
    const axes = this.axes as { x: Axis; y: Axis };
    context.strokeStyle = colour("--grid");
    context.fillStyle = colour("--faint");
    context.font = "12px system-ui, sans-serif";
    context.lineWidth = 1;
    context.beginPath();
    context.textAlign = "center";
    for (const value of ticks(axes.x, width / 90)) {
      const [x] = this.at(value, axes.y.low);
      context.moveTo(x, TOP);
      context.lineTo(x, height - BOTTOM);
      context.fillText(tickText(value), x, height - BOTTOM + 15);
    }
    context.textAlign = "right";
    for (const value of ticks(axes.y, height / 45)) {
      const [, y] = this.at(axes.x.low, value);
      context.moveTo(LEFT, y);
      context.lineTo(width - RIGHT, y);
      context.fillText(tickText(value), LEFT - 6, y + 4);
    }
    context.stroke();
    context.textAlign = "center";
    context.fillText(this.settings.x, LEFT + (width - LEFT - RIGHT) / 2, height - 5);
    context.save();
    context.translate(11, TOP + (height - TOP - BOTTOM) / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(this.settings.y, 0, 0);
    context.restore();
  }

  private curve(context: CanvasRenderingContext2D, curve: Curve): void {
    context.strokeStyle = context.fillStyle = colour(curve.colour);
    context.lineWidth = 1.8;
    context.lineJoin = "round";
    context.setLineDash(curve.dashed ? [6, 4] : []);
    context.beginPath();
    let pen = false;
    for (let k = 0; k < curve.x.length; k++) {
      const [x, y] = this.at(curve.x[k] ?? NaN, curve.y[k] ?? NaN);
      const fine = Number.isFinite(x) && Number.isFinite(y);
      if (fine && curve.dots) context.rect(x - 1, y - 1, 2, 2);
      else if (fine && pen) context.lineTo(x, Math.max(-1e4, Math.min(1e4, y)));
      else if (fine) context.moveTo(x, Math.max(-1e4, Math.min(1e4, y)));
      pen = fine;
    }
    if (curve.dots) context.fill();
    else context.stroke();
    context.setLineDash([]);
  }

  /** The cursor in time, and the values under the pointer. */
  private lines(context: CanvasRenderingContext2D, shown: Curve[], height: number): void {
    const axes = this.axes as { x: Axis; y: Axis };
    const vertical = (x: number, name: string) => {
      context.strokeStyle = colour(name);
      context.lineWidth = 1;
      context.beginPath();
      context.moveTo(x, TOP);
      context.lineTo(x, height - BOTTOM);
      context.stroke();
    };
    if (this.cursor !== undefined) vertical(this.at(this.cursor, axes.y.low)[0], "--accent");
    for (const spot of this.spots) {
      context.fillStyle = colour(spot.colour);
      context.beginPath();
      context.arc(...this.at(spot.x, spot.y), 5, 0, 2 * Math.PI);
      context.fill();
    }
    if (this.pointer === undefined || shown.length === 0) {
      this.reading.textContent = "";
      return;
    }
    const width = this.canvas.clientWidth - LEFT - RIGHT;
    const x = valueAt(axes.x, (this.pointer - LEFT) / width);
    vertical(this.pointer, "--faint");
    const values = shown.map((curve) => `${curve.name} ${short(curve.y[nearest(curve.x, x)] ?? NaN)}`);
    this.reading.textContent = `${this.settings.x.split(",")[0]} ${short(x)}: ${values.join(" · ")}`;
  }
}

function extremes(values: number[]): number[] {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

function widen(axis: Axis, span: number): void {
  const more = span - (axis.high - axis.low);
  if (more > 0) [axis.low, axis.high] = [axis.low - more / 2, axis.high + more / 2];
}

function equalise(x: Axis, y: Axis, aspect: number): void {
  const [across, up] = [x.high - x.low, y.high - y.low];
  const more = up * aspect - across;
  if (more > 0) [x.low, x.high] = [x.low - more / 2, x.high + more / 2];
  else [y.low, y.high] = [y.low + more / aspect / 2, y.high - more / aspect / 2];
}

function nearest(values: number[], x: number): number {
  let best = 0;
  for (let k = 1; k < values.length; k++) {
    if (Math.abs((values[k] ?? NaN) - x) < Math.abs((values[best] ?? NaN) - x)) best = k;
  }
  return best;
}
