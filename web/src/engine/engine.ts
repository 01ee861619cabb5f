// A library in a worker, as promises. A worker that ends, or that is stopped, is replaced by a fresh one.

import type { Answer } from "./module";
import type { FromWorker, ToWorker } from "./messages";
import { library } from "./library";

let compiled: Promise<WebAssembly.Module> | undefined;

/** The module, compiled once for all workers. */
export function compile(): Promise<WebAssembly.Module> {
  compiled ??= fetch(library.url).then(async (response) => {
    if (!response.ok) throw new Error(`the library could not be loaded (${response.status}): load the page again`);
    const typed = response.headers.get("content-type")?.startsWith("application/wasm");
    return typed ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
  });
  return compiled;
}

/** The request was given up by the page. */
export class Cancelled extends Error {
  constructor() {
    super("cancelled");
  }
}

interface Waiting {
  resolve(answer: Answer): void;
  reject(error: Error): void;
}

/** One worker with its library, until `left` is aborted. */
export class Engine {
  private worker: Promise<Worker> | undefined;
  private waiting = new Map<number, Waiting>();
  private next = 0;
  private generation = 0;

  constructor(private readonly left: AbortSignal) {
    left.addEventListener("abort", () => this.stop());
  }

  /** Asks, and expects an answer of type T. */
  async ask<T>(request: object, file?: Uint8Array): Promise<T> {
    return (await this.answer(request, file)).value as T;
  }

  /** Asks for the bytes of a file. */
  async file(request: object): Promise<Uint8Array<ArrayBuffer>> {
    return (await this.answer(request)).bytes;
  }

  /** Ends what is computed at once; the next request begins afresh. */
  stop(): void {
    this.end(new Cancelled());
  }

  private async answer(request: object, file?: Uint8Array): Promise<Answer> {
    if (this.left.aborted) throw new Cancelled();
    this.worker ??= this.start();
    const generation = this.generation;
    const worker = await this.worker;
    if (generation !== this.generation) throw new Cancelled();
    const id = this.next++;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      worker.postMessage({ id, request, file } satisfies ToWorker);
    });
  }

  private async start(): Promise<Worker> {
    const module = await compile();
    const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    worker.onmessage = (event: MessageEvent<FromWorker>) => this.receive(event.data);
    worker.onerror = () => this.end(new Error("the worker of the library could not be started: load the page again"));
    worker.postMessage({ module } satisfies ToWorker);
    return worker;
  }

  private receive(message: FromWorker): void {
    if ("ended" in message && message.ended) {
      this.end(new Error(`the library ended itself (${message.error}); it was started again, please take a smaller problem`));
      return;
    }
    const waiting = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if ("error" in message) waiting?.reject(new Error(message.error));
    else waiting?.resolve(message);
  }

  /** Ends the worker and refuses what it was asked; the next request starts a fresh one. */
  private end(error: Error): void {
    // OK because a worker that could not be started needs no end.
    this.worker?.then((own) => own.terminate(), () => undefined);
    this.worker = undefined;
    this.generation += 1;
    const all = [...this.waiting.values()];
    this.waiting.clear();
    all.forEach((one) => one.reject(error));
  }
}
