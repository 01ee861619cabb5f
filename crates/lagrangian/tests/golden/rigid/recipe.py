"""Golden values of rigid-body dynamics, from Pinocchio.

    pip install pin==4.1.0 numpy
    python recipe.py            writes <robot>.json beside this file

For each robot, 20 random states: mass matrix (CRBA), bias (RNEA with zero acceleration), gravity torque, inverse
dynamics (RNEA), forward dynamics (ABA), kinetic and potential energy. Joints that are not listed are locked at 0.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin

HERE = Path(__file__).parent
ROBOTS = HERE / "../../../../lagrangian-mechanics/src/rigid/robots"
STATES = 20


def locked(model, joints):
    others = [i for i, name in enumerate(model.names) if i and name not in joints]
    return pin.buildReducedModel(model, others, pin.neutral(model)) if others else model


def configuration(model, angles):
    """Pinocchio keeps cos and sin of continuous joints."""
    q = pin.neutral(model)
    for joint, angle in zip(model.joints[1:], angles):
        if joint.nq == 2:
            q[joint.idx_q : joint.idx_q + 2] = np.cos(angle), np.sin(angle)
        else:
            q[joint.idx_q] = angle
    return q


def state(model, rng):
    angles, v, a, force = (rng.uniform(-size, size, model.nv) for size in (3.0, 2.0, 5.0, 20.0))
    q, data = configuration(model, angles), model.createData()
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    return {
        "q": list(angles),
        "qd": list(v),
        "qdd": list(a),
        "tau": list(force),
        "mass_matrix": mass.ravel().tolist(),
        "bias": pin.nonLinearEffects(model, data, q, v).tolist(),
        "gravity": pin.computeGeneralizedGravity(model, data, q).tolist(),
        "inverse": pin.rnea(model, data, q, v, a).tolist(),
        "forward": pin.aba(model, data, q, v, force).tolist(),
        "kinetic": pin.computeKineticEnergy(model, data, q, v),
        "potential": pin.computePotentialEnergy(model, data, q),
    }


def write(name, path, joints=None):
    model = pin.buildModelFromUrdf(str(path))
    model = locked(model, joints) if joints else model
    rng = np.random.default_rng(7)
    head = {
        "source": f"Pinocchio {pin.__version__}, gravity (0, 0, -9.81)",
        "joints": list(model.names)[1:],
    }
    # One state a line.
    states = ",\n".join(json.dumps(state(model, rng)) for _ in range(STATES))
    text = json.dumps(head)[:-1] + ', "states": [\n' + states + "\n]}\n"
    json.loads(text)
    (HERE / f"{name}.json").write_text(text)


if __name__ == "__main__":
    for name in ("two_link_arm", "ur5", "panda", "iiwa7"):
        write(name, ROBOTS / f"{name}.urdf")
    write("branched", HERE / "branched.urdf")
    write("branched_locked", HERE / "branched.urdf", ["lift", "right_wrist", "left_slide"])
