// What the page and a worker say to each other.

export type ToWorker = { module: WebAssembly.Module } | { id: number; request: object; file?: Uint8Array };

export type FromWorker =
  | { id: number; value: unknown; bytes: Uint8Array<ArrayBuffer> }
  | { id: number; error: string; ended: boolean };
