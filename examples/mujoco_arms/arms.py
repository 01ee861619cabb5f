"""Arms with friction and rotors in MuJoCo."""

from lagrangian import plant

# Rotors, kg m²; dry friction, N m; viscous friction, N m s/rad.
ARMS = {
    "two_link_arm": ([0.02, 0.01], [0.2, 0.1], [0.1, 0.05]),
    "ur5": ([0.6, 0.6, 0.4, 0.1, 0.1, 0.1], [1.5, 1.5, 1.0, 0.4, 0.4, 0.3], [2.0, 2.0, 1.5, 0.5, 0.5, 0.4]),
    "panda": ([0.4, 0.4, 0.3, 0.3, 0.1, 0.1, 0.05], [0.8, 0.8, 0.6, 0.6, 0.3, 0.3, 0.2], [0.5] * 7),
    "iiwa7": ([0.3, 0.3, 0.2, 0.2, 0.1, 0.1, 0.05], [1.2, 1.2, 0.8, 0.8, 0.4, 0.4, 0.2], [1.0] * 7),
}


def compiled(name):
    """An arm as a ``mujoco.MjModel``."""
    machine = plant.compiled(name)
    machine.dof_armature[:], machine.dof_frictionloss[:], machine.dof_damping[:] = ARMS[name]
    return machine
