// The stage: bodies on a canvas, which can be dragged.

import { el } from "../ui/element";
import { withNextFrame } from "../ui/frame";
import { onTheme } from "../ui/theme";
import { Pen, type Point } from "./pen";
import type { Scene, State } from "./scenes";

/** A body on the stage, in a colour of the style sheet. */
export interface Body {
  state: State;
  colour: string;
  /** Where it has been. */
  trail?: Point[];
}

/** Pixels from a handle at which it is still taken. */
const NEAR = 44;

export interface Dragging {
  /** The state while it is dragged. */
  moved(state: State): void;
  /** It was released. */
  released(state: State): void;
}

export class Stage {
  readonly canvas = el("canvas", { class: "stage", role: "img" });
  private bodies: Body[] = [];
  private held: number | undefined;
  private readonly later = withNextFrame(() => this.draw());

  constructor(
    private scene: Scene,
    private readonly dragging?: Dragging,
  ) {
    this.use(scene);
    if (dragging) {
      this.canvas.classList.add("draggable");
      this.canvas.addEventListener("pointerdown", (event) => this.take(event));
      this.canvas.addEventListener("pointermove", (event) => this.move(event));
      this.canvas.addEventListener("pointerup", () => this.release());
      this.canvas.addEventListener("pointercancel", () => this.release());
    }
    new ResizeObserver(() => this.later()).observe(this.canvas);
    onTheme(() => this.later());
  }

  /** Whether a body is held. */
  get isHeld(): boolean {
    return this.held !== undefined;
  }

  use(scene: Scene): void {
    this.scene = scene;
    this.bodies = [];
    const how = this.dragging ? " Drag it, or use the sliders of its state." : "";
    this.canvas.setAttribute("aria-label", `${scene.title} in motion.${how}`);
    this.later();
  }

  /** Shows these bodies; the last one can be dragged. */
  show(bodies: Body[]): void {
    this.bodies = bodies;
    this.later();
  }

  private pen(): Pen | undefined {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const context = this.canvas.getContext("2d");
    return context && width > 0 ? new Pen(context, width, height, this.scene.reach) : undefined;
  }

  private draw(): void {
    const pen = this.pen();
    if (!pen) return;
    const scale = devicePixelRatio || 1;
    this.canvas.width = Math.round(pen.width * scale);
    this.canvas.height = Math.round(pen.height * scale);
    pen.context.scale(scale, scale);
    for (const body of this.bodies) {
      if (body.trail && body.trail.length > 1) pen.use(body.colour, 0.3).line(body.trail, 1.5);
      pen.use(body.colour);
      this.scene.draw(pen, body.state, body.colour);
    }
  }

  private take(event: PointerEvent): void {
    const [pen, state] = [this.pen(), this.bodies.at(-1)?.state];
    if (!pen || !state) return;
    const distance = (handle: Point) => {
      const [x, y] = pen.pixel(handle);
      return Math.hypot(x - event.offsetX, y - event.offsetY);
    };
    const distances = this.scene.handles(state).map(distance);
    const nearest = distances.indexOf(Math.min(...distances));
    if ((distances[nearest] ?? Infinity) > NEAR) return;
    this.held = nearest;
    this.canvas.setPointerCapture(event.pointerId);
    event.preventDefault();
    this.move(event);
  }

  private move(event: PointerEvent): void {
    const [pen, state] = [this.pen(), this.bodies.at(-1)?.state];
    if (this.held === undefined || !pen || !state) return;
    this.dragging?.moved(this.scene.drag(state, this.held, pen.point(event.offsetX, event.offsetY)));
  }

  private release(): void {
    const state = this.bodies.at(-1)?.state;
    if (this.held === undefined || !state) return;
    this.held = undefined;
    this.dragging?.released(state);
  }
}
