// Dark and light: that of the system, until a person chooses.

import { el } from "./element";

type Theme = "light" | "dark";

const dark = matchMedia("(prefers-color-scheme: dark)");

/** The theme that is shown. */
export function theme(): Theme {
  const chosen = document.documentElement.dataset["theme"];
  if (chosen === "light" || chosen === "dark") return chosen;
  return dark.matches ? "dark" : "light";
}

/** A colour of the style sheet, such as `--truth`. */
export function colour(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Makes a button the switch of the theme; each canvas of the page, which holds colours of it, gets an event `theme`. */
export function themeButton(button: HTMLElement): void {
  const write = () => {
    const other = theme() === "dark" ? "light" : "dark";
    button.replaceChildren(el("span", { "aria-hidden": "true" }, other === "dark" ? "☾" : "☀"), ` ${other}`);
    button.setAttribute("aria-label", `Show the ${other} theme`);
    document.querySelectorAll("canvas").forEach((canvas) => canvas.dispatchEvent(new Event("theme")));
  };
  try {
    const kept = localStorage.getItem("theme");
    if (kept === "light" || kept === "dark") document.documentElement.dataset["theme"] = kept;
  } catch {
    // OK because the theme of the system serves where nothing can be kept.
  }
  button.addEventListener("click", () => {
    const next: Theme = theme() === "dark" ? "light" : "dark";
    document.documentElement.dataset["theme"] = next;
    try {
      localStorage.setItem("theme", next);
    } catch {
      // OK because the choice then holds for this visit.
    }
    write();
  });
  dark.addEventListener("change", write);
  write();
}
