// The axis of a plot: its range and its ticks.

export interface Axis {
  low: number;
  high: number;
  logarithmic: boolean;
}

/** An axis over values, with a little space; one decade at least where it is logarithmic. */
export function axisOver(values: Iterable<number>, logarithmic: boolean): Axis {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (!Number.isFinite(value) || (logarithmic && value <= 0)) continue;
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return { low: logarithmic ? 0.1 : -1, high: 1, logarithmic };
  if (logarithmic) {
    const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
    return { low: 10 ** from, high: 10 ** Math.max(to, from + 1), logarithmic };
  }
  const space = 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
  return { low: low - space, high: high + space, logarithmic };
}

/** Where a value lies on the axis, 0…1. */
export function place(axis: Axis, value: number): number {
  if (!axis.logarithmic) return (value - axis.low) / (axis.high - axis.low);
  const [low, high] = [Math.log10(axis.low), Math.log10(axis.high)];
  return (Math.log10(Math.max(value, axis.low)) - low) / (high - low);
}

/** The value at a place, 0…1. */
export function valueAt(axis: Axis, share: number): number {
  if (!axis.logarithmic) return axis.low + share * (axis.high - axis.low);
  const [low, high] = [Math.log10(axis.low), Math.log10(axis.high)];
  return 10 ** (low + share * (high - low));
}

/** Round values at about so many places. */
export function ticks(axis: Axis, about: number): number[] {
  if (axis.logarithmic) {
    const [from, to] = [Math.log10(axis.low), Math.log10(axis.high)];
    const every = Math.max(1, Math.ceil((to - from) / about));
    const all = Array.from({ length: Math.floor(to - from + 1e-9) + 1 }, (_, k) => 10 ** (Math.round(from) + k));
    return all.filter((_, k) => k % every === 0);
  }
  const rough = (axis.high - axis.low) / about;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) ?? rough;
  const first = Math.ceil(axis.low / step);
  const count = Math.floor(axis.high / step) - first + 1;
  return Array.from({ length: Math.max(0, count) }, (_, k) => (first + k) * step);
}

/** A tick in words. */
export function tickText(value: number): string {
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e4 || size < 1e-2) return value.toExponential(0).replace("e+", "e").replace("-", "−");
  return String(Number(value.toPrecision(4))).replace("-", "−");
}
