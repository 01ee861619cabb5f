// A Lagrangian and a plain network of the same size learn from the same data, beside the truth.

import type { EnergyTest, Motion, Named, Progress } from "../engine/answers";
import { Engine } from "../engine/engine";
import { Player, stateAt } from "../stage/player";
import type { Scene, State } from "../stage/scenes";
import { type Body, Stage } from "../stage/stage";
import { button, short } from "../ui/controls";
import { el } from "../ui/element";
import { Message } from "../ui/message";
import { type Curve, Plot } from "../ui/plot";
import { Contestant, type Task, type Trial } from "./contestant";
import { StateSliders } from "./state";

/** What both learn from, and how. */
export interface Setup {
  scene: Scene;
  motions: number;
  starts: State[];
  noise: number;
  friction: number;
  positionsOnly: boolean;
  width: number;
  seconds: number;
  /** The length in steps, which give the same model on every machine; 0 for the seconds. */
  steps: number;
  seed: number;
}

type Side = "lagrangian" | "plain";

const NAMES: Record<Side, string> = { lagrangian: "Lagrangian", plain: "plain network" };
const COLOURS: Record<Side, string> = { lagrangian: "--lagrangian", plain: "--plain" };
const SIDES: Side[] = ["plain", "lagrangian"];
/** Seconds of a recorded motion, between its samples, and of the motion that is predicted. */
const RECORDED = 4;
const INTERVAL = 0.02;
const PREDICTED = 30;
/** The largest error whose figure says something, in percent: beyond it a motion has gone astray. */
const MOST = 1000;

const UNLEARNED = "Nothing is learned yet: press Learn.";

export class Race {
  readonly element = el("section", { class: "card", "aria-label": "Learning" });
  readonly figures = el("section", { class: "card plots", "aria-label": "Results" });
  private readonly engine: Engine;
  private readonly sides: Record<Side, Contestant>;
  private readonly stage: Stage;
  private readonly state: StateSliders;
  private readonly message = new Message();
  private readonly loss = new Plot({ title: "Loss on data that were held back", x: "training, s", y: "loss", logarithmic: true });
  private readonly energy: Plot;
  private readonly result = el("p", { class: "result", role: "status" });
  private readonly bar = el("progress", { class: "progress", max: 1, value: 0, "aria-label": "Progress of learning" });
  private readonly go = button("Learn", () => this.press(), "main");
  private readonly save = button("Save the Lagrangian", () => void this.download());
  private readonly move = button("Run", () => this.setMoving(!this.player.isRunning));
  private readonly player: Player;
  private readonly losses: Partial<Record<Side, Progress[]>> = {};
  private motions: Partial<Record<Side | "truth", Motion>> = {};
  private learning = false;
  /** Counts what was begun and ended, so that what was given up ends nothing that was begun since. */
  private round = 0;
  private trial: Trial;
  private asked = 0;

  constructor(
    private setup: Setup,
    left: AbortSignal,
  ) {
    this.engine = new Engine(left);
    this.sides = { lagrangian: new Contestant(left), plain: new Contestant(left) };
    this.player = new Player((t) => this.frame(t), left);
    this.energy = new Plot({ title: "Energy along the predicted motion", x: "time, s", y: "true energy, J" });
    this.trial = { start: setup.scene.start, duration: PREDICTED };
    this.stage = new Stage(setup.scene, {
      moved: (state) => this.hold(state),
      released: (state) => void this.from(state),
    });
    this.state = new StateSliders(setup.scene, setup.scene.start, (state) => void this.from(state));
    this.save.disabled = true;
    const caption = el("p", { class: "hint" }, "Drag the true body: all three begin again from there.");
    const start = el("details", {}, el("summary", {}, "Set the start with sliders"), this.state.element);
    const buttons = el("div", { class: "row" }, this.go, this.move, this.save);
    this.element.append(buttons, this.bar, this.result, this.message.element, this.stage.canvas, this.legend(), caption, start);
    this.figures.append(this.energy.element, this.loss.element);
    this.result.textContent = UNLEARNED;
    void this.from(this.trial.start);
  }

  /** Changes what will be learned; what was learned of something else is forgotten. */
  change(setup: Setup): void {
    const other = setup.scene !== this.setup.scene;
    this.setup = setup;
    if (this.learning) this.cancel();
    this.forget();
    if (!other) return;
    this.stage.use(setup.scene);
    this.state.use(setup.scene, setup.scene.start);
    this.trial = { start: setup.scene.start, duration: PREDICTED };
    void this.from(this.trial.start);
  }

  private legend(): HTMLElement {
    const entry = (name: string, colour: string) =>
      el("li", { class: "row" }, el("span", { class: `swatch ${colour}`, "aria-hidden": "true" }), name);
    return el("ul", { class: "steps" }, entry("truth", "truth"), entry(NAMES.lagrangian, "lagrangian"), entry(NAMES.plain, "plain"));
  }

  private get system(): Named {
    return { name: this.setup.scene.name, parameters: this.setup.scene.parameters };
  }

  private press(): void {
    if (this.learning) this.cancel();
    else void this.learn();
  }

  /** Lets both learn, at the same time. */
  private async learn(): Promise<void> {
    this.forget();
    this.message.clear();
    this.setLearning(true);
    this.result.textContent = "Both learn; their predictions move beside the truth. How well each keeps the energy is said at the end.";
    const round = ++this.round;
    try {
      await Promise.all(SIDES.map((side) => this.one(side)));
      await this.compare();
      this.save.disabled = false;
      this.setLearning(false);
    } catch (error) {
      if (round !== this.round) return;
      this.cancel();
      this.message.fail(error);
    }
  }

  private one(side: Side): Promise<void> {
    return this.sides[side].learn(this.task(side), () => this.trial, {
      losses: (all) => this.showLosses(side, all),
      predicted: (motion) => {
        this.motions[side] = motion;
        this.showEnergies();
      },
    });
  }

  private task(side: Side): Task {
    const { motions, starts, noise, friction, positionsOnly, width, seconds, steps, seed } = this.setup;
    const recorded = { duration: RECORDED, interval: INTERVAL, noise, friction, positions_only: positionsOnly, seed };
    const data = starts.length > 0 ? { starts } : { motions };
    const learned = side === "lagrangian" && friction > 0 ? { dissipation: true } : {};
    return {
      system: this.system,
      experiment: { ask: "experiment", of: this.system, ...data, ...recorded },
      family: side === "lagrangian" ? "lnn" : "mlp",
      settings: { width, ...learned },
      length: steps > 0 ? { steps } : { seconds },
      seed,
    };
  }

  private setLearning(learning: boolean): void {
    this.learning = learning;
    this.go.textContent = learning ? "Stop" : "Learn";
    this.element.toggleAttribute("data-learning", learning);
  }

  private cancel(): void {
    this.round += 1;
    for (const side of SIDES) {
      // What it has learned goes with its worker, and so do predictions of it.
      this.sides[side].stop();
      delete this.motions[side];
    }
    this.setLearning(false);
    this.showEnergies();
    this.result.textContent = "Learning was stopped: press Learn to begin again.";
  }

  private forget(): void {
    for (const side of SIDES) {
      delete this.losses[side];
      delete this.motions[side];
    }
    this.save.disabled = true;
    this.bar.value = 0;
    this.result.textContent = UNLEARNED;
    this.loss.show([]);
    this.showEnergies();
  }

  private showLosses(side: Side, all: Progress[]): void {
    this.losses[side] = all;
    const curve = (own: Side): Curve => {
      const points = (this.losses[own] ?? []).filter((p) => p.validation !== null);
      return { name: NAMES[own], colour: COLOURS[own], x: points.map((p) => p.seconds), y: points.map((p) => p.validation ?? NaN) };
    };
    this.loss.show(SIDES.map(curve));
    const shares = SIDES.map((own) => this.losses[own]?.at(-1)?.share ?? 0);
    this.bar.value = Math.min(...shares);
  }

  private showEnergies(): void {
    const names = { truth: "truth", ...NAMES };
    const colours = { truth: "--truth", ...COLOURS };
    const all = (["truth", ...SIDES] as const).filter((own) => this.motions[own]);
    this.energy.show(
      all.map((own) => {
        const motion = this.motions[own] as Motion;
        return { name: names[own], colour: colours[own], x: motion.t, y: motion.energy, dashed: own === "truth" };
      }),
      0.1 * this.setup.scene.reference,
    );
  }

  /** The figures at the end. */
  private async compare(): Promise<void> {
    const { scene, friction } = this.setup;
    if (friction > 0) {
      const errors = SIDES.map((side) => [side, this.largestError(side)] as const);
      this.write(errors, `How far the energy is off at most in ${PREDICTED} s, in percent of ${short(scene.reference)} J:`);
      return;
    }
    this.result.textContent = "Predicting 100 s from ten other starts …";
    const test = (side: Side): Promise<EnergyTest> => this.sides[side].energy(this.system, scene.reference);
    const tests = await Promise.all(SIDES.map(test));
    const errors = SIDES.map((side, k) => [side, tests[k]?.mean ?? NaN] as const);
    this.write(errors, "Energy error after 100 s, mean of ten other starts:");
  }

  /** In percent of the reference, along the motion that is shown: at its end all of them are at rest. */
  private largestError(side: Side): number {
    const [own, truth] = [this.motions[side]?.energy ?? [], this.motions.truth?.energy ?? []];
    const errors = own.map((energy, k) => Math.abs(energy - (truth[k] ?? NaN)));
    return (100 * Math.max(...errors)) / this.setup.scene.reference;
  }

  private write(errors: (readonly [Side, number])[], what: string): void {
    const figure = ([side, percent]: readonly [Side, number]) =>
      el("span", { class: `big ${side}-ink`, "data-side": side, "data-percent": percent }, `${NAMES[side]} ${percent > MOST ? `more than ${MOST}` : short(percent)} %`);
    this.result.replaceChildren(el("span", {}, what), ...errors.toReversed().map(figure));
  }

  private hold(state: State): void {
    this.player.pause();
    this.stage.show([{ state, colour: "--truth" }]);
    this.state.show(state);
  }

  /** All begin again from a state. */
  private async from(start: State): Promise<void> {
    this.trial = { start, duration: PREDICTED };
    this.state.show(start);
    const asked = ++this.asked;
    try {
      const { q, qd } = start;
      const known = this.system;
      const request = { ask: "simulate", by: { known }, q0: q, qd0: qd, duration: PREDICTED, interval: 1 / 30, friction: this.setup.friction };
      const truth = await this.engine.ask<Motion>(request);
      // A slider that was moved further has asked again.
      if (asked !== this.asked) return;
      this.motions.truth = truth;
      for (const side of SIDES) {
        if (!this.learning && this.motions[side]) this.motions[side] = await this.sides[side].predict(known, this.trial);
      }
      if (asked !== this.asked) return;
      this.showEnergies();
      this.player.seek(0);
      this.setMoving(!matchMedia("(prefers-reduced-motion: reduce)").matches);
    } catch (error) {
      this.message.fail(error);
    }
  }

  private setMoving(moving: boolean): void {
    if (moving) this.player.run();
    else this.player.pause();
    this.move.textContent = moving ? "Pause" : "Run";
  }

  /** The friction of the truth has changed. */
  again(): void {
    void this.from(this.trial.start);
  }

  private frame(t: number): void {
    if (this.stage.isHeld) return;
    if (t >= PREDICTED && this.player.isRunning) {
      this.player.seek(0);
      return;
    }
    const body = (own: Side | "truth"): Body[] => {
      const motion = this.motions[own];
      if (!motion || motion.t.length === 0) return [];
      return [{ state: stateAt(motion, t), colour: own === "truth" ? "--truth" : COLOURS[own] }];
    };
    this.stage.show([...SIDES.flatMap(body), ...body("truth")]);
    this.energy.mark(t);
  }

  private async download(): Promise<void> {
    try {
      const bytes = await this.sides.lagrangian.save();
      offer(bytes, `${this.setup.scene.name}.safetensors`);
    } catch (error) {
      this.message.fail(error);
    }
  }
}

/** Offers bytes as a file. */
export function offer(bytes: Uint8Array<ArrayBuffer>, name: string): void {
  const address = URL.createObjectURL(new Blob([bytes], { type: "application/octet-stream" }));
  el("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 10_000);
}
