// A lesson in five steps: least action, Euler–Lagrange, learning L, energy, and when it fails.

import type { Motion } from "../engine/answers";
import { Engine } from "../engine/engine";
import { column } from "../stage/player";
import * as address from "../ui/address";
import { button, short, slider } from "../ui/controls";
import { el } from "../ui/element";
import { Message } from "../ui/message";
import { Plot } from "../ui/plot";
import { setupOf } from "./learn";
import { Race } from "./race";
import type { Entry } from "./view";

/** One step: its words, and what can be tried. */
interface Step {
  title: string;
  /** What it shows; what it runs outside of that ends when `left` is aborted. */
  make(left: AbortSignal): HTMLElement[];
}

export const lesson: Entry = { name: "lesson", title: "Lesson", open: (values, left) => new Lesson(values, left).element };

class Lesson {
  readonly element = el("div", { class: "view lesson" });
  /** Aborted when the step is left. */
  private left = new AbortController();
  private at: number;

  constructor(values: address.Values, left: AbortSignal) {
    left.addEventListener("abort", () => this.left.abort());
    this.at = Math.round(address.number(values["step"], 1, 1, STEPS.length));
    this.show();
  }

  private go(step: number): void {
    this.at = step;
    this.show();
    this.element.querySelector("h3")?.focus();
    scrollTo({ top: 0 });
  }

  private show(): void {
    this.left.abort();
    this.left = new AbortController();
    const step = STEPS[this.at - 1] as Step;
    const parts = step.make(this.left.signal);
    address.write("lesson", { step: String(this.at) });
    const mark = (own: Step, k: number) => {
      const pressed = button(`${k + 1}. ${own.title}`, () => this.go(k + 1), k + 1 === this.at ? "main" : "quiet");
      if (k + 1 === this.at) pressed.setAttribute("aria-current", "step");
      return el("li", {}, pressed);
    };
    const back = this.at > 1 && button("Back", () => this.go(this.at - 1));
    const next = this.at < STEPS.length && button("Next", () => this.go(this.at + 1), "main");
    const title = el("h3", { tabindex: -1 }, `${this.at}. ${step.title}`);
    const card = el("section", { class: "card", "aria-label": `Step ${this.at} of ${STEPS.length}` }, title, ...parts, el("div", { class: "row" }, back, next));
    this.element.replaceChildren(el("ol", { class: "steps", "aria-label": "Steps" }, ...STEPS.map(mark)), card);
  }
}

function text(...sentences: string[]): HTMLElement {
  return el("p", {}, sentences.join(" "));
}

function equation(symbols: string): HTMLElement {
  return el("p", { class: "equation", tabindex: 0 }, symbols);
}

/** A link to a section of the theory. */
function more(words: string, section: string): HTMLElement {
  return el("p", { class: "hint" }, "In the theory: ", el("a", { href: `./theory.html#${section}` }, words), ".");
}

/** The path of a pendulum between two instants, bent by hand: the action is least along the true one. */
function leastAction(left: AbortSignal): HTMLElement[] {
  const engine = new Engine(left);
  const message = new Message();
  const plot = new Plot({ title: "Two paths with the same ends", x: "time, s", y: "angle, rad" });
  const said = el("p", { class: "big", role: "status" });
  let truth: Motion | undefined;
  let least: number | null = null;
  const action = (t: number[], q: number[]) => engine.ask<number | null>({ ask: "action", by: { system: "pendulum" }, t, q });
  const bend = async (size: number) => {
    if (!truth) return;
    const { t } = truth;
    const end = t.at(-1) ?? 1;
    const straight = column(truth.q, 0, 1);
    const bent = straight.map((x, k) => x + size * Math.sin((Math.PI * (t[k] ?? 0)) / end));
    plot.show([
      { name: "true path", colour: "--truth", x: t, y: straight },
      { name: "your path", colour: "--lagrangian", x: t, y: bent, dashed: true },
    ]);
    const own = await action(t, bent);
    const above = (own ?? NaN) - (least ?? NaN);
    said.textContent = `Action of your path: ${short(own ?? NaN)} J s, ${short(Math.max(0, above))} J s above that of the true one.`;
  };
  const bow = slider({ label: "How far your path is bent", unit: "rad", min: -0.8, max: 0.8, step: 0.02, value: 0.4, changed: (x) => void bend(x).catch((e) => message.fail(e)) });
  const begin = async () => {
    truth = await engine.ask<Motion>({ ask: "simulate", by: { system: "pendulum" }, q0: [-0.5], qd0: [1.5], duration: 0.8, interval: 0.005 });
    least = await action(truth.t, column(truth.q, 0, 1));
    await bend(0.4);
  };
  begin().catch((error) => message.fail(error));
  return [
    text("Throw a ball, release a pendulum: of all paths between two instants nature takes one.", "Give every path a number, its action: add up L = kinetic energy − potential energy over time."),
    equation("S = ∫ L(q, q̇) dt"),
    text("Bend the path with the slider, its ends held. Whichever way you bend it, the action grows: along the true path it is stationary, here least."),
    bow.element,
    said,
    plot.element,
    message.element,
    more("the action", "the-action"),
  ];
}

/** From the action to an equation of motion: the same L gives every motion. */
function eulerLagrange(left: AbortSignal): HTMLElement[] {
  const engine = new Engine(left);
  const message = new Message();
  const plot = new Plot({ title: "Phase portrait of a pendulum", x: "angle, rad", y: "angular velocity, rad/s" });
  const state = { q: 1, length: 1 };
  const draw = async () => {
    const ask = (q0: number) =>
      engine.ask<Motion>({ ask: "simulate", by: { known: { name: "pendulum", parameters: { length: state.length } } }, q0: [q0], qd0: [0], duration: 6, interval: 0.02 });
    const [own, small] = [await ask(state.q), await ask(0.2)];
    const curve = (name: string, colour: string, motion: Motion) => ({ name, colour, x: column(motion.q, 0, 1), y: column(motion.qd, 0, 1) });
    plot.show([curve("your start", "--lagrangian", own), curve("a small swing", "--truth", small)]);
  };
  const changed = (part: Partial<typeof state>) => {
    Object.assign(state, part);
    draw().catch((error) => message.fail(error));
  };
  const sliders = [
    slider({ label: "Angle at the start", unit: "rad", min: 0.2, max: 3.1, step: 0.02, value: 1, changed: (q) => changed({ q }) }),
    slider({ label: "Length", unit: "m", min: 0.3, max: 2, step: 0.05, value: 1, changed: (length) => changed({ length }) }),
  ];
  changed({});
  return [
    text("That no small change of the path changes the action is the same as an equation at every instant, that of Euler and Lagrange:"),
    equation("d/dt ∂L/∂q̇ − ∂L/∂q = 0"),
    text("For a pendulum, L = ½ m l² θ̇² + m g l cos θ, it says θ̈ = −(g/l) sin θ.", "One function L holds all motions: change where it begins, or the length, and the motion follows."),
    el("div", { class: "sliders" }, ...sliders.map((own) => own.element)),
    plot.element,
    message.element,
    more("the equation of motion", "the-equation-of-motion"),
  ];
}

/** A race with values of the address, embedded. */
function race(left: AbortSignal, values: address.Values, ...words: HTMLElement[]): HTMLElement[] {
  const own = new Race(setupOf(values), left);
  const link = el("p", { class: "hint" }, "With all sliders: ", el("a", { href: address.link("learn", values) }, "open this in Learn"), ".");
  return [...words, el("div", { class: "pair" }, own.element, own.figures), link];
}

function learnL(left: AbortSignal): HTMLElement[] {
  return race(
    left,
    { system: "pendulum", motions: "20", width: "32", seconds: "5" },
    text("Usually we know L and compute the motion. Now we have the motion and look for L: it is a network with weights, and the weights change until its Euler–Lagrange equation gives the accelerations that were recorded."),
    text("Press Learn. Beside it a plain network of the same size learns the accelerations directly. Both losses fall; the bodies are the predictions while they learn."),
  );
}

function energyKept(left: AbortSignal): HTMLElement[] {
  return race(
    left,
    { system: "double-pendulum", motions: "30", width: "32", seconds: "20" },
    text("Whatever its weights are, a Lagrangian keeps its energy H = q̇·∂L/∂q̇ − L, because time does not appear in it: that is Noether's theorem.", "A plain network keeps nothing, and its small errors add up."),
    text("Let both learn a double pendulum for 20 s, then look at the energy along 30 s of motion, and at the figure for 100 s. Neither predicts the angles of a chaotic motion for long; the energy is what remains."),
    more("energy and power", "energy-and-power"),
  );
}

function whenItFails(): HTMLElement[] {
  const setup = { system: "pendulum", motions: "20", width: "32", seconds: "5" };
  const tries: [string, address.Values][] = [
    ["Too little data: two motions", { ...setup, motions: "2" }],
    ["Much noise, and positions alone", { ...setup, noise: "0.02", positions: "1" }],
    ["Friction, which no L alone explains", { ...setup, friction: "0.3" }],
    ["Too little time: one second for a double pendulum", { system: "double-pendulum", motions: "30", width: "32", seconds: "1" }],
  ];
  return [
    text("A learned Lagrangian keeps an energy, but not always the right one: where the data never went it is a guess, and where they are noisy it is blurred."),
    text("Friction is not part of a Lagrangian: it has to be learned as a force beside it. Here it is; a Lagrangian alone would say that the motion never ends."),
    more("dissipation", "dissipation"),
    el("h4", {}, "Try"),
    el("ul", {}, ...tries.map(([words, values]) => el("li", {}, el("a", { href: address.link("learn", values) }, words)))),
    text("A model that you trust is one that was tested on motions that it has not seen. That is what the check and the verdict in Your data are for."),
    el("p", {}, "Your own pendulum: film it with a telephone, export its angle from a video tracker, and drop the table into ", el("a", { href: address.link("data") }, "Your data"), "."),
    el("p", {}, "Or go on playing: ", el("a", { href: address.link("play", { system: "kepler" }) }, "a planet and its star"), "."),
  ];
}

const STEPS: Step[] = [
  { title: "Least action", make: leastAction },
  { title: "Euler–Lagrange", make: eulerLagrange },
  { title: "Learn L", make: learnL },
  { title: "Energy is kept", make: energyKept },
  { title: "When it fails", make: whenItFails },
];
