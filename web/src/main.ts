// The page: its tabs, its theme, and the view that the address names.

import { compile } from "./engine/engine";
import { library } from "./engine/library";
import * as address from "./ui/address";
import { byId, el } from "./ui/element";
import { themeButton } from "./ui/theme";
import "./style.css";
import { data } from "./views/data";
import { learn } from "./views/learn";
import { lesson } from "./views/lesson";
import { play } from "./views/play";

const ENTRIES = [play, learn, data, lesson];

/** Aborted when the view is left. */
let left = new AbortController();
let shown = "";

function show(): void {
  const { view: name, values } = address.read();
  const entry = ENTRIES.find((own) => own.name === name) ?? play;
  left.abort();
  left = new AbortController();
  const view = entry.open(values, left.signal);
  document.title = `${entry.title} · lagrangian laboratory`;
  const main = byId("main");
  main.replaceChildren(el("h2", { class: "hidden" }, entry.title), view);
  if (shown && shown !== entry.name) main.focus({ preventScroll: true });
  shown = entry.name;
  for (const tab of byId("tabs").querySelectorAll("a")) {
    if (tab.dataset["view"] === entry.name) tab.setAttribute("aria-current", "page");
    else tab.removeAttribute("aria-current");
  }
}

/** Keeps the page for times without a network. */
async function keep(): Promise<void> {
  if (!("serviceWorker" in navigator) || !location.protocol.startsWith("http")) return;
  await navigator.serviceWorker.register(`./sw.js?library=${library.name}`);
}

byId("tabs").append(...ENTRIES.map((entry) => el("a", { href: address.link(entry.name), "data-view": entry.name }, entry.title)));
themeButton(byId("theme"));
addEventListener("hashchange", show);
// A file that is dropped beside its place must not replace the page.
for (const kind of ["dragover", "drop"]) addEventListener(kind, (event) => event.preventDefault());
byId("main").replaceChildren();
show();
compile().then(
  () => {
    byId("engine").textContent = "The library is ready.";
    return keep().catch(() => undefined);
  },
  (error: unknown) => {
    byId("engine").textContent = `The library could not be loaded (${String(error)}): load the page again, with a browser of 2023 or later.`;
  },
);
