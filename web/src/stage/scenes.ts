// What the systems look like, and what dragging them means. Equations of motion are in the library alone.

import type { Pen, Point } from "./pen";

export interface State {
  q: number[];
  qd: number[];
}

export interface Scene {
  /** The name of the system in the library. */
  name: string;
  title: string;
  /** What to try. */
  hint: string;
  start: State;
  /** The units of its coordinates. */
  units: string[];
  /** Bounds of the sliders of positions and of velocities. */
  bounds: { q: number[]; qd: number[] };
  /** Parameters that the page sets. */
  parameters: Record<string, number>;
  /** Metres from the middle to the edge. */
  reach: number;
  /** Seconds that are predicted at a time. */
  duration: number;
  /** The energy that counts as 100 %, J. */
  reference: number;
  draw(pen: Pen, state: State, body: string): void;
  /** Where the state can be held. */
  handles(state: State): Point[];
  /** The state with that handle at a point. */
  drag(state: State, handle: number, to: Point): State;
  /** Whether friction makes sense. */
  friction: boolean;
}

const ORIGIN = { x: 0, y: 0 };
/** Seconds of motion that an arrow of velocity is long. */
const ARROW = 0.5;

function hanging(angle: number, length: number, from: Point = ORIGIN): Point {
  return { x: from.x + length * Math.sin(angle), y: from.y - length * Math.cos(angle) };
}

function angleTo(from: Point, to: Point): number {
  return Math.atan2(to.x - from.x, from.y - to.y);
}

/** The angle nearest to another that means the same. */
function near(angle: number, other: number): number {
  return angle + 2 * Math.PI * Math.round((other - angle) / (2 * Math.PI));
}

function replaced(values: number[], index: number, value: number): number[] {
  return values.map((own, k) => (k === index ? value : own));
}

const pendulum: Scene = {
  name: "pendulum",
  title: "Pendulum",
  hint: "Drag the bob. Lift it past the top and it turns over.",
  start: { q: [1.8], qd: [0] },
  units: ["rad"],
  bounds: { q: [Math.PI], qd: [8] },
  parameters: { length: 1 },
  reach: 1.35,
  duration: 20,
  reference: 19.6,
  friction: true,
  draw(pen, { q }, body) {
    const bob = hanging(q[0] ?? 0, 1);
    pen.use(body).line([ORIGIN, bob], 3).disc(bob, 13).use("--faint").disc(ORIGIN, 4);
  },
  handles: ({ q }) => [hanging(q[0] ?? 0, 1)],
  drag: ({ q }, _, to) => ({ q: [near(angleTo(ORIGIN, to), q[0] ?? 0)], qd: [0] }),
};

function joints(q: number[]): [Point, Point] {
  const elbow = hanging(q[0] ?? 0, 1);
  return [elbow, hanging(q[1] ?? 0, 1, elbow)];
}

const doublePendulum: Scene = {
  name: "double-pendulum",
  title: "Double pendulum",
  hint: "Drag either bob. From high up its motion is chaotic: the smallest change grows.",
  start: { q: [2, 2.4], qd: [0, 0] },
  units: ["rad", "rad"],
  bounds: { q: [Math.PI, Math.PI], qd: [8, 8] },
  parameters: {},
  reach: 2.4,
  duration: 30,
  reference: 29.4,
  friction: true,
  draw(pen, { q }, body) {
    const [elbow, hand] = joints(q);
    pen.use(body).line([ORIGIN, elbow, hand], 3).disc(elbow, 11).disc(hand, 13).use("--faint").disc(ORIGIN, 4);
  },
  handles: ({ q }) => joints(q),
  drag({ q }, handle, to) {
    const from = handle === 0 ? ORIGIN : joints(q)[0];
    return { q: replaced(q, handle, near(angleTo(from, to), q[handle] ?? 0)), qd: [0, 0] };
  },
};

const cartPole: Scene = {
  name: "cart-pole",
  title: "Cart and pole",
  hint: "Drag the cart or the pole. The cart answers the swing: momentum along the rail is kept.",
  start: { q: [0, 2], qd: [0, 0] },
  units: ["m", "rad"],
  bounds: { q: [1, Math.PI], qd: [2, 8] },
  parameters: { length: 0.5 },
  reach: 1.1,
  duration: 20,
  reference: 1.96,
  friction: true,
  draw(pen, { q }, body) {
    const cart = { x: q[0] ?? 0, y: 0 };
    const bob = hanging(q[1] ?? 0, 0.5, cart);
    pen.use("--grid").line([{ x: -9, y: 0 }, { x: 9, y: 0 }], 2);
    pen.use(body).box(cart, 26, 13).line([cart, bob], 3).disc(bob, 11).use("--surface").disc(cart, 3);
  },
  handles: ({ q }) => [{ x: q[0] ?? 0, y: 0 }, hanging(q[1] ?? 0, 0.5, { x: q[0] ?? 0, y: 0 })],
  drag({ q }, handle, to) {
    const cart = { x: q[0] ?? 0, y: 0 };
    const value = handle === 0 ? Math.max(-1, Math.min(1, to.x)) : near(angleTo(cart, to), q[1] ?? 0);
    return { q: replaced(q, handle, value), qd: [0, 0] };
  },
};

const WALL = { x: -1.3, y: 0 };

const spring: Scene = {
  name: "mass-spring",
  title: "Mass on a spring",
  hint: "Pull the mass. However far, the period is the same.",
  start: { q: [0.8], qd: [0] },
  units: ["m"],
  bounds: { q: [1], qd: [2] },
  parameters: { stiffness: 4 },
  reach: 1.45,
  duration: 20,
  reference: 2,
  friction: true,
  draw(pen, { q }, body) {
    const mass = { x: q[0] ?? 0, y: 0 };
    const turn = (k: number): Point => ({
      x: WALL.x + ((mass.x - WALL.x) * k) / 24,
      y: k < 2 || k > 22 ? 0 : k % 2 === 0 ? 0.09 : -0.09,
    });
    pen.use("--grid").line([{ x: -1.3, y: -0.4 }, { x: -1.3, y: 0.4 }], 5);
    pen.use("--faint").line(Array.from({ length: 25 }, (_, k) => turn(k)), 2);
    pen.use(body).box(mass, 20, 20);
  },
  handles: ({ q }) => [{ x: q[0] ?? 0, y: 0 }],
  drag: (_, __, to) => ({ q: [Math.max(-1, Math.min(1, to.x))], qd: [0] }),
};

function tip({ q, qd }: State): Point {
  return { x: (q[0] ?? 0) + ARROW * (qd[0] ?? 0), y: (q[1] ?? 0) + ARROW * (qd[1] ?? 0) };
}

/** A particle in the plane, with its velocity as an arrow. */
const planar = {
  handles: (state: State) => [{ x: state.q[0] ?? 0, y: state.q[1] ?? 0 }, tip(state)],
  drag({ q, qd }: State, handle: number, to: Point): State {
    if (handle === 0) return { q: [to.x, to.y], qd };
    return { q, qd: [(to.x - (q[0] ?? 0)) / ARROW, (to.y - (q[1] ?? 0)) / ARROW] };
  },
};

function particle(pen: Pen, state: State, body: string): void {
  const at = { x: state.q[0] ?? 0, y: state.q[1] ?? 0 };
  pen.use(body, 0.75).arrow(at, tip(state)).use(body).disc(at, 10);
}

const kepler: Scene = {
  name: "kepler",
  title: "Planet and star",
  hint: "Drag the planet, or the tip of its velocity. Equal areas in equal times.",
  start: { q: [1, 0], qd: [0, 0.85] },
  units: ["m", "m"],
  bounds: { q: [1.5, 1.5], qd: [1.3, 1.3] },
  parameters: {},
  reach: 1.8,
  duration: 30,
  reference: 0.5,
  friction: false,
  draw(pen, state, body) {
    pen.use("--star", 0.25).disc(ORIGIN, 18).use("--star").disc(ORIGIN, 10);
    particle(pen, state, body);
  },
  ...planar,
};

const charged: Scene = {
  name: "charged-particle",
  title: "Charged particle",
  hint: "Drag the tip of the velocity. A magnetic field turns it and does no work.",
  start: { q: [1, 0], qd: [0, -1] },
  units: ["m", "m"],
  bounds: { q: [2, 2], qd: [2, 2] },
  parameters: { magnetic: 1, electric: 0.15 },
  reach: 3.2,
  duration: 30,
  reference: 2,
  friction: false,
  draw(pen, state, body) {
    for (let x = -6; x <= 6; x++) for (let y = -6; y <= 6; y++) pen.use("--grid").disc({ x, y }, 2);
    particle(pen, state, body);
  },
  ...planar,
};

const relativistic: Scene = {
  name: "relativistic-particle",
  title: "Relativistic particle",
  hint: "Drag it, or give it a velocity: a constant force never makes it as fast as light (c = 1).",
  start: { q: [-6], qd: [-0.9] },
  units: ["m"],
  bounds: { q: [8], qd: [0.99] },
  parameters: { field: 0.6 },
  reach: 9,
  duration: 12,
  reference: 2,
  friction: false,
  draw(pen, { q, qd }, body) {
    const at = { x: q[0] ?? 0, y: 0 };
    pen.use("--grid").line([{ x: -30, y: 0 }, { x: 30, y: 0 }], 2);
    for (let x = -20; x <= 20; x += 2) pen.line([{ x, y: -0.2 }, { x, y: 0.2 }], 2);
    pen.use("--faint").line([at, { x: at.x + 3 * Math.sign(qd[0] ?? 1), y: 0 }], 1, true);
    pen.use(body).arrow(at, { x: at.x + 3 * (qd[0] ?? 0), y: 0 }).disc(at, 11);
  },
  handles: ({ q }) => [{ x: q[0] ?? 0, y: 0 }],
  drag: ({ qd }, _, to) => ({ q: [Math.max(-8, Math.min(8, to.x))], qd }),
};

export const SCENES: Scene[] = [pendulum, doublePendulum, cartPole, spring, kepler, charged, relativistic];

/** The scene of this name, or the first. */
export function scene(name: string | undefined): Scene {
  return SCENES.find((own) => own.name === name) ?? (SCENES[0] as Scene);
}
