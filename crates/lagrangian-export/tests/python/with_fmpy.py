"""with_fmpy.py FOLDER: the functional mock-up units of the cart-pole in FMPy against a second implementation."""

import shutil
import sys
import tempfile
from pathlib import Path

import fmpy
import numpy as np
import plant
from fmpy.build import build_platform_binary
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Model, FMU3Slave
from fmpy.validation import validate_fmu

folder = Path(sys.argv[1])
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


def instance(file, kind, **options):
    model = fmpy.read_model_description(str(file))
    token = options.pop("token", getattr(model, "guid", None) or model.instantiationToken)
    unit = kind(
        guid=token, unzipDirectory=fmpy.extract(str(file)), modelIdentifier=model.coSimulation.modelIdentifier, instanceName="one"
    )
    return unit, {v.name: v.valueReference for v in model.modelVariables}


def fails(call, *arguments, **options):
    try:
        call(*arguments, **options)
    except Exception:
        return
    raise AssertionError(f"{call.__name__} was accepted")


def misuse_is_refused():
    for version, kind in ((2, FMU2Slave), (3, FMU3Slave)):
        file = folder / f"cart_pole_fmi{version}.fmu"
        other, _ = instance(file, kind, token="of another model")
        fails(other.instantiate)
        unit, references = instance(file, kind)
        unit.instantiate()
        get, put = (unit.getReal, unit.setReal) if version == 2 else (unit.getFloat64, unit.setFloat64)
        if version == 2:
            unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        fails(put, [references["tau[1]"]], [float("nan")])
        fails(put, [references["energy"]], [1.0])
        fails(put, [9999], [1.0])
        fails(get, [9999])
        for length in (-0.1, float("nan"), 1e300):
            fails(unit.doStep, currentCommunicationPoint=0.0, communicationStepSize=length)
        np.testing.assert_allclose(get([references[name] for name in NAMES[:4]]), START)  # nothing moved
        put([references["tau[1]"]], [1e308])
        fails(unit.doStep, currentCommunicationPoint=0.0, communicationStepSize=1.0)
        np.testing.assert_allclose(get([references[name] for name in NAMES[:4]]), START)
        unit.terminate()
        unit.freeInstance()


def states_come_back():
    for version, kind in ((2, FMU2Slave), (3, FMU3Slave)):
        unit, references = instance(folder / f"cart_pole_fmi{version}.fmu", kind)
        unit.instantiate()
        if version == 2:
            unit.setupExperiment(startTime=0.0)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        get = unit.getReal if version == 2 else unit.getFloat64
        state = unit.getFMUstate() if version == 2 else unit.getFMUState()
        stored = unit.serializeFMUstate(state) if version == 2 else unit.serializeFMUState(state)
        q = [references["q[1]"], references["q[2]"]]
        unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.3)
        moved = list(get(q))
        again = unit.deSerializeFMUstate(stored) if version == 2 else unit.deserializeFMUState(stored)
        (unit.setFMUstate if version == 2 else unit.setFMUState)(again)
        np.testing.assert_allclose(get(q), START[:2])
        unit.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.3)
        assert list(get(q)) == moved
        unit.terminate()
        unit.freeInstance()


def directions_agree():
    unit, references = instance(folder / "cart_pole_fmi3.fmu", FMU3Model)
    unit.instantiate()
    unit.enterInitializationMode()
    x, u = np.array([0.3, -1.1, 0.7, 2.0]), 3.0
    unit.setFloat64([references[name] for name in [*NAMES[:4], "tau[1]"]], [*x, u])
    knowns = [references[name] for name in [*NAMES[:4], "tau[1]"]]
    unknowns = [references[name] for name in ["der(q[1])", "der(q[2])", "qdd[1]", "qdd[2]", "q[2]", "energy"]]

    def all_of(v):
        q, qd = v[:2], v[2:4]
        return np.concatenate([qd, plant.accelerations(q, qd, v[4]), [q[1], plant.energy(q, qd)]])

    slopes = plant.differences(all_of, np.append(x, u))
    for k in range(5):
        seed = np.eye(5)[k]
        found = unit.getDirectionalDerivative(unknowns=unknowns, knowns=knowns, seed=list(seed))
        np.testing.assert_allclose(found, slopes[:, k], atol=1e-5)
    unit.exitInitializationMode()
    unit.terminate()
    unit.freeInstance()


def sources_are_enough():
    """The unit of FMI 3.0 without a library is compiled by its importer."""
    target = Path(tempfile.mkdtemp())
    fmpy.extract(str(folder / "sources_only.fmu"), str(target))
    assert "sources only" in fmpy.read_model_description(str(target)).description
    build_platform_binary(target)
    simulations_agree(target)
    shutil.rmtree(target)


for version in (2, 3):
    file = folder / f"cart_pole_fmi{version}.fmu"
    description_is_valid(file)
    simulations_agree(file)
    print(f"FMI {version}: description and simulations hold")
for check in (misuse_is_refused, states_come_back, directions_agree, sources_are_enough):
    check()
    print(f"{check.__name__}: holds")
