// What the library answers (crates/lagrangian-web).

export interface Axis {
  name: string;
  unit: string;
  circle: boolean;
}

export interface Motion {
  coordinates: Axis[];
  t: number[];
  /** Positions, row after row. */
  q: number[];
  qd: number[];
  energy: number[];
  action: number[];
  ended: string | null;
}

export interface Progress {
  step: number;
  share: number;
  seconds: number;
  loss: number | null;
  validation: number | null;
}

export interface Advanced {
  losses: Progress[];
  done: boolean;
  best: number | null;
}

export interface Summary {
  recordings: number;
  samples: number;
  coordinates: Axis[];
  notes: string[];
  t: number[];
  q: (number | null)[];
}

export type Verdict = "pass" | "warn" | "fail";

export interface Finding {
  name: string;
  trajectory: string | null;
  verdict: Verdict;
  finding: string;
  remedy: string | null;
}

export interface Checked {
  verdict: Verdict;
  items: Finding[];
}

export interface Inspected {
  headers: string[];
  rows: string[][];
  notes: string[];
  time: string | null;
  coordinates: string[];
  degrees: boolean;
}

export interface Choice {
  setting: string;
  value: unknown;
  reason: string;
}

export interface Begun {
  choices: Choice[];
  samples: number;
  validation: number;
}

export type Grade = "good" | "fair" | "poor";

export interface Scored {
  score: { acceleration: { nmse: number[] } | null };
  assessment: { verdict: Grade; expectation: string; reasons: { grade: Grade; finding: string; remedy: string }[] };
}

export interface Loaded {
  family: string;
  what: string;
  mechanical: boolean;
  /** Whether no force was recorded, so that its energies are known up to one factor. */
  free: boolean;
  coordinates: Axis[];
}

export interface EnergyTest {
  percent: number[];
  mean: number;
  median: number;
  worst: number;
  unfinished: number;
}

/** A system by its name and parameters. */
export interface Named {
  name: string;
  parameters: Record<string, number>;
}

/** Who moves. */
export type By = { system: string } | { known: Named } | "fitted" | "loaded";
