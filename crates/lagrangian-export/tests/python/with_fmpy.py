"""with_fmpy.py FOLDER: the functional mock-up unit of the cart-pole in FMPy against a second implementation."""

import shutil
import sys
import tempfile
from pathlib import Path

import fmpy
import numpy as np
import plant
from fmpy.build import build_platform_binary
from fmpy.fmi2 import FMU2Model, FMU2Slave
from fmpy.validation import validate_fmu

folder = Path(sys.argv[1])
UNIT = folder / "cart_pole.fmu"
START = np.array([0.0, 0.5, 0.0, 0.0])
NAMES = ["q[1]", "q[2]", "qd[1]", "qd[2]", "qdd[1]", "qdd[2]", "energy", "distance_from_data"]


def description_is_valid(file):
    assert validate_fmu(str(file)) == []
    model = fmpy.read_model_description(str(file))
    units = {v.name: v.unit for v in model.modelVariables}
    assert units["q[1]"] == "m" and units["q[2]"] == "rad" and units["tau[1]"] is None and units["energy"] == "J"
    starts = [float(v.start) for v in model.modelVariables if v.name.startswith(("q[", "qd["))]
    assert starts == list(START), starts
    assert "cart <left & right>" in next(v.description for v in model.modelVariables if v.name == "q[1]")


def simulations_agree(file):
    forces = np.array([(0.0, 1.0), (1.0, 1.0), (1.0, -2.0), (2.0, -2.0)], [("time", float), ("tau[1]", float)])
    end = plant.simulate(plant.simulate(START, lambda t: 1.0, 1.0), lambda t: -2.0, 1.0)
    for kind, tolerance in (("CoSimulation", 1e-9), ("ModelExchange", 1e-5)):
        found = fmpy.simulate_fmu(
            str(file), stop_time=2.0, output_interval=0.1, relative_tolerance=1e-9, input=forces, output=NAMES, fmi_type=kind
        )
        values = np.array([found[name] for name in NAMES]).T
        assert len(values) >= 21
        np.testing.assert_allclose(values[0, :4], START)
        np.testing.assert_allclose(values[-1, :4], end, atol=tolerance)
        for row in values:
            np.testing.assert_allclose(row[6], plant.energy(row[:2], row[2:4]), atol=1e-9)
        np.testing.assert_allclose(values[5, 4:6], plant.accelerations(values[5, :2], values[5, 2:4], 1.0), atol=1e-9)
    start = {"q[2]": 3.0, "qd[1]": 0.5}
    found = fmpy.simulate_fmu(str(file), stop_time=0.5, output_interval=0.1, start_values=start, output=NAMES)
    values = np.array([found[name][-1] for name in NAMES[:4]])
    np.testing.assert_allclose(values, plant.simulate(np.array([0.0, 3.0, 0.5, 0.0]), lambda t: 0.0, 0.5), atol=1e-9)


def instance(kind, token=None):
    model = fmpy.read_model_description(str(UNIT))
    unit = kind(
        guid=token or model.guid,
        unzipDirectory=fmpy.extract(str(UNIT)),
        modelIdentifier=model.coSimulation.modelIdentifier,
        instanceName="one",
    )
    return unit, {v.name: v.valueReference for v in model.modelVariables}


def started(kind):
    unit, references = instance(kind)
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    return unit, references


def ended(unit):
    unit.terminate()
    unit.freeInstance()


def fails(call, *arguments, **options):
    try:
        call(*arguments, **options)
    except Exception:
        return
    raise AssertionError(f"{call.__name__} was accepted")


def misuse_is_refused():
    other, _ = instance(FMU2Slave, token="of another model")
    fails(other.instantiate)
    unit, references = started(FMU2Slave)
    q = [references[name] for name in NAMES[:4]]
    fails(unit.setReal, [references["tau[1]"]], [float("nan")])
    fails(unit.setReal, [references["energy"]], [1.0])
    fails(unit.setReal, [9999], [1.0])
    fails(unit.getReal, [9999])
    for length in (-0.1, float("nan"), 1e300):
        fails(unit.doStep, currentCommunicationPoint=0.0, communicationStepSize=length)
    np.testing.assert_allclose(unit.getReal(q), START)  # nothing moved
    unit.setReal([references["tau[1]"]], [1e308])
    fails(unit.doStep, currentCommunicationPoint=0.0, communicationStepSize=1.0)
    np.testing.assert_allclose(unit.getReal(q), START)
    ended(unit)


def states_come_back():
    unit, references = started(FMU2Slave)
    stored = unit.serializeFMUstate(unit.getFMUstate())
    q = [references["q[1]"], references["q[2]"]]
    unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.3)
    moved = list(unit.getReal(q))
    unit.setFMUstate(unit.deSerializeFMUstate(stored))
    np.testing.assert_allclose(unit.getReal(q), START[:2])
    unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.3)
    assert list(unit.getReal(q)) == moved
    ended(unit)


def directions_agree():
    unit, references = started(FMU2Model)
    unit.enterContinuousTimeMode()
    x, u = np.array([0.3, -1.1, 0.7, 2.0]), 3.0
    knowns = [references[name] for name in [*NAMES[:4], "tau[1]"]]
    unit.setReal(knowns, [*x, u])
    unknowns = [references[name] for name in ["der(q[1])", "der(q[2])", "qdd[1]", "qdd[2]", "q[2]", "energy"]]

    def all_of(v):
        q, qd = v[:2], v[2:4]
        return np.concatenate([qd, plant.accelerations(q, qd, v[4]), [q[1], plant.energy(q, qd)]])

    slopes = plant.differences(all_of, np.append(x, u))
    for k in range(5):
        seed = np.eye(5)[k]
        found = unit.getDirectionalDerivative(vUnknown_ref=unknowns, vKnown_ref=knowns, dvKnown=list(seed))
        np.testing.assert_allclose(found, slopes[:, k], atol=1e-5)
    ended(unit)


def sources_are_enough():
    """A unit without a library is compiled by its importer."""
    target = Path(tempfile.mkdtemp())
    fmpy.extract(str(folder / "sources_only.fmu"), str(target))
    assert "sources only" in fmpy.read_model_description(str(target)).description
    build_platform_binary(target)
    simulations_agree(target)
    shutil.rmtree(target)


description_is_valid(UNIT)
simulations_agree(UNIT)
print("description and simulations hold")
for check in (misuse_is_refused, states_come_back, directions_agree, sources_are_enough):
    check()
    print(f"{check.__name__}: holds")
