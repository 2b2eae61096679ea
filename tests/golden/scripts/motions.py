"""Answers of every public function of toppling.motions."""

import numpy as np

from toppling import motions

G = 9.80665
SHORT = {"duration": 6.0, "dt": 0.02}
GROUND = motions.CloughPenzien(**SHORT).sample(3, seed=1)
PAIRS = motions.CloughPenzien(**SHORT).sample_pairs(3, seed=2)
TARGET = motions.TargetSpectrum((0.1, 0.5, 4.0), (8.0, 8.0, 1.0))
AT = motions.Scenario(6.5, 20e3, 760.0)


def simulated():
    generators = {
        "kanai_tajimi": motions.KanaiTajimi(**SHORT, omega_g_dispersion=0.2),
        "clough_penzien": motions.CloughPenzien(**SHORT),
        "evolutionary_kanai_tajimi": motions.EvolutionaryKanaiTajimi(**SHORT),
        "evolutionary_clough_penzien": motions.EvolutionaryCloughPenzien(**SHORT),
        "site_based": motions.SiteBased(d5_95=3.0, t_mid=2.0, dt=0.02),
        "site_based_scenario": motions.SiteBasedScenario(6.0, 15e3, 700.0, dt=0.02),
        "near_fault": motions.NearFault(6.5, dt=0.02),
        "seismological": motions.Seismological(6.0, dt=0.02),
        "spectrum_compatible": motions.SpectrumCompatible(TARGET, **SHORT, tolerance=0.1),
        "ac156": motions.AC156(1.0, duration=20.0, dt=0.01),
    }
    found = {"names": sorted(motions.GENERATORS)}
    for name, generator in generators.items():
        assert isinstance(generator, motions.Generator)
        found[name] = {
            "sample": generator.sample(2, seed=3),
            "second": generator.sample(1, seed=3, first=1),
            "scenario": generator.scenario,
            "outside": generator.outside,
        }
        if name != "near_fault":  # (its motions are in the direction of a pulse, which has no second component)
            found[name]["sample_pairs"] = generator.sample_pairs(1, seed=3, correlation=0.2)
    return found


def parts_of_generators():
    evolving = motions.EvolutionaryCloughPenzien(**SHORT)
    time, omega = np.linspace(0.0, 5.0, 6), np.array([2.0, 10.0, 30.0])
    seismological = motions.Seismological(6.0, dt=0.02)
    near, based = motions.NearFault(6.5, dt=0.02), motions.SiteBasedScenario(6.0, 15e3, 700.0, dt=0.02)
    return {
        "density": evolving.density(omega),
        "frequency": evolving.frequency(time),
        "spectrum": seismological.spectrum(omega),
        "window": seismological.window(time),
        "of_seismological": [seismological.corner, seismological.length, seismological.moment],
        "near_fault_parameters": near.parameters(3),
        "of_near_fault": [near.corner, near.length],
        "equations": [near.equations, based.equations],
        "parameters": based.parameters(3),
        "of_site_based_scenario": [based.corner, based.length],
        "fit": motions.SiteBased.fit(GROUND[:1]),
        "ac156_target": motions.AC156(1.0).target,
        "steps_of": motions.steps_of(6.0, 0.02),
        "ensemble": motions.ensemble(
            motions.CloughPenzien(**SHORT), 2, 1, 0, 50, 0.02, lambda streams: np.arange(102.0).reshape(2, 51)
        ),
        "text": AT.text,
    }


def envelopes():
    time = np.linspace(0.0, 20.0, 21)
    shapes = [motions.Stationary(), motions.RiseStrongDecay(2.0, 6.0)]
    assert all(isinstance(shape, motions.Envelope) for shape in shapes)
    return {"names": sorted(motions.ENVELOPES)} | {type(shape).__name__: shape(time) for shape in shapes}


def pulses():
    kinds = [
        motions.RectangularPulse,
        motions.HalfSine,
        motions.OneCycleSine,
        motions.OneCycleCosine,
        motions.Ricker,
        motions.MavroeidisPapageorgiou,
    ]
    made = {kind.__name__: kind(3.0, 9.0, dt=0.02) for kind in kinds}
    made["of_velocity"] = motions.MavroeidisPapageorgiou.of_velocity(0.6, 0.8, dt=0.02, zero_residual=True)
    assert all(isinstance(pulse, motions.Pulse) for pulse in made.values())
    return {"names": sorted(motions.PULSES)} | {
        name: {"sample": pulse.sample(), "duration": pulse.duration, "shape": pulse.shape(np.linspace(0.0, 0.8, 9))}
        for name, pulse in made.items()
    }


def read_and_written():
    motions.write_at2(GROUND[:1], "written.at2", title="A motion")
    for path, number in {"pair-N.at2": 0, "pair-E.at2": 1}.items():
        motions.write_at2(GROUND[number : number + 1], path)
    try:
        motions.read("missing.at2")
    except motions.RecordError as error:
        refused = str(error)
    return {
        "read": motions.read("written.at2"),
        "read_at2": motions.read_at2("written.at2"),
        "example": motions.read(motions.example_path()),
        "read_csv": motions.read_csv("record.csv"),
        "read_of_numbers": motions.read("numbers.csv", dt=0.02, unit="g"),
        "read_all": motions.read_all("record.csv"),
        "read_floors": motions.read_floors("floors.csv"),
        "from_array": motions.from_array([[0.0, 1.0, -0.5, 0.0]], 0.01, ["own"]),
        "records": [record.label for record in motions.records(GROUND)],
        "refused": refused,
    }


def corrections():
    return {
        "bandpass": motions.bandpass(GROUND, 0.2, 15.0),
        "baseline": motions.baseline(GROUND, order=2),
        "highpass": motions.highpass(GROUND, 0.2, zero_phase=False),
        "lowpass": motions.lowpass(GROUND, 15.0, order=2),
        "pad": motions.pad(GROUND, 1.0, 0.5),
        "resample": motions.resample(GROUND, 0.01),
        "taper": motions.taper(GROUND, 0.5),
        "trim_husid": motions.trim_husid(GROUND[:1]),
        "scale_to": motions.scale_to(GROUND, 3.0, "pgv"),
        "scale_to_mean": motions.scale_to_mean(GROUND, 3.0),
    }


def pairs():
    joined = motions.join(GROUND[:1], GROUND[1:2], GROUND[2:])
    return {
        "join": joined,
        "rotate": motions.rotate(joined, 0.5),
        "as_recorded": motions.as_recorded(joined, "h2", vertical=True),
        "both_axes": motions.both_axes(PAIRS, "random", seed=4),
        "weak_axis": motions.weak_axis(PAIRS, 0.3),
    }


def intensity():
    sa = motions.Sa(0.5)
    chosen = [
        sa,
        motions.Sd(0.5, damping=0.02),
        motions.Sv(0.5),
        motions.AvgSa([0.2, 0.5, 1.0]),
        motions.AvgSa.between(0.2, 1.0, 4),
        motions.FIV3(0.5),
        motions.measure_named("cav"),
    ]
    over_directions = [motions.GeometricMean(sa), motions.RotD50(sa), motions.RotD100(sa)]
    first, second = PAIRS.values[0]
    found = {"names": sorted(motions.MEASURES)}
    for measure in chosen:
        assert isinstance(measure, motions.Measure)
        found[measure.label] = {
            "of": measure.of(GROUND.values[0], 0.02),
            "of_record": measure.of_record(motions.records(GROUND)[1]),
            "factors": measure.factors(np.array([0.5, 2.0])),
            "units": measure.units,
            "long_name": measure.long_name,
        }
    for measure in over_directions:
        found[measure.label] = {"of_pair": measure.of_pair(first, second, 0.02), "power": measure.power}
    found["read"] = [motions.Sa.read(["1.0"]).label, motions.FIV3.read(["1.0"]).label]
    found["measures"] = motions.measures(GROUND)
    found["measures_of_pairs"] = motions.measures(PAIRS, ["RotD50(Sa(0.5))", "GeometricMean(pgv)"])
    found["response_spectrum"] = motions.response_spectrum(GROUND, [0.1, 0.5, 1.0, 3.0], damping=0.02)
    return found


def spectra():
    ac156 = motions.TargetSpectrum.ac156(1.0, 0.5)
    return {
        "ac156": ac156,
        "asce7_floor": motions.TargetSpectrum.asce7_floor(1.0, 1.0, t_a=0.4),
        "from_csv": motions.TargetSpectrum.from_csv("spectrum.csv"),
        "at": TARGET.at([0.2, 1.0]),
        "between": TARGET.between(0.2, 2.0),
        "grid": TARGET.grid(4),
        "scaled": TARGET.scaled(0.5),
        "match": motions.match(GROUND[:1], TARGET, tolerance=0.1),
        "matching_report": motions.matching_report(GROUND, TARGET),
        "ac156_acceptance": motions.ac156_acceptance(motions.AC156(1.0, dt=0.01).sample(1, seed=1), 1.0),
        "missed": issubclass(motions.TargetMissed, Warning),
    }


def scenarios():
    based = motions.SiteBasedScenario(6.5, 20e3, 760.0, dt=0.02).sample(3, seed=1)
    return {
        "expected_motions": motions.expected_motions(AT),
        "over_model": motions.over_model(based, AT),
        "scale_to_model": motions.scale_to_model(based, AT, seed=2),
    }


def selection():
    names = ["Sa(0.5)", "Sa(1.0)", "pgv"]
    target = motions.Target(names, [2.7, 1.4, 0.15], [0.64, 0.69, 0.65], given="Sa(1.0)")
    other = motions.Target(names, [4.0, 2.0, 0.25], [0.6, 0.65, 0.6], given="Sa(1.0)")
    mixture = motions.Mixture([target, other], [0.7, 0.3])
    sa = [motions.measure_named(name) for name in names]
    stated = motions.Stated(sa, [[2.7, 1.4, 0.15]], [[0.3, 0.0, 0.4]], sa[1])
    pool = motions.Candidates(motions.CloughPenzien(duration=8.0, dt=0.02).sample(30, seed=1))
    chosen = motions.select(pool, target, 4, level=1.5, seed=1)
    assert isinstance(chosen, motions.Selection)
    assert isinstance(target.at(1.0), motions.Conditional)
    disaggregation = motions.read_disaggregation("disaggregation.csv")
    assert isinstance(disaggregation, motions.Disaggregation)
    try:
        motions.read_target("record.csv", "pga")
    except motions.TargetError as error:
        refused = str(error)
    factors = pool.factors(sa[1], 1.5)
    warnings = [motions.DoubtfulCorrelations, motions.InconsistentSelection]
    return {
        "target": [target.at(4.0).covariance, target.at(4.0).medians, target.at(4.0).sigmas],
        "mixture": mixture.at(4.0),
        "stated": [stated.at(1.4), stated.levels, stated.correlation_change],
        "candidates": [pool.values(sa[0]), factors, pool.scaled(sa[2], factors), len(pool)],
        "chosen": pool.chosen(np.array([0, 3]), factors),
        "select": [chosen.report, chosen.motions, chosen.consistent, chosen.why],
        "read_disaggregation": disaggregation,
        "scenarios": disaggregation.scenarios(500.0),
        "read_target": motions.read_target("target.csv", "Sa(1.0)").at(4.0),
        "expected_target": motions.expected_target(AT, "Sa(1.0)", ["Sa(0.5)", "Sa(1.0)", "pgv"]).at(4.0),
        "refused": refused,
        "warnings": [issubclass(warning, Warning) for warning in warnings],
    }


def buildings():
    cantilever = motions.Building.flexural_shear(0.6, storeys=4)
    masses, stiffnesses = [1e5, 1e5], [4e7, 4e7]
    storeys = motions.Building.from_storeys(masses, stiffnesses)
    weak = motions.Building.from_storeys(masses, stiffnesses, yielding=motions.Yielding(0.1, strength_dispersion=0.3))
    assert isinstance(weak, motions.YieldingBuilding)
    assert issubclass(motions.CollapsingBuilding, Warning)
    lead = motions.Isolator.bilinear(2.5, 0.06)
    isolated = motions.Building.isolated(lead, 2e5, [2e5, 2e5], [2e8, 2e8])
    return {
        "flexural_shear": cantilever,
        "participation": [cantilever.participation, cantilever.floors],
        "from_storeys": storeys,
        "floor_motions": cantilever.floor_motions(GROUND, [0, 2, 4]),
        "floor_motions_of_storeys": storeys.floor_motions(GROUND, [2]),
        "peaks": cantilever.peaks(GROUND),
        "yielding": weak.floor_motions(GROUND, factor=2.0),
        "response": weak.response(GROUND, [1.0, 3.0]),
        "strength_of": weak.strength_of("Kobe"),
        "yield_drifts": [weak.yield_drifts, weak.floors],
        "isolated": isolated.floor_motions(GROUND, [0, 2]),
    }


def supports():
    bench = motions.Support(12.0, damping=0.03)
    isolators = {
        "linear": motions.Isolator.linear(2.5, 0.1, clearance=0.1, stop_frequency=5.0),
        "bilinear": motions.Isolator.bilinear(2.5, 0.06),
        "pendulum": motions.Isolator.pendulum(1.5, 0.05),
    }
    return {
        "motions": bench.motions(GROUND),
        "on_top": bench.on_top(GROUND.values[0], 0.02),
        "isolators": {name: isolator.motions(GROUND) for name, isolator in isolators.items()},
        "strikes": issubclass(motions.IsolatorStrikes, Warning),
    }
