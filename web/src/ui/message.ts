// What the page says when something went wrong, or right.

import { Cancelled } from "../engine/engine";
import { el } from "./element";

/** A place for messages. */
export class Message {
  readonly element = el("p", { class: "message", role: "status", hidden: true });

  say(text: string): void {
    this.write(text, "");
  }

  /** Says what an error is; one that the page itself caused by stopping is none. */
  fail(error: unknown): void {
    if (error instanceof Cancelled) return;
    this.write(sentence(error instanceof Error ? error.message : String(error)), "bad");
    this.element.scrollIntoView({ block: "nearest" });
  }

  clear(): void {
    this.element.hidden = true;
    this.element.textContent = "";
  }

  private write(text: string, kind: string): void {
    this.element.hidden = false;
    this.element.className = `message ${kind}`;
    this.element.textContent = text;
  }
}

/** A sentence of a message of the library; a name such as `q1` at its beginning stays as it is. */
export function sentence(text: string): string {
  const plain = text.replaceAll("`", "");
  const start = /^[a-z]+['’-]?[a-z]*(?![\w=:])/.test(plain) ? plain.charAt(0).toUpperCase() + plain.slice(1) : plain;
  return /[.!?]$/.test(start) ? start : `${start}.`;
}
