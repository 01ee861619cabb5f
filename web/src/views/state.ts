// The state of a system by sliders: what a drag sets, without dragging.

import type { Scene, State } from "../stage/scenes";
import { type Slider, slider } from "../ui/controls";
import { el } from "../ui/element";

/** Sliders of the positions and velocities of a scene. */
export class StateSliders {
  readonly element = el("div", { class: "sliders" });
  private sliders: Slider[] = [];
  private state: State;

  constructor(
    scene: Scene,
    state: State,
    private readonly changed: (state: State) => void,
  ) {
    this.state = state;
    this.use(scene, state);
  }

  /** Those of another scene. */
  use(scene: Scene, state: State): void {
    this.state = state;
    const several = state.q.length > 1;
    const of = (kind: "q" | "qd", symbol: string) =>
      state[kind].map((value, i) => {
        const bound = scene.bounds[kind][i] ?? 1;
        const changed = (x: number) => {
          this.state = { ...this.state, [kind]: this.state[kind].with(i, x) };
          this.changed(this.state);
        };
        const unit = (scene.units[i] ?? "") + (kind === "q" ? "" : "/s");
        return slider({ label: `${symbol}${several ? i + 1 : ""} at the start`, unit, min: -bound, max: bound, step: 0.01, value, changed });
      });
    this.sliders = [...of("q", "q"), ...of("qd", "q̇")];
    this.element.replaceChildren(...this.sliders.map((own) => own.element));
  }

  /** Shows another state without telling anyone. */
  show(state: State): void {
    this.state = state;
    [...state.q, ...state.qd].forEach((value, k) => this.sliders[k]?.show(value));
  }
}
