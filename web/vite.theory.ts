// docs/theory.md as a page beside the laboratory: headings, paragraphs and equations, which is all that it has.

import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";

const SOURCE = fileURLToPath(new URL("../docs/theory.md", import.meta.url));
const PLACE = "<!-- the theory -->";

/** Puts the theory into `theory.html`. */
export function theory(): Plugin {
  return {
    name: "theory",
    buildStart() {
      this.addWatchFile(SOURCE);
    },
    transformIndexHtml(html) {
      return html.includes(PLACE) ? html.replace(PLACE, () => rendered(readFileSync(SOURCE, "utf8"))) : html;
    },
  };
}

/** A link to each section, and the sections; equations and sections are anchors. */
function rendered(markdown: string): string {
  const parts = markdown.split(/^```\n([^]*?)^```\n/m);
  const numbers = new Set([...markdown.matchAll(NUMBER)].map((found) => found[1] ?? ""));
  const body = parts.map((part, k) => (k % 2 === 1 ? equations(part) : prose(part, numbers))).join("\n");
  const titles = [...markdown.matchAll(/^## (.*)$/gm)].map((found) => found[1] ?? "");
  const contents = titles.map((title) => `<li><a href="#${anchor(title)}">${escaped(title)}</a></li>`);
  return `<details class="contents"><summary>Sections</summary><ul>${contents.join("")}</ul></details>\n${body}`;
}

/** The number at the end of a line of equations, or of a paragraph with one. */
const NUMBER = /  \((\d+[a-z]?)\)$/gm;

/** The number of an equation, to which others lead. */
const numbered = (n: string) => `<a id="eq-${n}" href="#eq-${n}">(${n})</a>`;

function equations(block: string): string {
  const lines = escaped(block.trimEnd()).replace(NUMBER, (_, n: string) => `  ${numbered(n)}`);
  return `<pre tabindex="0">${lines}</pre>`;
}

function prose(text: string, numbers: Set<string>): string {
  return text
    .split(/\n{2,}/)
    .map((block) => block.trim())
    .filter(Boolean)
    .map((block) => heading(block) ?? paragraph(block, numbers))
    .join("\n");
}

function heading(block: string): string | undefined {
  const [, marks, title] = /^(#{1,2}) (.*)$/.exec(block) ?? [];
  if (!marks || !title) return undefined;
  return marks === "#" ? `<h2>${escaped(title)}</h2>` : `<h3 id="${anchor(title)}">${escaped(title)}</h3>`;
}

function paragraph(block: string, numbers: Set<string>): string {
  const [, words = block, n] = /^([^]*?) {2,}\((\d+[a-z]?)\)$/.exec(block) ?? [];
  return `<p>${inline(words, numbers)}${n ? `  ${numbered(n)}` : ""}</p>`;
}

/** Strong and slanted words, code, equations by their numbers; decisions are not at hand here, so that links to them are words. */
function inline(block: string, numbers: Set<string>): string {
  return escaped(block)
    .replace(/\[([^\]]*)\]\([^)]*\.md[^)]*\)/g, "$1")
    .replace(/`([^`]+)`/g, "<code>$1</code>")
    .replace(/\*\*([^*]+)\*\*/g, "<strong>$1</strong>")
    .replace(/(?<=[\s(])\*([A-Za-z][^*]*)\*/g, "<em>$1</em>")
    .replace(/(?<!\w)\((\d+[a-z]?)\)/g, (all: string, n: string) => (numbers.has(n) ? `<a href="#eq-${n}">${all}</a>` : all));
}

/** The name of a section in links: its words without its number. */
function anchor(title: string): string {
  return title.replace(/^\d+[a-z]? /, "").toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "");
}

function escaped(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;");
}
