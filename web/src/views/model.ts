// A model of a file, to play with: a motion from any state, and the energy along it.

import type { By, Loaded, Motion } from "../engine/answers";
import type { Engine } from "../engine/engine";
import { column } from "../stage/player";
import { type Slider, short, slider } from "../ui/controls";
import { el } from "../ui/element";
import { Message } from "../ui/message";
import { Plot } from "../ui/plot";
import { bare, labelled } from "./coordinates";

const COLOURS = ["--first", "--second", "--star", "--good"];

/** Sliders for the state, and the motion that follows. */
export class ModelPlayer {
  readonly element = el("div", { class: "card-part" });
  private readonly message = new Message();
  private readonly positions: Plot;
  private readonly energy: Plot;
  private readonly said = el("p", { class: "hint", role: "status" });
  private readonly state: { q: number[]; qd: number[] };
  private asked = 0;

  constructor(
    private readonly engine: Engine,
    private readonly by: By,
    private readonly model: Loaded,
    private readonly duration = 20,
  ) {
    const n = model.coordinates.length;
    this.positions = new Plot({ title: "Predicted motion", x: "time, s", y: labelled("position", model.coordinates) });
    this.energy = new Plot({ title: "Energy of the predicted motion by the model", x: "time, s", y: model.free ? "energy, no unit" : "energy, J" });
    this.state = { q: model.coordinates.map((c) => (c.circle ? 1 : 0.3)), qd: Array.from({ length: n }, () => 0) };
    const title = el("p", {}, `${model.what} (family ${model.family}) of ${model.coordinates.map((c) => bare(c.name)).join(", ")}.`);
    const sliders = [...this.sliders("q", " at the start"), ...this.sliders("qd", ", velocity at the start")];
    this.element.append(title, el("div", { class: "sliders" }, ...sliders.map((s) => s.element)), this.message.element, this.said, this.positions.element, this.energy.element);
    void this.predict();
  }

  private sliders(kind: "q" | "qd", words: string): Slider[] {
    return this.model.coordinates.map((coordinate, i) => {
      const bound = kind === "q" ? (coordinate.circle ? Math.PI : 2) : 5;
      const unit = coordinate.unit && (kind === "q" ? coordinate.unit : `${coordinate.unit}/s`);
      const changed = (x: number) => {
        this.state[kind][i] = x;
        void this.predict();
      };
      return slider({ label: `${bare(coordinate.name)}${words}`, unit, min: -bound, max: bound, step: 0.01, value: this.state[kind][i] ?? 0, changed });
    });
  }

  private async predict(): Promise<void> {
    const asked = ++this.asked;
    const { q, qd } = this.state;
    try {
      const request = { ask: "simulate", by: this.by, q0: q, qd0: qd, duration: this.duration, interval: 1 / 50 };
      const motion = await this.engine.ask<Motion>(request);
      if (asked === this.asked) this.show(motion);
    } catch (error) {
      this.message.fail(error);
    }
  }

  private show(motion: Motion): void {
    this.message.clear();
    if (motion.ended) this.message.say(`The motion ends here: ${motion.ended}.`);
    const n = motion.coordinates.length;
    const curve = (c: { name: string }, i: number) => ({ name: bare(c.name), colour: COLOURS[i % COLOURS.length] ?? "--truth", x: motion.t, y: column(motion.q, i, n) });
    this.positions.show(motion.coordinates.map(curve));
    this.energy.element.hidden = motion.energy.length === 0;
    const start = motion.energy[0] ?? 0;
    this.energy.show([{ name: "energy", colour: "--truth", x: motion.t, y: motion.energy }], Math.abs(start) / 100 || 1);
    const [low, high] = [Math.min(...motion.energy), Math.max(...motion.energy)];
    const unit = this.model.free ? "" : " J";
    const factor = this.model.free ? " No force was recorded, so that the energy is known up to a factor and has no unit." : "";
    this.said.textContent = motion.energy.length > 0 ? `Its energy, ${short(start)}${unit}, changes by at most ${short(high - low)}${unit}.${factor}` : "A plain network has no energy.";
  }
}
