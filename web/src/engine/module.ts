// The WebAssembly module of the library: messages in, answers out (crates/lagrangian-web/src/exports.rs).

/** What the module exports. */
interface Exports extends WebAssembly.Exports {
  memory: WebAssembly.Memory;
  lagrangian_begin(): void;
  lagrangian_input(length: number): number;
  lagrangian_answer(): number;
  lagrangian_output(): number;
  lagrangian_failure(): number;
  lagrangian_failure_length(): number;
}

/** An answer: its JSON, and the bytes of a file where there is one. */
export interface Answer {
  value: unknown;
  bytes: Uint8Array<ArrayBuffer>;
}

/** The library refused a request; the message says what to do. */
export class Refused extends Error {}

/** The module ended itself: nothing that it held is left. */
export class Ended extends Error {}

/** One instance of the library. */
export class Library {
  private constructor(private readonly exports: Exports) {
    exports.lagrangian_begin();
  }

  static async of(module: WebAssembly.Module): Promise<Library> {
    const page = { now: () => performance.now() };
    const instance = await WebAssembly.instantiate(module, { page });
    return new Library(instance.exports as Exports);
  }

  /** Serves one request. */
  answer(request: object, file: Uint8Array = new Uint8Array()): Answer {
    const text = new TextEncoder().encode(JSON.stringify(request));
    const length = this.call(text, file);
    const start = this.exports.lagrangian_output();
    const memory = this.exports.memory.buffer;
    const textLength = new DataView(memory).getUint32(start, true);
    const end = start + 4 + textLength;
    const json = JSON.parse(new TextDecoder().decode(new Uint8Array(memory, start + 4, textLength)));
    if (typeof json.error === "string") throw new Refused(json.error);
    return { value: json.ok, bytes: new Uint8Array(memory.slice(end, start + length) as ArrayBuffer) };
  }

  /** Writes the message and runs the module. */
  private call(text: Uint8Array, file: Uint8Array): number {
    try {
      const at = this.exports.lagrangian_input(4 + text.length + file.length);
      const bytes = new Uint8Array(this.exports.memory.buffer);
      new DataView(this.exports.memory.buffer).setUint32(at, text.length, true);
      bytes.set(text, at + 4);
      bytes.set(file, at + 4 + text.length);
      return this.exports.lagrangian_answer();
    } catch (trap) {
      throw new Ended(this.lastWords() || String(trap));
    }
  }

  private lastWords(): string {
    const start = this.exports.lagrangian_failure();
    const length = this.exports.lagrangian_failure_length();
    return new TextDecoder().decode(new Uint8Array(this.exports.memory.buffer, start, length));
  }
}
