// Learn: data with their flaws, two networks, and what each of them keeps.

import { SCENES, type State, scene } from "../stage/scenes";
import { Stage } from "../stage/stage";
import * as address from "../ui/address";
import { button, select, slider, toggle } from "../ui/controls";
import { el } from "../ui/element";
import { Race, type Setup } from "./race";
import { StateSliders } from "./state";
import type { Entry } from "./view";

/** Systems that a plain network and a Lagrangian can both be tried on. */
const NAMES = ["pendulum", "double-pendulum", "cart-pole", "mass-spring"];

export const learn: Entry = { name: "learn", title: "Learn", open: (values, left) => new Learn(values, left).element };

/** The setup that an address names. */
export function setupOf(values: address.Values): Setup {
  const system = NAMES.includes(values["system"] ?? "") ? values["system"] : "double-pendulum";
  return {
    scene: scene(system),
    motions: Math.round(address.number(values["motions"], 30, 2, 60)),
    starts: [],
    noise: address.number(values["noise"], 0, 0, 0.05),
    friction: address.number(values["friction"], 0, 0, 1),
    positionsOnly: values["positions"] === "1",
    // In 20 s a wider Lagrangian has not learned enough yet where other programs want the processor too.
    width: Math.round(address.number(values["width"], 32, 8, 128)),
    seconds: address.number(values["seconds"], 20, 1, 60),
    steps: Math.round(address.number(values["steps"], 0, 0, 10_000)),
    seed: Math.round(address.number(values["seed"], 0, 0, 1e6)),
  };
}

class Learn {
  readonly element = el("div", { class: "view learn" });
  private readonly race: Race;
  private readonly count = el("output");
  private readonly throws: Stage;
  private readonly start: StateSliders;
  private readonly hand: HTMLElement;
  private setup: Setup;
  /** Where the body that is recorded next is held. */
  private held: State;

  constructor(values: address.Values, left: AbortSignal) {
    this.setup = setupOf(values);
    this.held = this.setup.scene.start;
    this.race = new Race(this.setup, left);
    this.throws = new Stage(this.setup.scene, {
      moved: (state) => this.hold(state),
      released: (state) => this.add(state),
    });
    this.start = new StateSliders(this.setup.scene, this.setup.scene.start, (state) => this.hold(state));
    this.hand = this.byHand();
    this.element.append(this.race.element, this.race.figures, this.controls(), this.questions());
    this.write();
  }

  private change(part: Partial<Setup>): void {
    this.setup = { ...this.setup, ...part };
    this.race.change(this.setup);
    if ("friction" in part) this.race.again();
    this.write();
  }

  private write(): void {
    const { scene: own, motions, starts, noise, friction, positionsOnly, width, seconds, steps, seed } = this.setup;
    const values: address.Values = { system: own.name, motions: String(motions), width: String(width), seconds: String(seconds) };
    if (noise > 0) values["noise"] = String(noise);
    if (friction > 0) values["friction"] = String(friction);
    if (positionsOnly) values["positions"] = "1";
    if (steps > 0) values["steps"] = String(steps);
    if (seed > 0) values["seed"] = String(seed);
    address.write("learn", values);
    const counted = (n: number) => (n === 1 ? "1 motion" : `${n} motions`);
    const recorded = starts.length > 0 ? `${counted(starts.length)} begun by hand` : `${counted(motions)} from random states`;
    this.count.textContent = `${recorded}, 4 s each, 50 samples a second`;
  }

  private controls(): HTMLElement {
    const systems = SCENES.filter((own) => NAMES.includes(own.name)).map((own): [string, string] => [own.name, own.title]);
    const chosen = select("System", systems, this.setup.scene.name, (name) => {
      this.throws.use(scene(name));
      this.start.use(scene(name), scene(name).start);
      this.hold(scene(name).start);
      this.change({ scene: scene(name), starts: [] });
    });
    const { motions, noise, width, seconds } = this.setup;
    const range = { min: 0, max: 1, step: 1, value: 0 };
    const sliders = [
      slider({ ...range, label: "Motions", min: 2, max: 60, value: motions, changed: (x) => this.change({ motions: x, starts: [] }) }),
      slider({ ...range, label: "Noise", unit: "rad or m", max: 0.05, step: 0.001, value: noise, changed: (x) => this.change({ noise: x }) }),
      slider({ ...range, label: "Width of the networks", min: 8, max: 128, step: 8, value: width, changed: (x) => this.change({ width: x }) }),
      slider({ ...range, label: "Time to learn", unit: "s", min: 1, max: 60, value: seconds, changed: (x) => this.change({ seconds: x, steps: 0 }) }),
    ];
    const title = el("h3", {}, "What is learned from");
    return el("section", { class: "card", "aria-label": "Data and networks" }, title, chosen, this.count, el("div", { class: "sliders" }, ...sliders.map((own) => own.element)), this.hand);
  }

  /** Motions that a person starts. */
  private byHand(): HTMLElement {
    const record = button("Record this start", () => this.add(this.held));
    const none = button("Forget them", () => this.change({ starts: [] }));
    const hint = el("p", { class: "hint" }, "Drag the body and release it, or set its start with the sliders: each release is recorded as a motion. Three or more make a data set.");
    this.hold(this.setup.scene.start);
    const parts = [hint, this.throws.canvas, this.start.element, el("div", { class: "row" }, record, none)];
    return el("details", {}, el("summary", {}, "Record motions by hand"), el("div", { class: "card-part" }, ...parts));
  }

  private hold(state: State): void {
    this.held = state;
    this.throws.show([{ state, colour: "--truth" }]);
    this.start.show(state);
  }

  private add(state: State): void {
    this.change({ starts: [...this.setup.starts, state] });
  }

  private questions(): HTMLElement {
    const friction = toggle("What if there is friction?", this.setup.friction > 0, (on) => this.change({ friction: on ? 0.1 : 0 }));
    const positions = toggle("What if we only have positions?", this.setup.positionsOnly, (on) => this.change({ positionsOnly: on }));
    const takes = el("p", { class: "hint" }, "Friction takes energy: the Lagrangian is then learned together with a force against the velocity, and the energy falls as it does in the truth.");
    const alone = el("p", { class: "hint" }, "From positions alone, velocities and accelerations are estimated first. Noise then weighs more: try both.");
    return el("section", { class: "card", "aria-label": "Questions" }, el("h3", {}, "Questions"), friction, takes, positions, alone);
  }
}
