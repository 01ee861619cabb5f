// A figure as a file: its picture on white as PNG, its numbers as CSV.

import { element, swatchKind } from "./plot.js";

const DENSITY = 3; // px of a PNG for one of the page

function download(blob, name) {
  const link = element("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

// The plot on white, with its title and its legend above.
async function picture(plot, colour) {
  const still = await plot.still(DENSITY, colour), canvas = element("canvas"), context = canvas.getContext("2d");
  const font = (size) => `${size * DENSITY}px ${getComputedStyle(document.body).fontFamily}`, u = 8 * DENSITY;
  const named = plot.shown.filter((one) => one.name);
  context.font = font(12);
  const places = []; // of names, in rows
  let [x, y] = [2 * u, 7 * u];
  for (const { name } of named) {
    const wide = context.measureText(name).width + 6 * u;
    if (x > 2 * u && x + wide > still.width) [x, y] = [2 * u, y + 2.5 * u];
    places.push([x, y]);
    x += wide;
  }
  const heading = named.length ? y + 2 * u : 5 * u;
  [canvas.width, canvas.height] = [still.width, still.height + heading];
  Object.assign(context, { fillStyle: colour("surface"), textBaseline: "middle" });
  context.fillRect(0, 0, canvas.width, canvas.height);
  Object.assign(context, { fillStyle: colour("ink"), font: "600 " + font(15) });
  context.fillText(plot.title, 2 * u, 3 * u, canvas.width - 4 * u);
  context.font = font(12);
  named.forEach((one, k) => {
    const [x, y] = places[k], kind = swatchKind(one);
    context.fillStyle = colour("ink");
    context.fillText(one.name, x + 3 * u, y, still.width - x - 3 * u);
    context.fillStyle = colour(one.ink);
    if (kind === "points") context.fillRect(x + 0.8 * u, y - 0.4 * u, 0.8 * u, 0.8 * u);
    else context.fillRect(x, y - (kind === "line" ? 1 : 3) * DENSITY, 2.4 * u, (kind === "line" ? 2 : 6) * DENSITY);
  });
  context.drawImage(still, 0, heading);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
}

// A column of abscissae, once for curves that share them, and a column for each curve; a row a cell for a map.
function columns({ x, y, map, series }) {
  if (map) {
    const middle = ({ home }, part) => home[0] + part * (home[1] - home[0]);
    const cells = Array.from(map.values, (_, k) => [middle(x, ((k % map.columns) + 0.5) / map.columns), middle(y, (Math.floor(k / map.columns) + 0.5) / map.rows)]);
    return [[x.text, cells.map(([x]) => x)], [y.text, cells.map(([, y]) => y)], ["value", map.values]];
  }
  const all = [];
  let before = null;
  for (const one of series) {
    if (one.x !== before) all.push([x.text, x.names ? [...one.x].map((k) => x.names[k]) : one.x]);
    before = one.x;
    const label = one.name || y.text;
    all.push([label, one.y], ...(one.low.length ? [[label + ", low", one.low], [label + ", high", one.high]] : []));
  }
  return all;
}

// Numbers with the digits that the page holds; a formula of a spreadsheet is no name.
function csv(plot) {
  const quoted = (text) => (/^[=+\-@]|[",\r\n]/.test(text) ? `"${text.replace(/^[=+\-@]/, "'$&").replaceAll('"', '""')}"` : text);
  const cell = (value) => (typeof value === "number" ? (Number.isFinite(value) ? String(Number(value.toPrecision(7))) : "") : quoted(value ?? ""));
  const all = columns(plot), length = Math.max(...all.map(([, values]) => values.length));
  const rows = Array.from({ length }, (_, k) => all.map(([, values]) => cell(values[k])).join(","));
  return new Blob([[all.map(([name]) => quoted(name)).join(","), ...rows, ""].join("\r\n")], { type: "text/csv" });
}

// A button for each file, behind one that shows them.
export function saving(plot, id, colour) {
  const menu = element("details", "save"), shown = element("summary", "", "Save"), files = element("div", "files");
  shown.setAttribute("aria-label", "Save: " + plot.title);
  menu.append(shown, files);
  menu.addEventListener("keydown", ({ key }) => { if (key === "Escape") menu.open = false; });
  const plain = (text) => text.normalize("NFKD").toLowerCase().replace(/[^a-z0-9]+/g, "-").slice(0, 60).replace(/^-|-$/g, "");
  const name = [document.title, id.replace(/^(figure|map)-/, "")].map(plain).filter(Boolean).join("-") || "figure";
  for (const [kind, made] of Object.entries({ PNG: () => picture(plot, colour), CSV: () => csv(plot) })) {
    const button = element("button", "", kind);
    button.type = "button";
    button.setAttribute("aria-label", `Save as ${kind}: ${plot.title}`);
    button.addEventListener("click", async () => {
      menu.open = false;
      download(await made(), `${name}.${kind.toLowerCase()}`);
    });
    files.append(button);
  }
  return menu;
}
