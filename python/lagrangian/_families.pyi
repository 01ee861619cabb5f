# Made by python/tools/stubs.py from the tables of settings of the library.
import os
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from ._estimators import Estimator

COMMON: dict[str, tuple[Any, str]]
TABLES: dict[str, Any]
CLASSES: dict[str, str]
ESTIMATORS: dict[str, type[Estimator]]

class Best(Estimator):
    """The best of several models, compared on held-out data.
    
    Args:
        form: Any Lagrangian, or one convex in q̇, whose mass matrix is positive everywhere. One of ``free``, ``convex``. Default: free; convex where the data are noisy.
        speed_chart: What the network sees of q̇ below `speed_limit`: artanh(q̇/c), for Lagrangians that grow without bound towards c, or arcsin(q̇/c), for those that stay finite there. One of ``artanh``, ``arcsin``. Default: artanh.
        exponential: Give the network exponential units, for masses that span decades.
        trunks: Whether M and V are read off the same hidden layers. One of ``shared``, ``separate``. Default: shared.
        vector_potential: Give the Lagrangian the term A(q)·q̇, for gyroscopic and magnetic forces.
        speed_limit: A speed that no coordinate reaches, in their unit a second: the network of a Lagrangian then sees artanh(q̇/c) in place of q̇ (see `speed_chart`), that of a Hamiltonian arsinh(p/s), s the median |p|. A number above 0, from 1e-12 to 1e12.
        structure: Any Hamiltonian, one with a mass matrix, or none: the plain flow (q, q̇) → (q̇, q̈) to compare with. One of ``free``, ``mass``, ``none``. Default: free.
        momenta: What a Hamiltonian network takes for momenta: recorded ones (columns p1, p2, …), or the velocities in their place. One of ``recorded``, ``velocities``. Default: recorded, or p = m q̇ with masses.
        masses: Masses m of p = m q̇, one for each coordinate. Numbers above 0, from 1e-9 to 1e9.
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        order: Order of a neural ODE: (q, q̇) → (q̇, q̈), or q̈ alone. One of ``first``, ``second``. Default: second.
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        searches: The number of searches for the joints, each from other random directions. A whole number from 1. Default: 16.
        friction: The terms of the friction of gears (arXiv 2410.08650). One of ``m1``, ``m2``, ``m3``, ``m4``, ``m5``, ``m6``. Default: by held-out motions.
        weight: The moment m g l of the first link's weight, N·m: without a torque only ratios to it are learned. A number above 0, from 1e-9 to 1e9. Default: 1.
        constraints: The constraints between the coordinates; a file is one that `lagrangian constraints --json` wrote. One of ``find``, ``none``, or a document. Default: find.
        neighbours: The differences of the indices of neighbours, such as 1 in a chain, or 1 and 32 in a grid of rows of 32. Numbers above 0, from 1 to 1e6. Default: found.
        ends: What bounds the sites. One of ``find``, ``ring``, ``walls``, ``free``. Default: find.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
        urdf: URDF of the robot: a file, its text, or the name of an example.
    """
    form: Literal["free", "convex"] | None
    speed_chart: Literal["artanh", "arcsin"] | None
    exponential: bool | None
    trunks: Literal["shared", "separate"] | None
    vector_potential: bool | None
    speed_limit: float | None
    structure: Literal["free", "mass", "none"] | None
    momenta: Literal["recorded", "velocities"] | None
    masses: Sequence[float] | None
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    order: Literal["first", "second"] | None
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    searches: int | None
    friction: Literal["m1", "m2", "m3", "m4", "m5", "m6"] | None
    weight: float | None
    constraints: str | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None
    neighbours: Sequence[float] | None
    ends: Literal["find", "ring", "walls", "free"] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    urdf: str | os.PathLike[str] | None
    def __init__(
        self,
        *,
        form: Literal["free", "convex"] | None = ...,
        speed_chart: Literal["artanh", "arcsin"] | None = ...,
        exponential: bool | None = ...,
        trunks: Literal["shared", "separate"] | None = ...,
        vector_potential: bool | None = ...,
        speed_limit: float | None = ...,
        structure: Literal["free", "mass", "none"] | None = ...,
        momenta: Literal["recorded", "velocities"] | None = ...,
        masses: Sequence[float] | None = ...,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        order: Literal["first", "second"] | None = ...,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        searches: int | None = ...,
        friction: Literal["m1", "m2", "m3", "m4", "m5", "m6"] | None = ...,
        weight: float | None = ...,
        constraints: str | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = ...,
        neighbours: Sequence[float] | None = ...,
        ends: Literal["find", "ring", "walls", "free"] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
        urdf: str | os.PathLike[str] | None = ...,
    ) -> None: ...

class Lnn(Estimator):
    """Lagrangian neural network: any function of q and q̇.
    
    Args:
        form: Any Lagrangian, or one convex in q̇, whose mass matrix is positive everywhere. One of ``free``, ``convex``. Default: free; convex where the data are noisy.
        speed_limit: A speed that no coordinate reaches, in their unit a second: the network of a Lagrangian then sees artanh(q̇/c) in place of q̇ (see `speed_chart`), that of a Hamiltonian arsinh(p/s), s the median |p|. A number above 0, from 1e-12 to 1e12.
        speed_chart: What the network sees of q̇ below `speed_limit`: artanh(q̇/c), for Lagrangians that grow without bound towards c, or arcsin(q̇/c), for those that stay finite there. One of ``artanh``, ``arcsin``. Default: artanh.
        exponential: Give the network exponential units, for masses that span decades.
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    form: Literal["free", "convex"] | None
    speed_limit: float | None
    speed_chart: Literal["artanh", "arcsin"] | None
    exponential: bool | None
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        form: Literal["free", "convex"] | None = ...,
        speed_limit: float | None = ...,
        speed_chart: Literal["artanh", "arcsin"] | None = ...,
        exponential: bool | None = ...,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Delan(Estimator):
    """deep Lagrangian network: ½ q̇ᵀM(q)q̇ − V(q), M positive definite by construction; for robots.
    
    Args:
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        trunks: Whether M and V are read off the same hidden layers. One of ``shared``, ``separate``. Default: shared.
        vector_potential: Give the Lagrangian the term A(q)·q̇, for gyroscopic and magnetic forces.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    trunks: Literal["shared", "separate"] | None
    vector_potential: bool | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        trunks: Literal["shared", "separate"] | None = ...,
        vector_potential: bool | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Vin(Estimator):
    """variational integrator network: ½ q̇ᵀMq̇ − V(q) with a constant M, of positions alone.
    
    Args:
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        vector_potential: Give the Lagrangian the term A(q)·q̇, for gyroscopic and magnetic forces.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    vector_potential: bool | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        vector_potential: bool | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Hnn(Estimator):
    """Hamiltonian network H(q, p), fitted to (q̇, ṗ) or to motions in (q, p).
    
    Args:
        speed_limit: A speed that no coordinate reaches, in their unit a second: the network of a Lagrangian then sees artanh(q̇/c) in place of q̇ (see `speed_chart`), that of a Hamiltonian arsinh(p/s), s the median |p|. A number above 0, from 1e-12 to 1e12.
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        structure: Any Hamiltonian, one with a mass matrix, or none: the plain flow (q, q̇) → (q̇, q̈) to compare with. One of ``free``, ``mass``, ``none``. Default: free.
        momenta: What a Hamiltonian network takes for momenta: recorded ones (columns p1, p2, …), or the velocities in their place. One of ``recorded``, ``velocities``. Default: recorded, or p = m q̇ with masses.
        masses: Masses m of p = m q̇, one for each coordinate. Numbers above 0, from 1e-9 to 1e9.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    speed_limit: float | None
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    structure: Literal["free", "mass", "none"] | None
    momenta: Literal["recorded", "velocities"] | None
    masses: Sequence[float] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        speed_limit: float | None = ...,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        structure: Literal["free", "mass", "none"] | None = ...,
        momenta: Literal["recorded", "velocities"] | None = ...,
        masses: Sequence[float] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Mlp(Estimator):
    """plain network, to compare with: (q, q̇, τ) → q̈, or (q, q̇, q̈) → τ under a loss of torques.
    
    Args:
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class NeuralOde(Estimator):
    """neural ordinary differential equation: a plain network trained through its integrator.
    
    Args:
        width: Units in each hidden layer. A whole number from 1. Default: 64; 16 for delan and vin where the data are noisy.
        layers: Hidden layers. A whole number from 1. Default: 2.
        activation: Activation of the hidden layers. One of ``softplus``, ``tanh``, ``gelu``, ``xtanh``, ``square``. Default: softplus.
        order: Order of a neural ODE: (q, q̇) → (q̇, q̈), or q̈ alone. One of ``first``, ``second``. Default: second.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    width: int | None
    layers: int | None
    activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None
    order: Literal["first", "second"] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        width: int | None = ...,
        layers: int | None = ...,
        activation: Literal["softplus", "tanh", "gelu", "xtanh", "square"] | None = ...,
        order: Literal["first", "second"] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Rigid(Estimator):
    """rigid bodies, identified by least squares from torques: a planar chain, or the robot of a description.
    
    Args:
        dissipation: Learn viscous and Coulomb friction too.
        forces: Learn these forces too, separated by commas. Some of ``viscous``, ``drag``, ``coulomb``, ``stribeck``, ``load``, ``directional``, ``quadratic``, ``offset``, ``rotor``, ``gains``, ``input-matrix``.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
        urdf: URDF of the robot: a file, its text, or the name of an example.
    """
    dissipation: bool | None
    forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    urdf: str | os.PathLike[str] | None
    def __init__(
        self,
        *,
        dissipation: bool | None = ...,
        forces: Sequence[Literal["viscous", "drag", "coulomb", "stribeck", "load", "directional", "quadratic", "offset", "rotor", "gains", "input-matrix"]] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
        urdf: str | os.PathLike[str] | None = ...,
    ) -> None: ...

class Chain(Estimator):
    """a robot from its log alone: a serial chain whose joints are searched for and whose bodies are identified.
    
    Args:
        searches: The number of searches for the joints, each from other random directions. A whole number from 1. Default: 16.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    searches: int | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        searches: int | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Servo(Estimator):
    """a planar chain with position-controlled motors and friction of gears, from goals instead of torques.
    
    Args:
        friction: The terms of the friction of gears (arXiv 2410.08650). One of ``m1``, ``m2``, ``m3``, ``m4``, ``m5``, ``m6``. Default: by held-out motions.
        weight: The moment m g l of the first link's weight, N·m: without a torque only ratios to it are learned. A number above 0, from 1e-9 to 1e9. Default: 1.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    friction: Literal["m1", "m2", "m3", "m4", "m5", "m6"] | None
    weight: float | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        friction: Literal["m1", "m2", "m3", "m4", "m5", "m6"] | None = ...,
        weight: float | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Formula(Estimator):
    """a Lagrangian in closed form: a few terms, found in the motion, with their standard errors.
    
    Args:
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Cartesian(Estimator):
    """points in Cartesian coordinates: the rods that join them or the forces between them, and their masses.
    
    Args:
        constraints: The constraints between the coordinates; a file is one that `lagrangian constraints --json` wrote. One of ``find``, ``none``, or a document. Default: find.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    constraints: str | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        constraints: str | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...

class Lattice(Estimator):
    """many sites that obey one law with their neighbours: chains, rings, grids.
    
    Args:
        neighbours: The differences of the indices of neighbours, such as 1 in a chain, or 1 and 32 in a grid of rows of 32. Numbers above 0, from 1 to 1e6. Default: found.
        ends: What bounds the sites. One of ``find``, ``ring``, ``walls``, ``free``. Default: find.
        loss: What is compared with the data. One of ``acceleration``, ``acceleration-relative``, ``acceleration-l1``, ``torque``, ``torque-l1``, ``torque-acceleration``, ``torque-power``, ``positions``, ``positions-trapezoidal``, ``rollout``. Default: acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and accelerations certain to 0.5 %.
        optimizer: Natural gradient, or Adam. One of ``natural``, ``adam``. Default: natural; adam where the data are noisy and accelerations or torques compared.
        batch: Samples in a batch. A whole number from 1. Default: natural gradient 128 by time and 256 by steps, Adam 512.
        batch_first: Samples of the first batch, growing to `batch`: for the shortest fits. A whole number from 1. Default: as many as later.
        damping: How the damping of the natural gradient falls. One of ``schedule``, ``loss``, ``adaptive``. Default: loss for a fit by time, schedule for one by steps or under the loss rollout.
        learning_rate: Learning rate at the start. A number above 0, from 1e-12 to 1000. Default: by the optimiser.
        weight_decay: Weight decay of Adam. A number 0 or above, at most 1000. Default: 0.
        forward: Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all torques and that of all accelerations times this weight; 0 adds none. A number 0 or above, at most 1e6. Default: 0.00015.
        patience: Number of validations without improvement, one every 25 steps, after which the fit ends. A whole number from 1.
        horizon: Samples that are predicted from each start. A whole number from 1. Default: 5.
        integrator: Method that a model is trained through. One of ``rk4``, ``stormer-verlet``, ``implicit-midpoint``. Default: rk4.
        substeps: Its steps from one sample to the next. A whole number from 1. Default: 1.
        observe: What of a rollout is compared with the data. One of ``states``, ``positions``. Default: states.
        starts: Start each segment at the recorded state, or at one that is learned with the weights (noisy data). One of ``recorded``, ``free``. Default: recorded.
        growth: Part of the fit in which the horizon grows from 1. A number 0 or above, at most 0.9. Default: 0.5.
        warm_start: Part of the fit in which accelerations are fitted first. A number 0 or above, at most 0.9. Default: 0.
        steps: The number of steps; the same seed then gives the same bits.
        seconds: The number of seconds, 60 by default.
        seed: Seed of weights, split and batches.
        validate_fraction: Part of the data that is held back for validation, where no other is given.
        smooth: Smooth measured q and q̇ over windows that are chosen from the data.
        low_pass: Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default.
        baseline: Distance of neighbours of a loss of positions, in samples.
        delay: Delays of the forces, s: one for all coordinates, or one for each.
        cyclic: Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default they are found where several models are tried.
        nominal: URDF of a nominal model, whose omissions a network learns.
        joints: Joints of the robot in the order of the data.
    """
    neighbours: Sequence[float] | None
    ends: Literal["find", "ring", "walls", "free"] | None
    loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None
    optimizer: Literal["natural", "adam"] | None
    batch: int | None
    batch_first: int | None
    damping: Literal["schedule", "loss", "adaptive"] | None
    learning_rate: float | None
    weight_decay: float | None
    forward: float | None
    patience: int | None
    horizon: int | None
    integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None
    substeps: int | None
    observe: Literal["states", "positions"] | None
    starts: Literal["recorded", "free"] | None
    growth: float | None
    warm_start: float | None
    steps: int | None
    seconds: float | None
    seed: int
    validate_fraction: float
    smooth: bool
    low_pass: float | None
    baseline: int
    delay: float | Sequence[float]
    cyclic: str | Sequence[str]
    nominal: str | os.PathLike[str] | None
    joints: Sequence[str]
    def __init__(
        self,
        *,
        neighbours: Sequence[float] | None = ...,
        ends: Literal["find", "ring", "walls", "free"] | None = ...,
        loss: Literal["acceleration", "acceleration-relative", "acceleration-l1", "torque", "torque-l1", "torque-acceleration", "torque-power", "positions", "positions-trapezoidal", "rollout"] | None = ...,
        optimizer: Literal["natural", "adam"] | None = ...,
        batch: int | None = ...,
        batch_first: int | None = ...,
        damping: Literal["schedule", "loss", "adaptive"] | None = ...,
        learning_rate: float | None = ...,
        weight_decay: float | None = ...,
        forward: float | None = ...,
        patience: int | None = ...,
        horizon: int | None = ...,
        integrator: Literal["rk4", "stormer-verlet", "implicit-midpoint"] | None = ...,
        substeps: int | None = ...,
        observe: Literal["states", "positions"] | None = ...,
        starts: Literal["recorded", "free"] | None = ...,
        growth: float | None = ...,
        warm_start: float | None = ...,
        steps: int | None = ...,
        seconds: float | None = ...,
        seed: int = ...,
        validate_fraction: float = ...,
        smooth: bool = ...,
        low_pass: float | None = ...,
        baseline: int = ...,
        delay: float | Sequence[float] = ...,
        cyclic: str | Sequence[str] = ...,
        nominal: str | os.PathLike[str] | None = ...,
        joints: Sequence[str] = ...,
    ) -> None: ...
