// One model that learns in a worker of its own, watched while it does.

import type { Advanced, Begun, EnergyTest, Motion, Named, Progress } from "../engine/answers";
import { Engine } from "../engine/engine";
import type { State } from "../stage/scenes";

/** What is learned, and from what. */
export interface Task {
  system: Named;
  /** The request that makes the data. */
  experiment: object;
  family: "lnn" | "mlp";
  settings: Record<string, unknown>;
  length: { seconds: number } | { steps: number };
  seed: number;
}

/** The motion by which it is watched. */
export interface Trial {
  start: State;
  duration: number;
}

export interface Watching {
  losses(all: Progress[]): void;
  predicted(motion: Motion): void;
}

/** Milliseconds of training between two looks. */
const SLICE = 120;
/** Milliseconds between two predictions. */
const LOOK = 1200;

export class Contestant {
  private readonly engine: Engine;
  private losses: Progress[] = [];
  begun: Begun | undefined;

  constructor(left: AbortSignal) {
    this.engine = new Engine(left);
  }

  /** Learns to the end. */
  async learn(task: Task, trial: () => Trial, watching: Watching): Promise<void> {
    await this.engine.ask(task.experiment);
    const { family, settings, length, seed } = task;
    this.begun = await this.engine.ask<Begun>({ ask: "start", fit: { family, settings, ...length, seed } });
    this.losses = [];
    for (let done = false, looked = -Infinity; !done; ) {
      const advanced = await this.engine.ask<Advanced>({ ask: "advance", milliseconds: SLICE });
      done = advanced.done;
      this.losses.push(...advanced.losses);
      watching.losses(this.losses);
      if (done || performance.now() - looked > LOOK) {
        watching.predicted(await this.predict(task.system, trial()));
        looked = performance.now();
      }
    }
  }

  /** The motion of the model, with the energy that the system has there. */
  predict(system: Named, trial: Trial): Promise<Motion> {
    const { q, qd } = trial.start;
    const request = { by: "fitted", q0: q, qd0: qd, duration: trial.duration, interval: 1 / 30, energy_of: system };
    return this.engine.ask<Motion>({ ask: "simulate", ...request });
  }

  /** How well it keeps the energy of the system in motions that it has not seen. */
  energy(system: Named, reference: number): Promise<EnergyTest> {
    return this.engine.ask<EnergyTest>({ ask: "energy", of: system, starts: 10, duration: 100, reference, seed: 1 });
  }

  /** The bytes of the model. */
  save(): Promise<Uint8Array<ArrayBuffer>> {
    return this.engine.file({ ask: "save" });
  }

  stop(): void {
    this.engine.stop();
  }
}
