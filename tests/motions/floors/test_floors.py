"""Buildings and their floors against published modes, finite elements, state space and closed forms; floor files."""

import json
import math

import numpy as np
import pytest
import xarray as xr
from scipy import signal
from scipy.linalg import eigh
from shared_cases import shake

import toppling as tp
from toppling import motions as mo
from toppling.motions import Building, read_floors
from toppling.motions.floors.modes import beam_modes, beam_roots
from toppling.motions.intensity.peaks import velocity


def ground(n=900, dt=0.01, seeds=(1, 2), labels=None):
    rows = [3.0 * shake(np.random.default_rng(seed), n=n, dt=dt) for seed in seeds]
    return mo.from_array(np.array(rows), dt, labels or [f"shake {seed}" for seed in seeds], source="test")


class TestModes:
    # Miranda and Taghavi (2005): roots, period ratios over the first, participation factors
    TABLE = {
        0.0: ((1.8751, 4.69409, 7.85476), None, (1.566, -0.868, 0.509)),
        5.0: ((1.86670, 4.98731, 8.00959), (0.28287, 0.13173), (1.394, -0.663, 0.467)),
        30.0: ((1.62466, 4.86708, 8.09107), None, (1.278, -0.439, 0.279)),
    }

    @pytest.mark.parametrize("alpha0", TABLE)
    def test_published_table(self, alpha0):
        gammas, ratios, participation = self.TABLE[alpha0]
        np.testing.assert_allclose(beam_roots(alpha0, 3), gammas, atol=5.1e-6 if alpha0 else 4e-5)
        building = Building.flexural_shear(2.0, alpha0=alpha0, storeys=8, modes=3)
        assert building.periods[0] == 2.0
        if ratios is not None:
            np.testing.assert_allclose(building.periods[1:] / 2.0, ratios, atol=5.1e-6)
        np.testing.assert_allclose(building.participation, participation, atol=5.1e-4)

    def test_a_shear_beam(self):
        """Alpha0 without bound: quarter sines, periods as 1, 3, 5 and participation 4/(2 i - 1) pi."""
        heights = np.linspace(0.0, 1.0, 11)
        ratios, modes = beam_modes(1e4, 5, heights)
        odd = 2.0 * np.arange(1, 6) - 1.0
        np.testing.assert_allclose(ratios, odd, rtol=1e-3)
        expected = 4.0 / (odd[:, None] * math.pi) * np.sin(0.5 * math.pi * odd[:, None] * heights)
        np.testing.assert_allclose(modes, expected, atol=2e-3)

    @pytest.mark.slow
    @pytest.mark.parametrize("alpha0", [0.0, 2.0, 5.0, 30.0, 120.0])
    def test_against_finite_elements(self, alpha0):
        """Cubic beam elements in bending, with the geometric stiffness of a unit tension for the shear beam."""
        n = 160
        h = 1.0 / n
        bend = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / h**3
        shear = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]) / (30.0 * h)
        mass = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) * h / 420.0
        stiffness, masses = np.zeros((2, 2 * n + 2, 2 * n + 2))
        for i in range(n):
            at = slice(2 * i, 2 * i + 4)
            stiffness[at, at] += bend + alpha0**2 * shear
            masses[at, at] += mass
        squares, shapes = eigh(stiffness[2:, 2:], masses[2:, 2:], subset_by_index=[0, 5])
        moving = np.zeros(2 * n + 2)
        moving[::2] = 1.0
        shares = (shapes.T @ (masses @ moving)[2:])[:, None] * shapes.T[:, ::2]
        ratios, modes = beam_modes(alpha0, 6, np.linspace(0.0, 1.0, n + 1))
        np.testing.assert_allclose(ratios, np.sqrt(squares / squares[0]), rtol=1e-5)
        np.testing.assert_allclose(modes[:, 1:], shares, atol=2e-5)

    def test_many_modes_add_up_to_one(self):
        _, modes = beam_modes(5.0, 100, np.linspace(0.0, 1.0, 11))
        np.testing.assert_allclose(modes.sum(axis=0)[2:-1], 1.0, atol=0.03)
        assert np.abs(modes).max() < 2.0

    def test_two_equal_storeys(self):
        """Omega² = (k/m) (3 -+ sqrt 5)/2, shapes (1, (1 +- sqrt 5)/2)."""
        m, k = 2e5, 8e7
        building = Building.from_storeys([m, m], [k, k])
        omega = np.sqrt(k / m * (3.0 + np.array([-1.0, 1.0]) * math.sqrt(5.0)) / 2.0)
        np.testing.assert_allclose(building.periods, 2.0 * math.pi / omega, rtol=1e-13)
        golden = (1.0 + math.sqrt(5.0)) / 2.0
        expected = [(1.0 + golden) / (1.0 + golden**2), (1.0 + golden) / (1.0 + golden**2) * golden]
        np.testing.assert_allclose(building.shares[0], [0.0, *expected], rtol=1e-13)
        np.testing.assert_allclose(building.shares.sum(axis=0), [0.0, 1.0, 1.0], atol=1e-13)


class TestResponse:
    def test_against_state_space(self):
        """All storeys as one coupled first-order system, integrated by scipy with a first-order hold."""
        masses, stiffnesses = np.array([3e5, 2.5e5, 2e5, 1e5]), np.array([4e8, 3e8, 3e8, 1e8])
        zeta = np.array([0.03, 0.05, 0.08, 0.1])
        building = Building.from_storeys(masses, stiffnesses, zeta)
        stiffness = np.diag(stiffnesses + np.append(stiffnesses[1:], 0.0))
        stiffness -= np.diag(stiffnesses[1:], 1) + np.diag(stiffnesses[1:], -1)
        squares, shapes = eigh(stiffness, np.diag(masses))
        damping = np.diag(masses) @ shapes @ np.diag(2.0 * zeta * np.sqrt(squares)) @ shapes.T @ np.diag(masses)
        zero, one = np.zeros((4, 4)), np.eye(4)
        inner = -np.hstack([stiffness, damping]) / masses[:, None]
        system = np.vstack([np.hstack([zero, one]), inner]), np.append(np.zeros(4), -np.ones(4))[:, None]
        # absolute acceleration -(K u + C u')/M, and relative velocity
        outputs = np.vstack([inner, np.hstack([zero, one])])
        motions = ground()
        found = building.floor_motions(motions)
        peaks = building.peaks(motions)
        for i in range(2):
            a = motions.values[i]
            _, out, _ = signal.lsim((*system, outputs, np.zeros((8, 1))), a, np.arange(a.size) * 0.01, interp=True)
            scale = np.abs(out[:, :4]).max()
            np.testing.assert_allclose(found.values[i, 1:].T, out[:, :4], atol=1e-11 * scale)
            np.testing.assert_array_equal(found.values[i, 0], a)
            absolute = out[:, 4:] + velocity(a, 0.01)[:, None]
            np.testing.assert_allclose(peaks.pfv.values[i, 1:], np.abs(absolute).max(axis=0), rtol=1e-10)

    @pytest.mark.parametrize("factor", [0.3, 1.0, 2.5])
    def test_harmonic_steady_state(self, factor):
        """Floor acceleration |1 + sum shares omega²/(omega_i² - omega² + 2 i zeta omega_i omega)|."""
        building = Building.flexural_shear(0.5, 0.1, alpha0=5.0, storeys=4, modes=4)
        omega = factor * 2.0 * math.pi / 0.5
        dt = 5e-4
        time = np.arange(round(30.0 / dt) + 1) * dt
        # after 20 s only the steady state remains; the record is long enough for whole periods
        values = building.floor_motions(mo.from_array(np.sin(omega * time), dt)).values[0][:, time > 20.0]
        modes = 2.0 * math.pi / building.periods
        gain = omega**2 / (modes**2 - omega**2 + 2j * 0.1 * modes * omega)
        expected = np.abs(1.0 + gain @ building.shares)
        basis = np.stack([np.sin(omega * time), np.cos(omega * time)])[:, time > 20.0]
        fitted = np.linalg.lstsq(basis.T, values.T, rcond=None)[0]
        np.testing.assert_allclose(np.hypot(*fitted), expected, rtol=3e-6 + (omega * dt) ** 2 / 6.0)

    def test_missing_mass_moves_with_the_ground(self):
        """With any number of modes a floor follows a slow motion; a very stiff building moves with the ground."""
        slow = mo.from_array(np.sin(np.arange(4001) * 0.001) ** 2, 0.01)
        for modes in (1, 2, 6):
            building = Building.flexural_shear(0.02, 0.5, alpha0=5.0, storeys=3, modes=modes)
            found = building.floor_motions(slow).values[0]
            np.testing.assert_allclose(found, np.broadcast_to(slow.values[0], found.shape), atol=5e-5)

    def test_peaks_are_those_of_the_histories(self):
        building = Building.flexural_shear(0.8, storeys=6)
        motions = ground()
        for parts in (1, 3):
            histories = building.floor_motions(motions, parts=parts)
            peaks = building.peaks(motions, parts=parts)
            np.testing.assert_array_equal(np.abs(histories.values).max(axis=-1), peaks.pfa.values)
            assert histories.sizes["time"] == 899 * parts + 1
        once = building.floor_motions(motions)
        np.testing.assert_allclose(histories.values[..., ::3], once.values, atol=1e-11)
        np.testing.assert_allclose(peaks.pfv.values[:, 0], mo.measures(motions).pgv, rtol=1e-3)

    def test_floor_velocity_is_the_integral_of_floor_acceleration(self):
        building = Building.flexural_shear(0.8, storeys=3, modes=3)
        motions = ground()
        fine = building.floor_motions(motions, parts=20)
        peaks = building.peaks(motions, parts=20)
        integrated = np.abs(velocity(fine.values, 0.01 / 20)).max(axis=-1)
        np.testing.assert_allclose(peaks.pfv.values, integrated, rtol=1e-4)

    def test_any_slice_has_the_same_bits(self):
        building = Building.flexural_shear(0.8, storeys=6)
        motions = ground(seeds=(1, 2, 3))
        whole = building.peaks(motions)
        xr.testing.assert_identical(building.peaks(motions.isel(motion=[1])), whole.isel(motion=[1]))
        xr.testing.assert_identical(building.peaks(motions, floors=[5, 2]), whole.isel(floor=[5, 2]))

    def test_motions_with_steps_of_their_own(self):
        building = Building.flexural_shear(0.8, storeys=2)
        sets = [ground(seeds=(1,)), ground(400, 0.02, (2, 3), ["b", "c"])]
        found = building.floor_motions(sets, floors=[2])
        assert isinstance(found, list)
        assert [dict(one.sizes) for one in found] == [
            {"motion": 1, "floor": 1, "time": 900},
            {"motion": 2, "floor": 1, "time": 400},
        ]
        assert [float(one.dt[0]) for one in found] == [0.01, 0.02]
        peaks = building.peaks(sets)
        assert peaks.motion.values.tolist() == ["shake 1", "b", "c"]
        assert peaks.dt.values.tolist() == [0.01, 0.02, 0.02]
        np.testing.assert_array_equal(peaks.pfa.values[2, 2], np.abs(found[1].values[1, 0]).max())

    def test_labels_and_units(self):
        building = Building.flexural_shear(0.8, storeys=2, storey_height=[4.0, 3.0])
        found, peaks = building.floor_motions(ground()), building.peaks(ground())
        assert found.dims == ("motion", "floor", "time")
        assert found.name == "acceleration"
        assert found.attrs["units"] == "m s-2"
        for data in (found, peaks):
            assert data.floor.values.tolist() == [0, 1, 2]
            assert data.height.values.tolist() == [0.0, 4.0, 7.0]
            assert json.loads(data.attrs["building"])["periods"][0] == 0.8
            assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in data.coords)
        assert {name: peaks[name].attrs["units"] for name in peaks} == {"pfa": "m s-2", "pfv": "m s-1"}
        assert "T1 = 0.8" in repr(building)
        assert str(found.source[0].item()).endswith(", test")

    def test_an_analysis_of_floors(self):
        """Floors are stacked; each run equals a run with the history of that floor alone."""
        building = Building.flexural_shear(0.6, storeys=4)
        floors = building.floor_motions(ground(), floors=[0, 4])
        block, law = tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact()
        result = tp.ida(block, law, floors, [1.0, 2.0], im="scale")
        assert result.motion.values.tolist() == [f"shake {i} floor {f}" for i in (1, 2) for f in (0, 4)]
        assert result.floor.values.tolist() == ["0", "4", "0", "4"]
        roof = mo.from_array(floors.values[1, 1], 0.01)
        alone = tp.ida(block, law, roof, [1.0, 2.0], im="scale")
        np.testing.assert_array_equal(result.peak_rotation.values[..., 3], alone.peak_rotation.values[..., 0])
        np.testing.assert_array_equal(mo.measures(floors).pga.values[3], building.peaks(ground()).pfa.values[1, 4])


class TestFiles:
    TABLE = (
        "# floors of a model\n"
        "time, El Centro/1 [g], El Centro/roof [g], Kobe/1 [m/s2], Kobe/roof [cm/s²]\n"
        "0.00, 0.0, 0.1, 1.0, 10\n0.01, 0.2, 0.3, 2.0, 20\n\n0.02, -0.1, 0.0, 3.0, 30\n"
    )

    def read(self, tmp_path, text, name="floors.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return read_floors(path)

    def test_a_table(self, tmp_path):
        found = self.read(tmp_path, self.TABLE)
        assert found.dims == ("motion", "floor", "time")
        assert found.motion.values.tolist() == ["El Centro", "Kobe"]
        assert found.floor.values.tolist() == ["1", "roof"]
        np.testing.assert_allclose(found.values[0, 1], np.array([0.1, 0.3, 0.0]) * 9.80665, rtol=1e-15)
        np.testing.assert_allclose(found.values[1], [[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]], rtol=1e-14)
        assert float(found.dt[0]) == pytest.approx(0.01)
        assert mo.records(found)[1].label.split()[::3] == ["El", "roof"]

    def test_numbered_floors_semicolons_and_any_order(self, tmp_path):
        found = self.read(tmp_path, "Time [s];b/2 [m/s2];a/1 [m/s2];a/2 [m/s2];b/1 [m/s2]\n0;1;2;3;4\n1;5;6;7;8\n")
        assert found.floor.values.tolist() == [2, 1]
        assert found.values[:, :, 0].tolist() == [[1.0, 4.0], [3.0, 2.0]]

    def test_netcdf_round_trip(self, tmp_path):
        floors = Building.flexural_shear(0.8, storeys=3).floor_motions(ground())
        floors.to_netcdf(tmp_path / "floors.nc")
        read = read_floors(tmp_path / "floors.nc")
        assert set(read["unit_from"].values.ravel()) == {"m/s² (attribute units)"}
        xr.testing.assert_identical(read.drop_vars(["unit_from", "dt_from"]), floors)
        floors.to_dataset().to_netcdf(tmp_path / "classic", format="NETCDF3_64BIT")
        np.testing.assert_array_equal(read_floors(tmp_path / "classic").values, floors.values)

    def test_netcdf_without_units_is_named(self, tmp_path):
        floors = Building.flexural_shear(0.8, storeys=3).floor_motions(ground())
        floors.attrs.pop("units")
        floors.to_netcdf(tmp_path / "floors.nc")
        assert set(read_floors(tmp_path / "floors.nc")["unit_from"].values.ravel()) == {"m/s² (netCDF without units)"}

    def test_comments_that_agree(self, tmp_path):
        text = "# total acceleration in g, PGV (cm/s): 12\n\n# units: g\ntime,a/1 [g]\n0,1\n1,1\n"
        assert self.read(tmp_path, text).values.ravel().tolist() == [9.80665, 9.80665]


def stored(folder, data):
    data.to_netcdf(folder / "wrong.nc")
    return folder / "wrong.nc"


def cut(folder):
    (folder / "cut.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(50))
    return folder / "cut.nc"


FRAME = Building.flexural_shear(1.0, storeys=3)
FLOORS = FRAME.floor_motions(ground(60))


def test_a_building_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        FRAME.shares[0, 0] = 1.0


def test_refused(refusal):
    refusal()
