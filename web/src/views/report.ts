// The page of a run, as the command writes it: shown over the laboratory, or saved.

import type { Engine } from "../engine/engine";
import { button } from "../ui/controls";
import { el } from "../ui/element";
import type { Message } from "../ui/message";
import { theme } from "../ui/theme";
import { offer } from "./race";

type Page = Uint8Array<ArrayBuffer>;

/** Two buttons for the page of the fit that the engine holds, which is made when it is asked for. */
export function reportButtons(engine: Engine, name: string, message: Message): HTMLButtonElement[] {
  let made: Promise<Page> | undefined;
  const use = (then: (page: Page) => void) => async (event: Event) => {
    const pressed = event.currentTarget as HTMLButtonElement;
    pressed.disabled = true;
    message.clear();
    try {
      made ??= engine.file({ ask: "report" });
      const page = await made;
      pressed.disabled = false;
      pressed.focus();
      then(page);
    } catch (error) {
      made = undefined;
      pressed.disabled = false;
      message.fail(error);
    }
  };
  const save = (page: Page) => offer(page, name);
  const both: [string, (page: Page) => void][] = [
    ["Open the report", (page) => open(page, () => save(page), message)],
    ["Save the report", save],
  ];
  return both.map(([text, then]) => el("button", { type: "button", click: (event) => void use(then)(event) }, text));
}

/** Shows a page over the laboratory. */
function open(page: Page, save: () => void, message: Message): void {
  const around = el("iframe", { src: "./report.html", title: "Report" });
  const close = button("Close", () => dialog.close(), "main");
  const dialog = el("dialog", { class: "report", "aria-label": "The report of the fit" }, el("div", { class: "row" }, button("Save the report", save), close), around);
  const loaded = () => {
    if (!fill(around, page)) dialog.close("failed");
  };
  around.addEventListener("load", loaded, { once: true });
  dialog.addEventListener("close", () => {
    dialog.remove();
    if (dialog.returnValue) message.fail(new Error("the report cannot be shown without a network: save it, and open the file"));
  });
  document.body.append(dialog);
  dialog.showModal();
  close.focus();
}

/**
 * Puts a page into the document of a frame, whose policy lets the scripts of the page run (that of the laboratory would not). The page
 * has an origin of its own there: it reaches neither this page nor what it keeps.
 */
function fill(around: HTMLIFrameElement, page: Page): boolean {
  const inside = around.contentDocument;
  if (!inside?.querySelector("style")) return false;
  const own = inside.createElement("iframe");
  own.setAttribute("sandbox", "allow-scripts");
  own.title = "The report of the fit";
  own.srcdoc = new TextDecoder().decode(page).replace("<html ", `<html data-theme="${theme()}" `);
  inside.body.append(own);
  return true;
}
