// Runs the library beside the page, so that the page never waits.

import { Ended, Library } from "./module";
import type { FromWorker, ToWorker } from "./messages";

// Requests may come before the module has begun; they wait for it, in their order.
let library: Promise<Library> | undefined;

self.onmessage = (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if ("module" in message) library = Library.of(message.module);
  else void serve(message.id, message.request, message.file);
};

async function serve(id: number, request: object, file?: Uint8Array): Promise<void> {
  try {
    const { value, bytes } = (await begun()).answer(request, file);
    send({ id, value, bytes }, [bytes.buffer]);
  } catch (error) {
    const ended = error instanceof Ended;
    const words = error instanceof Error ? error.message : String(error);
    send({ id, error: words, ended }, []);
  }
}

async function begun(): Promise<Library> {
  try {
    if (library) return await library;
  } catch (error) {
    throw new Ended(String(error));
  }
  throw new Ended("the library was not loaded");
}

function send(message: FromWorker, moved: Transferable[]): void {
  self.postMessage(message, { transfer: moved });
}
