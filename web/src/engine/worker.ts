// Runs the library beside the page, so that the page never waits.

import { Ended, Library } from "./module";
import type { FromWorker, ToWorker } from "./messages";

let library: Library | undefined;

self.onmessage = async (event: MessageEvent<ToWorker>) => {
  const message = event.data;
  if ("module" in message) {
    library = await Library.of(message.module);
    return;
  }
  post(message.id, () => {
    if (!library) throw new Ended("the library was not loaded");
    return library.answer(message.request, message.file);
  });
};

function post(id: number, compute: () => { value: unknown; bytes: Uint8Array<ArrayBuffer> }): void {
  try {
    const { value, bytes } = compute();
    send({ id, value, bytes }, [bytes.buffer]);
  } catch (error) {
    const ended = error instanceof Ended;
    const words = error instanceof Error ? error.message : String(error);
    send({ id, error: words, ended }, []);
  }
}

function send(message: FromWorker, moved: Transferable[]): void {
  self.postMessage(message, { transfer: moved });
}
