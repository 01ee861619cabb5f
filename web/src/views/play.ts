// Play: set the state of a system by hand, and see its motion, its energy and its phase portrait.

import type { Motion } from "../engine/answers";
import { Engine } from "../engine/engine";
import { Player, column, stateAt, wrapped } from "../stage/player";
import { SCENES, type Scene, type State, scene } from "../stage/scenes";
import { type Body, Stage } from "../stage/stage";
import * as address from "../ui/address";
import { button, select, short, slider } from "../ui/controls";
import { el } from "../ui/element";
import { Message } from "../ui/message";
import { type Curve, Plot, type Spot } from "../ui/plot";
import { labelled } from "./coordinates";
import { StateSliders } from "./state";
import type { Entry } from "./view";

/** Seconds of its way that a body leaves behind. */
const TRAIL = 2.5;
const COLOURS = ["--first", "--second"];
/** What is said of the motion at each instant. */
const FIGURES = ["time", "energy H", "action ∫ L dt", "position q", "velocity q̇"];

export const play: Entry = { name: "play", title: "Play", open: (values, left) => new Play(values, left).element };

class Play {
  readonly element = el("div", { class: "view play" });
  private readonly engine: Engine;
  private readonly message = new Message();
  private readonly stage: Stage;
  private readonly energy = new Plot({ title: "Energy", x: "time, s", y: "energy, J" });
  private readonly phase = new Plot({ title: "Phase portrait", x: "position", y: "velocity" });
  private readonly names = FIGURES.map((name) => el("dt", {}, name));
  private readonly values = FIGURES.map(() => el("dd"));
  private readonly figures = el("dl", { class: "figures" }, ...this.names.map((name, i) => el("div", {}, name, this.values[i])));
  private readonly state: StateSliders;
  private readonly hint = el("p", { class: "hint" });
  private readonly run = button("Pause", () => this.toggle());
  private readonly player: Player;
  private scene: Scene;
  private start: State;
  private friction: number;
  private motion: Motion | undefined;
  private asked = 0;

  constructor(values: address.Values, left: AbortSignal) {
    this.engine = new Engine(left);
    this.player = new Player((t) => this.frame(t), left);
    this.scene = scene(values["system"]);
    this.start = {
      q: address.numbers(values["q"], this.scene.start.q),
      qd: address.numbers(values["qd"], this.scene.start.qd),
    };
    this.friction = address.number(values["friction"], 0, 0, 1);
    this.stage = new Stage(this.scene, {
      moved: (state) => this.hold(state),
      released: (state) => void this.begin(state, true),
    });
    this.state = new StateSliders(this.scene, this.start, (state) => void this.begin(state, this.player.isRunning));
    this.build();
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    void this.begin(this.start, !still);
  }

  private build(): void {
    const systems = SCENES.map((own): [string, string] => [own.name, own.title]);
    const chosen = select("System", systems, this.scene.name, (name) => this.change(scene(name)));
    const again = button("Begin again", () => void this.begin(this.start, true));
    const controls = el("div", { class: "row" }, chosen, this.run, again);
    const left = el("section", { class: "card", "aria-label": "Stage" }, controls, this.stage.canvas, this.hint, this.message.element, this.state.element);
    const right = el("section", { class: "card plots", "aria-label": "Figures" }, this.figures, this.energy.element, this.phase.element);
    this.element.append(left, right);
    this.writeSliders();
  }

  private change(next: Scene): void {
    this.scene = next;
    this.friction = 0;
    this.motion = undefined;
    this.player.pause();
    this.values.forEach((place) => (place.textContent = ""));
    this.stage.use(next);
    this.start = next.start;
    this.writeSliders();
    void this.begin(next.start, true);
  }

  private writeSliders(): void {
    this.hint.textContent = this.scene.hint;
    this.state.use(this.scene, this.start);
    const friction = slider({
      label: "Friction",
      min: 0,
      max: 1,
      step: 0.01,
      value: this.friction,
      changed: (x) => {
        this.friction = x;
        void this.begin(this.start, this.player.isRunning);
      },
    });
    if (this.scene.friction) this.state.element.append(friction.element);
  }

  /** While the system is held, it is where the hand is. */
  private hold(state: State): void {
    this.player.pause();
    this.stage.show([{ state, colour: "--truth" }]);
    this.showStart(state);
  }

  private showStart(state: State): void {
    this.start = state;
    this.state.show(state);
    const q = state.q.map((x) => x.toFixed(3)).join(",");
    const qd = state.qd.map((x) => x.toFixed(3)).join(",");
    const values: address.Values = { system: this.scene.name, q, qd };
    if (this.friction > 0) values["friction"] = this.friction.toFixed(2);
    address.write("play", values);
  }

  /** Predicts from a state, and shows it from now on. */
  private async begin(state: State, running: boolean): Promise<void> {
    this.showStart(state);
    const asked = ++this.asked;
    try {
      const motion = await this.predict(state);
      if (asked !== this.asked || this.stage.isHeld) return;
      this.message.clear();
      if (motion.ended) this.message.say(`The motion ends here: ${motion.ended}.`);
      this.motion = motion;
      this.showFigures(motion);
      this.player.seek(0);
      this.setRunning(running);
    } catch (error) {
      this.message.fail(error);
    }
  }

  private predict(state: State): Promise<Motion> {
    const known = { name: this.scene.name, parameters: this.scene.parameters };
    const request = { q0: state.q, qd0: state.qd, duration: this.scene.duration, friction: this.friction };
    return this.engine.ask<Motion>({ ask: "simulate", by: { known }, ...request });
  }

  private showFigures(motion: Motion): void {
    const n = motion.coordinates.length;
    this.names[3]?.replaceChildren(labelled("position q", motion.coordinates));
    this.names[4]?.replaceChildren(labelled("velocity q̇", motion.coordinates, "/s"));
    this.phase.name(labelled("position", motion.coordinates), labelled("velocity", motion.coordinates, "/s"));
    const energy = { name: "energy", colour: "--truth", x: motion.t, y: motion.energy };
    this.energy.show([energy], 0.2 * this.scene.reference);
    const name = (i: number) => motion.coordinates[i]?.name ?? "";
    const positions = (i: number) => {
      const all = column(motion.q, i, n);
      return motion.coordinates[i]?.circle ? wrapped(all) : all;
    };
    const curve = (i: number): Curve => ({
      name: n > 1 ? name(i) : "motion",
      colour: COLOURS[i] ?? "--truth",
      x: positions(i),
      y: column(motion.qd, i, n),
    });
    this.phase.show(Array.from({ length: n }, (_, i) => curve(i)));
  }

  private toggle(): void {
    const ended = this.motion && this.player.time >= (this.motion.t.at(-1) ?? 0);
    if (ended) this.player.seek(0);
    this.setRunning(!this.player.isRunning);
  }

  private setRunning(running: boolean): void {
    if (running) this.player.run();
    else this.player.pause();
    this.run.textContent = running ? "Pause" : "Run";
  }

  private frame(t: number): void {
    const motion = this.motion;
    if (!motion) return;
    const end = motion.t.at(-1) ?? 0;
    if (t >= end && this.player.isRunning) this.setRunning(false);
    const now = Math.min(t, end);
    const state = stateAt(motion, now);
    const body: Body = { state, colour: "--truth", trail: this.trail(motion, now) };
    this.stage.show([body]);
    this.energy.mark(now);
    this.phase.spot(state.q.map((q, i) => this.spot(motion, i, q, state.qd[i] ?? NaN)));
    this.write(motion, now);
  }

  /** Where coordinate i is in the phase portrait. */
  private spot(motion: Motion, i: number, q: number, qd: number): Spot {
    const [x = q] = motion.coordinates[i]?.circle ? wrapped([q]) : [q];
    return { x, y: qd, colour: COLOURS[i] ?? "--truth" };
  }

  private trail(motion: Motion, now: number): Body["trail"] {
    const steps = 60;
    const handle = this.scene.handles(stateAt(motion, now)).length > 1 && this.start.q.length === 2 && this.scene.friction ? 1 : 0;
    const times = Array.from({ length: steps }, (_, k) => now - (TRAIL * k) / steps).filter((t) => t >= 0);
    return times.flatMap((t) => this.scene.handles(stateAt(motion, t))[handle] ?? []);
  }

  /** The figures beside the stage. */
  private write(motion: Motion, now: number): void {
    const k = motion.t.findLastIndex((t) => t <= now);
    const state = stateAt(motion, now);
    const values = [
      `${now.toFixed(1)} s`,
      `${short(motion.energy[k] ?? NaN)} J`,
      `${short(motion.action[k] ?? NaN)} J s`,
      state.q.map(short).join(", "),
      state.qd.map(short).join(", "),
    ];
    values.forEach((value, i) => {
      const place = this.values[i];
      if (place && place.textContent !== value) place.textContent = value;
    });
  }
}
