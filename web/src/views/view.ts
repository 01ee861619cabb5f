// What a view is.

import type { Values } from "../ui/address";

/** A view at work. */
export interface View {
  element: HTMLElement;
  /** Ends what it computes and shows. */
  close(): void;
}

/** A view that can be opened with the values of the address. */
export interface Entry {
  name: string;
  title: string;
  open(values: Values): View;
}
