// The state of a view in the address, so that a link shows the same.

export type Values = Record<string, string>;

/** The view and the values that the address names. */
export function read(): { view: string; values: Values } {
  const [view = "", query = ""] = location.hash.slice(1).split("?");
  return { view, values: Object.fromEntries(new URLSearchParams(query)) };
}

/** The address of a view with these values. */
export function link(view: string, values: Values = {}): string {
  const query = new URLSearchParams(values).toString().replaceAll("%2C", ",");
  return query ? `#${view}?${query}` : `#${view}`;
}

/** Writes the state without a new entry in the history. */
export function write(view: string, values: Values): void {
  history.replaceState(null, "", link(view, values));
}

/** A number of the address within its bounds, or another. */
export function number(text: string | undefined, otherwise: number, min: number, max: number): number {
  const value = Number(text);
  if (text === undefined || text === "" || !Number.isFinite(value)) return otherwise;
  return Math.min(max, Math.max(min, value));
}

/** As many numbers as expected, or others. */
export function numbers(text: string | undefined, otherwise: number[]): number[] {
  const values = (text ?? "").split(",").map(Number);
  const fine = text && values.length === otherwise.length && values.every(Number.isFinite);
  return fine ? values : otherwise;
}
