  // A figure as a file: its picture on white as SVG and PNG, its numbers as CSV.

  const named = (text) => text.normalize("NFKD").toLowerCase().replace(/[^a-z0-9]+/g, "-").slice(0, 60).replace(/^-|-$/g, "");
  const HEADING = 30; // px of the picture for its title
  const DENSITY = 3; // px of a PNG for one of its picture

  function download(blob, name) {
    const link = element("a", "");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  // The printed picture with its title, its colours written out: programs for pictures know no variables of style.
  function picture(plot) {
    const own = plot.figure.querySelector("svg.static").cloneNode(true), { width, height } = own.viewBox.baseVal, unit = 8;
    const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]);
    const light = rules.find(({ selectorText }) => selectorText === ":root").style;
    const written = ({ cssText }) => cssText.replace(/var\((--\w+)\)/g, (_, name) => light.getPropertyValue(name).trim());
    const colours = rules.filter(({ selectorText }) => /^\.[lf](\.\w+)?$/.test(selectorText)).map(written);
    const made = (name, attributes, text = "") => {
      const one = document.createElementNS(own.namespaceURI, name);
      for (const [key, value] of Object.entries(attributes)) one.setAttribute(key, value);
      one.textContent = text;
      return one;
    };
    own.prepend(
      made("style", {}, colours.join("") + "text{font-family:system-ui,sans-serif}"),
      made("rect", { class: "f surface", y: -HEADING * unit, width, height: HEADING * unit }),
      made("text", { class: "f ink", x: 8 * unit, y: -10 * unit, "font-size": 15 * unit, "font-weight": 600 }, plot.title),
    );
    const attributes = { viewBox: `0 ${-HEADING * unit} ${width} ${height + HEADING * unit}`, width: width / unit, height: height / unit + HEADING };
    for (const [name, value] of Object.entries(attributes)) own.setAttribute(name, value);
    return new XMLSerializer().serializeToString(own);
  }

  async function bitmap(text) {
    const image = new Image(), canvas = element("canvas", "");
    image.src = "data:image/svg+xml," + encodeURIComponent(text);
    await image.decode();
    [canvas.width, canvas.height] = [DENSITY * image.width, DENSITY * image.height];
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Promise((done) => canvas.toBlob(done, "image/png"));
  }

  // A column of abscissae, once for curves that share them, and a column for each curve; a row a cell for a map.
  function columns(plot) {
    if (plot.map) return cellColumns(plot);
    const all = [];
    let before = null;
    for (const { name, x, y, low, high } of plot.series) {
      if (x !== before) all.push([plot.x.text, plot.x.names ? [...x].map((k) => plot.x.names[k]) : x]);
      before = x;
      const label = name || plot.y.text;
      all.push([label, y], ...(low.length ? [[label + ", low", low], [label + ", high", high]] : []));
    }
    return all;
  }

  function cellColumns({ x, y, map }) {
    const cells = Array.from(map.values, (_, k) => [k % map.columns, Math.floor(k / map.columns)]);
    const middle = ({ home }, part) => home[0] + part * (home[1] - home[0]);
    return [
      [x.text, cells.map(([column]) => middle(x, (column + 0.5) / map.columns))],
      [y.text, cells.map(([, row]) => middle(y, (row + 0.5) / map.rows))],
      ["value", map.values],
    ];
  }

  // Numbers with the digits that the page holds; a formula of a spreadsheet is no name.
  function csv(plot) {
    const cell = (value) => (typeof value === "number" ? (Number.isFinite(value) ? String(Number(value.toPrecision(7))) : "") : quoted(value ?? ""));
    const quoted = (text) => (/^[=+\-@]|[",\r\n]/.test(text) ? `"${text.replace(/^[=+\-@]/, "'$&").replaceAll('"', '""')}"` : text);
    const all = columns(plot), length = Math.max(...all.map(([, values]) => values.length));
    const rows = Array.from({ length }, (_, k) => all.map(([, values]) => cell(values[k])).join(","));
    return [all.map(([name]) => quoted(name)).join(","), ...rows, ""].join("\r\n");
  }

  const FILES = {
    PNG: (plot) => bitmap(picture(plot)),
    SVG: (plot) => new Blob([picture(plot)], { type: "image/svg+xml" }),
    CSV: (plot) => new Blob([csv(plot)], { type: "text/csv" }),
  };

  // A button for each file, behind one that shows them.
  function saving(plot) {
    const menu = element("details", "save"), shown = element("summary", "", "Save"), files = element("div", "files");
    shown.setAttribute("aria-label", "Save: " + plot.title);
    menu.append(shown, files);
    menu.addEventListener("keydown", ({ key }) => { if (key === "Escape") menu.open = false; });
    for (const [kind, made] of Object.entries(FILES)) {
      const button = element("button", "", kind);
      button.type = "button";
      button.setAttribute("aria-label", `Save as ${kind}: ${plot.title}`);
      const name = [document.title, plot.figure.id.replace(/^(figure|map)-/, "")].map(named).filter(Boolean).join("-") || "figure";
      button.addEventListener("click", async () => {
        menu.open = false;
        download(await made(plot), `${name}.${kind.toLowerCase()}`);
      });
      files.append(button);
    }
    return menu;
  }
