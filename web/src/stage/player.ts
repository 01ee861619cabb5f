// Time: a motion that was computed is shown at the speed at which it happens.

import type { Motion } from "../engine/answers";
import type { State } from "./scenes";

/** The state of a motion at a time, between its samples. */
export function stateAt(motion: Motion, t: number): State {
  const n = motion.coordinates.length;
  const last = motion.t.length - 1;
  const step = last > 0 ? (motion.t[1] ?? 1) - (motion.t[0] ?? 0) : 1;
  const at = Math.max(0, Math.min(last, (t - (motion.t[0] ?? 0)) / step));
  const k = Math.min(Math.floor(at), Math.max(0, last - 1));
  const part = at - k;
  const between = (values: number[]) =>
    Array.from({ length: n }, (_, i) => {
      const from = values[k * n + i] ?? 0;
      return from + part * ((values[(k + 1) * n + i] ?? from) - from);
    });
  return { q: between(motion.q), qd: between(motion.qd) };
}

/** Column i of the rows of a motion. */
export function column(values: number[], i: number, n: number): number[] {
  return Array.from({ length: Math.floor(values.length / n) }, (_, k) => values[k * n + i] ?? NaN);
}

/** Angles between −π and π, with a gap where they turn over. */
export function wrapped(angles: number[]): number[] {
  const turn = (x: number) => Math.round(x / (2 * Math.PI));
  return angles.map((x, k) => {
    const before = angles[k - 1];
    return before !== undefined && turn(before) !== turn(x) ? NaN : x - 2 * Math.PI * turn(x);
  });
}

/** A clock that calls for each frame while it runs, until `left` is aborted. */
export class Player {
  private frame: number | undefined;
  private last = 0;
  private t = 0;

  constructor(
    private readonly shown: (t: number) => void,
    private readonly left: AbortSignal,
  ) {
    left.addEventListener("abort", () => this.pause());
  }

  get isRunning(): boolean {
    return this.frame !== undefined;
  }

  get time(): number {
    return this.t;
  }

  /** Shows this time, and goes on from it if it runs. */
  seek(t: number): void {
    this.t = t;
    this.shown(t);
  }

  run(): void {
    if (this.frame !== undefined || this.left.aborted) return;
    this.last = performance.now();
    this.frame = requestAnimationFrame((now) => this.step(now));
  }

  pause(): void {
    if (this.frame !== undefined) cancelAnimationFrame(this.frame);
    this.frame = undefined;
  }

  private step(now: number): void {
    // A tab that was hidden continues where it was.
    this.t += Math.min(0.1, Math.max(0, (now - this.last) / 1e3));
    this.last = now;
    this.frame = requestAnimationFrame((next) => this.step(next));
    this.shown(this.t);
  }
}
