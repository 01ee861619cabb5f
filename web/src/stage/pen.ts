// Drawing in metres, y upwards, the origin in the middle.

import { colour } from "../ui/theme";

export interface Point {
  x: number;
  y: number;
}

export class Pen {
  readonly scale: number;
  private ink = "";

  constructor(
    readonly context: CanvasRenderingContext2D,
    readonly width: number,
    readonly height: number,
    /** Metres from the middle to the nearest edge. */
    readonly reach: number,
  ) {
    this.scale = Math.min(width, height) / 2 / reach;
  }

  /** Draws with a colour of the style sheet from now on. */
  use(name: string, opacity = 1): this {
    this.ink = colour(name);
    this.context.globalAlpha = opacity;
    return this;
  }

  line(points: Point[], thickness = 2, dashed = false): this {
    this.context.strokeStyle = this.ink;
    this.context.lineWidth = thickness;
    this.context.lineCap = this.context.lineJoin = "round";
    this.context.setLineDash(dashed ? [4, 5] : []);
    this.context.beginPath();
    for (const point of points) this.context.lineTo(...this.pixel(point));
    this.context.stroke();
    this.context.setLineDash([]);
    return this;
  }

  /** A disc of so many pixels. */
  disc(centre: Point, radius: number): this {
    this.context.fillStyle = this.ink;
    this.context.beginPath();
    this.context.arc(...this.pixel(centre), radius, 0, 2 * Math.PI);
    this.context.fill();
    return this;
  }

  /** A box around a point, half its size in pixels. */
  box(centre: Point, halfWidth: number, halfHeight: number): this {
    const [x, y] = this.pixel(centre);
    this.context.fillStyle = this.ink;
    this.context.beginPath();
    this.context.roundRect(x - halfWidth, y - halfHeight, 2 * halfWidth, 2 * halfHeight, 5);
    this.context.fill();
    return this;
  }

  arrow(from: Point, to: Point): this {
    const [a, b] = [this.pixel(from), this.pixel(to)];
    const angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
    this.line([from, to], 2);
    this.context.fillStyle = this.ink;
    this.context.beginPath();
    this.context.moveTo(...b);
    for (const turn of [2.7, -2.7]) {
      this.context.lineTo(b[0] + 11 * Math.cos(angle + turn), b[1] + 11 * Math.sin(angle + turn));
    }
    this.context.fill();
    return this;
  }

  pixel(point: Point): [number, number] {
    return [this.width / 2 + point.x * this.scale, this.height / 2 - point.y * this.scale];
  }

  /** The point at a pixel. */
  point(x: number, y: number): Point {
    return { x: (x - this.width / 2) / this.scale, y: (this.height / 2 - y) / this.scale };
  }
}
