// The stage: bodies on a canvas, which can be dragged.

import { el } from "../ui/element";
import { withNextFrame } from "../ui/frame";
import { sheet } from "../ui/sheet";
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
      // A finger that takes a handle drags it; one beside it scrolls the page.
      this.canvas.addEventListener("touchstart", (event) => this.touch(event), { passive: false });
    }
    new ResizeObserver(() => this.later()).observe(this.canvas);
    this.canvas.addEventListener("theme", () => this.later());
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
    sheet(this.canvas, pen.width, pen.height);
    for (const body of this.bodies) {
      if (body.trail && body.trail.length > 1) pen.use(body.colour, 0.3).line(body.trail, 1.5);
      pen.use(body.colour);
      this.scene.draw(pen, body.state, body.colour);
    }
  }

  /** The handle at a place of the canvas, if there is one. */
  private handleAt(x: number, y: number): number | undefined {
    const [pen, state] = [this.pen(), this.bodies.at(-1)?.state];
    if (!pen || !state) return undefined;
    const distance = (handle: Point) => {
      const [across, down] = pen.pixel(handle);
      return Math.hypot(across - x, down - y);
    };
    const distances = this.scene.handles(state).map(distance);
    const nearest = distances.indexOf(Math.min(...distances));
    return (distances[nearest] ?? Infinity) > NEAR ? undefined : nearest;
  }

  private touch(event: TouchEvent): void {
    const edge = this.canvas.getBoundingClientRect();
    const [finger] = event.touches;
    if (finger && this.handleAt(finger.clientX - edge.left, finger.clientY - edge.top) !== undefined) event.preventDefault();
  }

  private take(event: PointerEvent): void {
    const handle = this.handleAt(event.offsetX, event.offsetY);
    if (handle === undefined) return;
    this.held = handle;
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
