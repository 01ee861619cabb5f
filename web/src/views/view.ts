// What a view is.

import type { Values } from "../ui/address";

/** A view that can be opened. */
export interface Entry {
  name: string;
  title: string;
  /** Opens it with the values of the address. What it runs outside of its element ends when `left` is aborted. */
  open(values: Values, left: AbortSignal): HTMLElement;
}
