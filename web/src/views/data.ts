// Your data: a file is looked at, checked, fitted and kept, without leaving this computer.

import type { Advanced, Begun, Checked, Inspected, Loaded, Progress, Scored, Summary } from "../engine/answers";
import { Engine } from "../engine/engine";
import { column } from "../stage/player";
import { button, select, slider, toggle } from "../ui/controls";
import { el } from "../ui/element";
import { Message, sentence } from "../ui/message";
import { Plot } from "../ui/plot";
import { type Columns, columnsForm, preview } from "./columns";
import { bare, labelled } from "./coordinates";
import { assessment, findings } from "./findings";
import { ModelPlayer } from "./model";
import { offer } from "./race";
import { reportButtons } from "./report";
import type { Entry } from "./view";

/** The most bytes of the files together, as in crates/lagrangian-web/src/limits.rs. */
const MOST_BYTES = 64 * 2 ** 20;
const COLOURS = ["--first", "--second", "--star", "--good"];
const FAMILIES: [string, string][] = [
  ["lnn", "a Lagrangian, L(q, q̇)"],
  ["delan", "a Lagrangian ½ q̇ᵀM(q)q̇ − V(q)"],
  ["mlp", "a plain network, to compare with"],
];

const NO_POSITION = "Choose at least one column as a coordinate: a model is learned from positions. Rates alone, as a gyroscope's rad/s or an accelerometer's m/s², are not enough.";

const bytes = async (file: File) => new Uint8Array(await file.arrayBuffer());

export const data: Entry = { name: "data", title: "Your data", open: (_, left) => new Data(left).element };

class Data {
  readonly element = el("div", { class: "view data" });
  private readonly engine: Engine;
  private readonly message = new Message();
  private readonly steps = el("div", { class: "view" });
  private readonly results = el("section", { class: "card", "aria-label": "Results" });
  private readonly recorded = new Plot({ title: "The first motion", x: "time, s", y: "position" });
  private columns: Columns | undefined;
  private file: File | undefined;
  private family = "lnn";
  private seconds = 20;
  private width = 64;
  private friction = false;
  private fitting = false;
  private last: Promise<void> = Promise.resolve();

  constructor(left: AbortSignal) {
    this.engine = new Engine(left);
    this.nothing("Nothing yet: drop a file, or take the example.");
    this.element.append(el("div", { class: "view" }, this.drop(), this.steps), this.results);
  }

  private drop(): HTMLElement {
    const input = el("input", { type: "file", id: "file", multiple: true, accept: ".csv,.txt,.tsv,.dat,.safetensors" });
    input.addEventListener("change", () => void this.take(input.files));
    const zone = el(
      "div",
      { class: "drop" },
      el("p", {}, "Drop a table here: CSV, also from Tracker, phyphox or a spreadsheet; several files are several motions. Or a model (.safetensors)."),
      el("div", { class: "file field" }, el("label", { for: "file" }, "Choose a file"), input),
      button("Take an example: a double pendulum", () => void this.example()),
    );
    const over = (on: boolean) => (event: Event) => {
      event.preventDefault();
      zone.classList.toggle("over", on);
    };
    zone.addEventListener("dragover", over(true));
    zone.addEventListener("dragleave", over(false));
    zone.addEventListener("drop", (event) => {
      over(false)(event);
      void this.take(event.dataTransfer?.files);
    });
    return el("section", { class: "card", "aria-label": "File" }, el("h3", {}, "A file of yours"), zone, this.message.element);
  }

  /** Does something that may fail after what is being done, and says so where it fails; a fit ends with what it has. */
  private attempt(work: () => Promise<void>): Promise<void> {
    this.fitting = false;
    this.last = this.last.then(async () => {
      this.message.clear();
      try {
        await work();
      } catch (error) {
        this.message.fail(error);
      }
    });
    return this.last;
  }

  private async take(files: FileList | null | undefined): Promise<void> {
    const [first, ...others] = files ?? [];
    if (first) await this.attempt(() => this.read(first, others));
  }

  /** Reads a model, or tables with the columns of the first: each has motions of its own. */
  private async read(first: File, others: File[] = []): Promise<void> {
    // A verdict on another file must not stay where this one is refused.
    this.steps.replaceChildren();
    this.nothing("Nothing yet: drop a file, or take the example.");
    const files = [first, ...others];
    const size = files.reduce((sum, file) => sum + file.size, 0);
    if (size > MOST_BYTES) {
      const what = others.length > 0 ? "the files have" : `'${first.name}' has`;
      throw new Error(`${what} ${Math.round(size / 2 ** 20)} MiB, at most 64 are read here: take a part, or use the command lagrangian`);
    }
    const models = files.filter((file) => /\.safetensors$/i.test(file.name));
    if (models.length > 0 && others.length > 0) throw new Error("a model is read alone: choose it without other files");
    this.file = first;
    if (models.length > 0) return this.openModel(await bytes(first));
    const inspected = await this.engine.ask<Inspected>({ ask: "inspect", name: first.name }, await bytes(first));
    for (const file of others) await this.engine.ask({ ask: "inspect", name: file.name, joins: true }, await bytes(file));
    this.look(inspected);
  }

  private example(): Promise<void> {
    return this.attempt(async () => {
      const of = { name: "double-pendulum", parameters: {} };
      await this.engine.ask({ ask: "experiment", of, motions: 30, duration: 4, interval: 0.02, noise: 0, seed: 7 });
      const table = new TextDecoder().decode(await this.engine.file({ ask: "data" }));
      await this.read(new File([table.replace("q1,q2", "theta1,theta2")], "double-pendulum.csv"));
    });
  }

  private async openModel(bytes: Uint8Array): Promise<void> {
    const model = await this.engine.ask<Loaded>({ ask: "load" }, bytes);
    const player = new ModelPlayer(this.engine, "loaded", model);
    this.show(`The model '${this.file?.name}'`, player.element);
  }

  private look(file: Inspected): void {
    const form = columnsForm(file, (columns) => this.use(columns));
    const notes = file.notes.map((note) => el("p", { class: "hint" }, `Note: ${note}.`));
    const check = button("Check the data", () => void this.check(), "main");
    const card = el("section", { class: "card", "aria-label": "Columns" }, el("h3", {}, "What the columns mean"), preview(file), ...notes, form, el("div", { class: "row" }, check));
    this.steps.replaceChildren(card);
  }

  /** Takes other columns: what was found with those before, or is being fitted to them, no longer holds. */
  private use(columns: Columns): void {
    this.columns = columns;
    this.fitting = false;
    this.nothing(columns.q.length === 0 ? NO_POSITION : "Check the data first.");
  }

  private show(title: string, ...parts: HTMLElement[]): void {
    this.results.replaceChildren(el("h3", {}, title), ...parts);
  }

  private nothing(why: string): void {
    this.show("Results", el("p", { class: "hint" }, why));
  }

  private check(): Promise<void> {
    return this.attempt(async () => {
      this.nothing("Not checked yet.");
      if (this.columns?.q.length === 0) throw new Error(NO_POSITION);
      const summary = await this.engine.ask<Summary>({ ask: "read", ...this.columns });
      const checked = await this.engine.ask<Checked>({ ask: "check" });
      const n = summary.coordinates.length;
      const q = summary.q.map((x) => x ?? NaN);
      const curve = (c: { name: string }, i: number) => ({ name: bare(c.name), colour: COLOURS[i % COLOURS.length] ?? "--truth", x: summary.t, y: column(q, i, n) });
      this.recorded.name("time, s", labelled("position", summary.coordinates));
      this.recorded.show(summary.coordinates.map(curve));
      const notes = summary.notes.map((note) => el("p", { class: "hint" }, sentence(note)));
      const said = el("p", {}, `${summary.samples} samples of ${summary.recordings} ${summary.recordings === 1 ? "motion" : "motions"}.`);
      const parts = [findings(checked), said, ...notes, this.recorded.element];
      this.show("What the check found", ...parts);
      if (checked.verdict !== "fail") this.results.append(this.fitControls());
      this.results.scrollIntoView({ block: "nearest" });
    });
  }

  private fitControls(): HTMLElement {
    const model = select("Model", FAMILIES, this.family, (family) => (this.family = family));
    const time = slider({ label: "Time to learn", unit: "s", min: 2, max: 120, step: 1, value: this.seconds, changed: (x) => (this.seconds = x) });
    const width = slider({ label: "Width of the network", min: 8, max: 128, step: 8, value: this.width, changed: (x) => (this.width = x) });
    const friction = toggle("with friction", this.friction, (on) => (this.friction = on));
    const place = el("div", { class: "card-part" });
    const go = button("Fit", () => void this.fit(go, place), "main");
    return el("div", { class: "card-part" }, el("h3", {}, "Fit a model"), el("div", { class: "row" }, model, friction), el("div", { class: "sliders" }, time.element, width.element), el("div", { class: "row" }, go), place);
  }

  private async fit(go: HTMLButtonElement, place: HTMLElement): Promise<void> {
    if (this.fitting) {
      this.fitting = false;
      return;
    }
    await this.attempt(async () => {
      this.fitting = true;
      go.textContent = "Stop and keep the best";
      const friction = this.friction && this.family !== "mlp" ? { dissipation: true } : {};
      const settings = { width: this.width, ...friction };
      const begun = await this.engine.ask<Begun>({ ask: "start", fit: { family: this.family, settings, seconds: this.seconds }, started: Date.now() });
      await this.watch(place, begun);
      await this.finish(place, begun);
    });
    this.fitting = false;
    go.textContent = "Fit again";
  }

  private async watch(place: HTMLElement, begun: Begun): Promise<void> {
    const loss = new Plot({ title: "Loss on samples that were held back", x: "training, s", y: "loss", logarithmic: true });
    const bar = el("progress", { class: "progress", max: 1, value: 0, "aria-label": "Progress of the fit" });
    place.replaceChildren(bar, loss.element, choices(begun));
    const all: Progress[] = [];
    for (let done = false; !done && this.fitting; ) {
      const advanced = await this.engine.ask<Advanced>({ ask: "advance", milliseconds: 150 });
      done = advanced.done;
      all.push(...advanced.losses);
      const points = all.filter((p) => p.validation !== null);
      loss.show([{ name: "loss", colour: "--lagrangian", x: points.map((p) => p.seconds), y: points.map((p) => p.validation ?? NaN) }]);
      bar.value = all.at(-1)?.share ?? 0;
    }
    await this.engine.ask({ ask: "finish" });
  }

  private async finish(place: HTMLElement, begun: Begun): Promise<void> {
    const scored = await this.engine.ask<Scored>({ ask: "score" });
    const bytes = await this.engine.file({ ask: "save" });
    const stem = (this.file?.name ?? "model").replace(/\.[^.]*$/, "");
    const save = button("Save the model", () => offer(bytes, `${stem}.safetensors`), "main");
    const said = new Message();
    const loaded = await this.engine.ask<Loaded>({ ask: "load" }, bytes);
    const player = new ModelPlayer(this.engine, "loaded", loaded);
    const hint = el("p", { class: "hint" }, "The command reads the same file: lagrangian score, rollout, torque, export.");
    place.append(assessment(scored), el("div", { class: "row" }, save, ...reportButtons(this.engine, `${stem}.html`, said)), said.element, hint, player.element, choices(begun));
    place.querySelector("details")?.remove();
  }
}

/** What was chosen, and why. */
function choices(begun: Begun): HTMLElement {
  const items = begun.choices.map((choice) => el("li", {}, `${choice.setting}: ${String(choice.value)}, as ${choice.reason}`));
  const summary = `Fitted to ${begun.samples} samples, validated on ${begun.validation}: the settings and their reasons`;
  return el("details", {}, el("summary", {}, summary), el("ul", {}, ...items));
}
