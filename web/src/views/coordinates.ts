// Coordinates in words.

import type { Axis } from "../engine/answers";

/** The name of a column without its unit: values are shown in SI units, whatever the file has. */
export function bare(name: string): string {
  return name.replace(/\s*[([].*$/, "") || name;
}

/** A quantity with the units of coordinates, where they have some: "velocity, rad/s or m/s". */
export function labelled(quantity: string, axes: Axis[], rate = ""): string {
  const units = new Set(axes.map((axis) => axis.unit).filter(Boolean));
  return units.size > 0 ? `${quantity}, ${[...units].map((unit) => unit + rate).join(" or ")}` : quantity;
}
