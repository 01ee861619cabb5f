// Which columns of a table mean what: proposed by the library, decided by a person.

import type { Inspected } from "../engine/answers";
import { select, toggle } from "../ui/controls";
import { el } from "../ui/element";

/** The columns as the library is told. */
export interface Columns {
  t: string;
  q: string[];
  angles: string[];
  degrees: boolean;
  trajectory?: string;
}

const ANGULAR = /angle|theta|θ|phi|φ|\brad\b|°|\bdeg/i;

/** A form for the columns of a file; calls for each change. */
export function columnsForm(file: Inspected, changed: (columns: Columns) => void): HTMLElement {
  const time = file.time ?? file.headers[0] ?? "";
  const motions = file.headers.find((header) => header.toLowerCase() === "trajectory");
  const columns: Columns = { t: time, q: [...file.coordinates], angles: file.coordinates.filter((name) => ANGULAR.test(name)), degrees: file.degrees };
  if (motions) columns.trajectory = motions;
  const options = file.headers.map((header): [string, string] => [header, header]);
  const rows = el("tbody");
  const tell = () => changed({ ...columns });
  const write = () => rows.replaceChildren(...file.headers.filter((h) => h !== columns.t && h !== columns.trajectory).map(row));
  const put = (list: "q" | "angles", name: string, on: boolean) => {
    const chosen = new Set(columns[list]);
    if (on) chosen.add(name);
    else chosen.delete(name);
    if (list === "q" && !on) columns.angles = columns.angles.filter((own) => own !== name);
    columns[list] = file.headers.filter((header) => chosen.has(header));
    write();
    tell();
  };
  const box = (list: "q" | "angles", name: string, label: string, off = false) => {
    const input = el("input", { type: "checkbox", "aria-label": `${name} is ${label}`, disabled: off });
    input.checked = columns[list].includes(name);
    input.addEventListener("change", () => put(list, name, input.checked));
    return el("td", {}, input);
  };
  const row = (name: string): HTMLElement => {
    const angle = box("angles", name, "an angle", !columns.q.includes(name));
    return el("tr", {}, el("th", { scope: "row" }, name), box("q", name, "a coordinate"), angle);
  };
  const chooseTime = select("Time, in seconds", options, time, (name) => {
    columns.t = name;
    columns.q = columns.q.filter((own) => own !== name);
    write();
    tell();
  });
  const several = select("Motions separated by", [["", "none: it is one motion"], ...options], motions ?? "", (name) => {
    if (name) columns.trajectory = name;
    else delete columns.trajectory;
    columns.q = columns.q.filter((own) => own !== name);
    write();
    tell();
  });
  const degrees = toggle("Angles are in degrees", file.degrees, (on) => {
    columns.degrees = on;
    tell();
  });
  write();
  tell();
  const heads = ["Column", "Coordinate", "Angle"].map((head) => el("th", { scope: "col" }, head));
  const table = el("table", {}, el("thead", {}, el("tr", {}, ...heads)), rows);
  const hint = el("p", { class: "hint" }, "Columns named qd1, qd2 … are read as velocities, qdd1 … as accelerations and tau1 … as forces; velocities and accelerations that are missing are estimated.");
  return el("div", { class: "card-part" }, el("div", { class: "row" }, chooseTime, several, degrees), table, hint);
}

/** The first rows of a file. */
export function preview(file: Inspected): HTMLElement {
  const head = el("tr", {}, ...file.headers.map((header) => el("th", { scope: "col" }, header)));
  const rows = file.rows.map((row) => el("tr", {}, ...row.map((cell) => el("td", {}, cell))));
  const caption = el("caption", { class: "hidden" }, "The first rows of the file");
  return el("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "The first rows of the file" }, el("table", {}, caption, el("thead", {}, head), el("tbody", {}, ...rows)));
}
