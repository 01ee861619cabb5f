// What a check found, and how good a model is, in words with remedies.

import type { Checked, Grade, Scored, Verdict } from "../engine/answers";
import { el } from "../ui/element";
import { sentence } from "../ui/message";

const WORDS: Record<Verdict, string> = { pass: "good", warn: "could be better", fail: "not usable" };
const WHOLE: Record<Verdict, string> = { ...WORDS, warn: "usable, but could be better" };
/** The most findings that are listed: a file can have one for each of its motions. */
const LISTED = 50;
const GRADES: Record<Grade, string> = { good: "Good", fair: "Fair", poor: "Poor" };

/** The findings of a check, the gravest first; what passes is folded. */
export function findings(checked: Checked): HTMLElement {
  const order: Verdict[] = ["fail", "warn", "pass"];
  const list = (verdicts: Verdict[]) => {
    const items = checked.items.filter((item) => verdicts.includes(item.verdict));
    return items.toSorted((a, b) => order.indexOf(a.verdict) - order.indexOf(b.verdict));
  };
  const troubles = list(["fail", "warn"]);
  const listed = troubles.slice(0, LISTED).map(entry);
  const more = troubles.length - listed.length;
  const passed = new Set(checked.items.filter((item) => item.verdict === "pass").map((item) => item.name));
  const first = (name: string) => checked.items.find((item) => item.name === name && item.verdict === "pass");
  const fine = [...passed].flatMap((name) => first(name) ?? []).map(entry);
  const head = el("p", { class: "big" }, "The data are ", el("span", { class: `badge ${checked.verdict}` }, WHOLE[checked.verdict]), ".");
  const rest = el("details", {}, el("summary", {}, fine.length === 1 ? "1 check passed" : `${fine.length} checks passed`), el("ul", { class: "findings" }, ...fine));
  return el("div", { class: "card-part" }, head, listed.length > 0 && el("ul", { class: "findings" }, ...listed), more > 0 && el("p", {}, `And ${more} more.`), rest);
}

function entry(item: Checked["items"][number]): HTMLElement {
  const about = item.trajectory ? ` of ${item.trajectory}` : "";
  const badge = el("span", { class: `badge ${item.verdict}` }, WORDS[item.verdict]);
  const found = el("p", {}, el("strong", {}, `${item.name}${about}`), " (", badge, `): ${sentence(item.finding)}`);
  return el("li", { "data-verdict": item.verdict }, found, item.remedy && el("p", { class: "hint" }, `What to do: ${sentence(item.remedy)}`));
}

/** How good a fitted model is. */
export function assessment(scored: Scored): HTMLElement {
  const { verdict, reasons, expectation } = scored.assessment;
  const badge = el("span", { class: `badge ${verdict}`, "data-grade": verdict }, GRADES[verdict]);
  const items = reasons.map((reason) =>
    el(
      "li",
      {},
      el("p", {}, el("span", { class: `badge ${reason.grade}` }, GRADES[reason.grade]), `: ${sentence(reason.finding)}`),
      reason.remedy && el("p", { class: "hint" }, `What to do: ${sentence(reason.remedy)}`),
    ),
  );
  const errors = scored.score.acceleration?.nmse.map((x) => `${(100 * x).toPrecision(2)} %`).join(", ");
  return el(
    "div",
    {},
    el("p", { class: "big" }, badge, " on motions that were held back."),
    expectation && el("p", {}, sentence(expectation)),
    errors && el("p", {}, `Share of the accelerations that it leaves unexplained: ${errors}.`),
    items.length > 0 && el("ul", { class: "findings" }, ...items),
  );
}
