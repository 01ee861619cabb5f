// Controls, each with its label; all of them work by keyboard.

import { el, unique } from "./element";

export interface Range {
  label: string;
  unit?: string;
  min: number;
  max: number;
  step: number;
  value: number;
  /** Steps of equal factors and not of equal differences. */
  logarithmic?: boolean;
  changed(value: number): void;
}

export interface Slider {
  element: HTMLElement;
  /** Shows another value without telling anyone. */
  show(value: number): void;
}

/** A slider with its value beside it. */
export function slider(range: Range): Slider {
  const id = unique("slider");
  const to = range.logarithmic ? Math.log : (x: number) => x;
  const back = range.logarithmic ? Math.exp : (x: number) => x;
  const input = el("input", {
    id,
    type: "range",
    min: to(range.min),
    max: to(range.max),
    step: range.logarithmic ? (to(range.max) - to(range.min)) / 100 : range.step,
  });
  const output = el("output", { for: id });
  const rounded = () => Math.round(back(Number(input.value)) / range.step) * range.step;
  const write = (value: number) => {
    const unit = range.unit ? ` ${range.unit}` : "";
    output.textContent = short(value) + unit;
    input.setAttribute("aria-valuetext", short(value) + unit);
  };
  input.value = String(to(range.value));
  write(range.value);
  input.addEventListener("input", () => {
    write(rounded());
    range.changed(rounded());
  });
  const element = el("div", { class: "slider" }, el("label", { for: id }, range.label), output, input);
  const show = (value: number) => {
    input.value = String(to(value));
    write(value);
  };
  return { element, show };
}

/** A switch with its label. */
export function toggle(label: string, on: boolean, changed: (on: boolean) => void): HTMLElement {
  const id = unique("toggle");
  const input = el("input", { id, type: "checkbox" });
  input.checked = on;
  input.addEventListener("change", () => changed(input.checked));
  return el("div", { class: "toggle" }, input, el("label", { for: id }, label));
}

/** A choice of one of several. */
export function select(
  label: string,
  options: [value: string, text: string][],
  value: string,
  changed: (value: string) => void,
): HTMLElement {
  const id = unique("select");
  const input = el("select", { id }, ...options.map(([own, text]) => el("option", { value: own }, text)));
  input.value = value;
  input.addEventListener("change", () => changed(input.value));
  return el("div", { class: "field" }, el("label", { for: id }, label), input);
}

/** A button. */
export function button(text: string, pressed: () => void, kind = ""): HTMLButtonElement {
  return el("button", { type: "button", class: kind, click: pressed }, text);
}

/** A number as people read it: three digits, exponents where they are shorter. */
export function short(value: number): string {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size === 0) return "0";
  if (size >= 1e5 || size < 1e-3) return value.toExponential(1).replace("-", "−").replace("e+", "e");
  return String(Number(value.toPrecision(3))).replace("-", "−");
}
