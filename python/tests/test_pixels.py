"""Mechanics from pictures: what is learned, what is read, and what is refused in words."""

import json
from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg
from lagrangian.pixels import _command, drawn
from lagrangian.pixels._camera import judged

DT = 0.125


def swings(count, pictures, seed, gravity=3.0):
    """Angles and velocities of pendulums that swing and turn, by Verlet steps."""
    rng = np.random.default_rng(seed)
    size, turn = rng.uniform(1.3, 2.3, count), rng.uniform(0.0, 2.0 * np.pi, count)
    q, v, h = size * np.cos(turn), 2.0 * size * np.sin(turn), DT / 50
    rows = []
    for _ in range(pictures):
        rows.append((q, v))
        for _ in range(50):
            v = v - 0.5 * h * gravity * np.sin(q)
            q = q + h * v
            v = v - 0.5 * h * gravity * np.sin(q)
    q, v = np.moveaxis(np.array(rows), 0, 2)
    return q, v


def blob(x, y, height=32, width=32):
    """Pictures of a disc at places from −1 to 1."""
    across, down = np.meshgrid(np.linspace(-1, 1, width), np.linspace(-1, 1, height))
    distance = np.hypot(across - np.asarray(x)[..., None, None], down - np.asarray(y)[..., None, None])
    return (1.0 / (1.0 + np.exp(np.clip((distance - 0.2) / 0.05, -50, 50)))).astype(np.float32)


@pytest.fixture(scope="module")
def pendulum():
    q, _ = swings(50, 35, seed=1)
    return lg.pixels.fit(drawn(q), DT)


def aligned(found, truth):
    """Angles up to their sense and their zero, and that sense."""
    best = None
    for sense in (1.0, -1.0):
        zero = np.angle(np.exp(1j * (truth - sense * found)).mean())
        left = np.angle(np.exp(1j * (truth - sense * found - zero)))
        if best is None or left.std() < best[0].std():
            best = (left, sense)
    return best


def test_a_pendulum_is_learned_from_its_pictures(pendulum):
    q, v = swings(8, 405, seed=2)
    film = drawn(q)
    found = pendulum.encode(film)[..., 0]
    left, _ = aligned(found, q)
    assert left.std() < 2e-3
    valid = []
    for own in film:
        error = np.square(pendulum.predict(own[:5], 400) - own[5:]).mean((1, 2))
        bad = error > 0.5 * np.square(own - film.mean((0, 1))).mean()
        valid.append(int(np.argmax(bad)) if bad.any() else 400)
    assert np.median(valid) >= 350
    energy = 0.5 * v**2 + 3.0 * (1.0 - np.cos(q))
    starts = [pendulum.state(own[:9]) for own in film]
    learned = [float(np.squeeze(pendulum.energy(*start))) for start in starts]
    assert np.corrcoef(learned, energy[:, 0])[0, 1] > 0.999
    motion = pendulum.rollout(film[0][:5], 1000)
    along = np.asarray(pendulum.energy(motion.q, motion.qd)).reshape(-1)
    assert np.ptp(along) < 1e-3 * energy.max()
    # g / l by the curvature of the potential over the inertia.
    grid = np.linspace(-np.pi, np.pi, 400)
    potential = np.asarray(pendulum.energy(grid[:, None], np.zeros((400, 1)))).reshape(-1)
    inertia = float(np.median(pendulum.dynamics.mass_matrix(grid[:, None])))
    assert abs(0.5 * np.ptp(potential) / inertia - 3.0) < 0.03


def test_the_same_seed_gives_the_same_model_and_files_keep_its_bits(pendulum, tmp_path):
    q, _ = swings(50, 35, seed=1)
    again = lg.pixels.fit(drawn(q), DT)
    pendulum.save(tmp_path)
    read = lg.pixels.load(tmp_path)
    start = drawn(q[0, :5])
    for other in (again, read):
        assert np.array_equal(pendulum.predict(start, 50), other.predict(start, 50))
    assert lg.load(tmp_path / "model.safetensors").n == 1
    (tmp_path / "pictures.npz").write_bytes(b"PK")
    with pytest.raises(lg.errors.ModelError, match="damaged"):
        lg.pixels.load(tmp_path)


def test_noise_of_pixels_costs_little():
    q, _ = swings(50, 35, seed=3)
    noisy = drawn(q) + 0.1 * np.random.default_rng(4).normal(size=(*q.shape, 32, 32)).astype(np.float32)
    model = lg.pixels.fit(np.clip(noisy, 0.0, 1.0), DT)
    left, _ = aligned(model.encode(drawn(q))[..., 0], q)
    assert left.std() < 0.02


def test_what_slides_has_a_place_on_a_line_and_friction_where_it_is_seen():
    t = DT * np.arange(60)
    rng = np.random.default_rng(5)
    places = [np.exp(-0.05 * t) * a * np.cos(1.4 * t + b) for a, b in zip(rng.uniform(0.3, 0.8, 20), rng.uniform(0, 6, 20))]
    model = lg.pixels.fit(blob(0.8 * np.array(places), 0.0), DT)
    assert not model.curve.closed
    assert any("friction is learned" in note for note in model.notes)
    assert model.score.valid == model.score.longest


def test_a_film_is_read_from_what_users_have(tmp_path, capsys):
    from PIL import Image

    t = 0.04 * np.arange(240)
    film = np.round(255 * np.stack([drawn(1.2 * np.cos(3.0 * t), 48)] * 3, -1)).astype(np.uint8)
    pictures = [Image.fromarray(own) for own in film]
    gif = tmp_path / "clip.gif"
    pictures[0].save(gif, save_all=True, append_images=pictures[1:], duration=40)
    assert lg.pixels.read(gif).dt == pytest.approx(0.04)
    folder = tmp_path / "pictures"
    folder.mkdir()
    for k, own in enumerate(pictures):
        own.save(folder / f"p{k}.png")
    read = lg.pixels.read(folder, dt=0.04)
    assert read.motions[0].shape == (240, 48, 48, 3)
    assert np.allclose(read.motions[0], film / 255.0, atol=1e-6)
    whole = tmp_path / "film.npz"
    np.savez(whole, frames=film, dt=0.04)
    out = tmp_path / "run"
    arguments = ["fit", str(whole), "--out", str(out), "--steps", "100", "--json"]
    assert _command.takes(arguments) and _command.takes(["fit", str(gif)]) and not _command.takes(["fit", "log.csv"])
    assert _command.main(arguments) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["verdict"] in ("good", "fair") and said["valid"] > 20
    damaged = tmp_path / "damaged.npz"
    damaged.write_bytes(whole.read_bytes()[:1000])
    assert not _command.takes(["fit", str(damaged)]) and _command.takes(["fit", "film.npy"])
    page = (out / "report.html").read_text()
    assert 'class="card film"' in page and "Potential" in page
    with Image.open(out / "preview.png") as shown:
        assert shown.mode == "RGB" and min(shown.size) > 100
    assert _command.main(arguments) == 2
    assert "--force" in capsys.readouterr().err
    assert _command.main(["fit", str(folder), "--out", str(tmp_path / "other")]) == 2
    assert "dt" in capsys.readouterr().err


def test_films_of_another_program_are_read_and_learned():
    """A rendering with shadow, perspective and texture, encoded by ffmpeg."""
    folder = Path(__file__).parent / "films"
    film = lg.pixels.read(folder / "pendulum.mp4")
    assert film.dt == pytest.approx(1 / 30) and film.shape == (128, 128, 3) and len(film) == 600
    clip = lg.pixels.read(folder / "pendulum.gif")
    assert clip.dt == pytest.approx(0.04) and clip.shape == (48, 48, 3) and len(clip) == 60
    model = lg.pixels.fit(film)
    assert model.score.valid >= 60 and any("friction" in note for note in model.notes)


STILL = np.full((60, 16, 16), 0.5)


@pytest.mark.parametrize(
    ("film", "words"),
    [
        (STILL, "nothing moves"),
        (STILL[:20], "too few pictures"),
        (np.full((60, 16, 16), np.nan), "NaN"),
        (np.zeros((60, 16)), "has shape"),
        (np.zeros((60, 16, 16), complex), "numbers"),
        (300.0 * np.ones((60, 16, 16)), "0 to 255"),
        ([np.zeros((30, 16, 16)), np.zeros((30, 16, 18))], "different sizes"),
        ("missing.gif", "no file"),
    ],
)
def test_what_is_no_film_is_refused_in_words(film, words):
    with pytest.raises(lg.errors.LagrangianError, match=words):
        lg.pixels.fit(film, DT)


def scene(pictures, rng):
    """A background with texture."""
    rough = rng.uniform(0.2, 0.6, (12, 12))
    return np.repeat(np.kron(rough, np.ones((8, 8)))[None], pictures, 0)


def test_a_film_that_shows_no_coordinate_is_refused_in_words():
    rng = np.random.default_rng(6)
    t = 0.04 * np.arange(300)
    one, other = 0.6 * np.cos(3.0 * t), 0.6 * np.cos(4.4 * t + 1.0)
    with pytest.raises(lg.errors.DataError, match="several things"):
        lg.pixels.fit(np.maximum(blob(one, -0.5), blob(other, 0.5)), 0.04)
    wide = scene(300, rng)
    panned = np.stack([np.roll(own, k, 1) for own, k in zip(wide, np.round(1.5 * t / 0.04).astype(int))])
    with pytest.raises(lg.errors.DataError, match="camera"):
        lg.pixels.fit(np.maximum(panned, blob(one, 0.0, 96, 96)), 0.04)
    dark = np.maximum(wide, blob(one, 0.0, 96, 96))
    with pytest.raises(lg.errors.DataError, match="light"):
        lg.pixels.fit(np.clip(dark * rng.uniform(0.2, 1.6, 300)[:, None, None], 0.0, 1.0), 0.04)
    flickers = lg.pixels.fit(dark * (1.0 + 0.03 * rng.normal(size=300))[:, None, None] * 0.8, 0.04, steps=50)
    assert any("flicker" in note for note in flickers.notes)
    with pytest.raises(lg.errors.DataError, match="followed"):
        lg.pixels.fit(drawn(np.cumsum(rng.uniform(1.5, 4.5, (4, 80)), 1)), 0.04)


def test_the_shake_of_a_hand_is_taken_out():
    rng = np.random.default_rng(7)
    t = 0.04 * np.arange(300)
    steady = np.maximum(scene(300, rng), blob(0.6 * np.cos(3.0 * t), 0.0, 96, 96))
    shake = np.stack([np.convolve(own, np.exp(-np.arange(40) / 8.0), "same") for own in rng.normal(size=(2, 300))], 1)
    shake *= 1.5 / shake.std()
    at = np.arange(96)
    moved = np.stack([[np.interp(at + x, at, row) for row in own] for own, x in zip(steady, shake[:, 1])])
    moved = np.stack([np.stack([np.interp(at + y, at, row) for row in own.T], 1) for own, y in zip(moved, shake[:, 0])])
    model = lg.pixels.fit(moved + 0.01 * rng.normal(size=moved.shape), 0.04, steps=100)
    assert any("camera shook" in note for note in model.notes)
    found = model.encode(moved)[:, 0]
    line = np.polynomial.Polynomial.fit(found, np.cos(3.0 * t), 5)
    assert np.std(line(found) - np.cos(3.0 * t)) < 0.02
    assert model.score.verdict == "good"
    assert judged(lg.pixels.read(steady + 0.01 * rng.normal(size=moved.shape), 0.04)).still is None
    # The light of a lamp that fades is no movement.
    fading = steady * (1.0 + 0.15 * np.sin(0.5 * t))[:, None, None] * 0.8
    assert any("flicker" in note for note in judged(lg.pixels.read(fading, 0.04)).notes)


def test_pictures_of_another_size_are_refused(pendulum):
    with pytest.raises(lg.errors.InvalidInput, match="shape"):
        pendulum.predict(np.zeros((5, 20, 20)), 10)
    with pytest.raises(lg.errors.InvalidInput, match="at least 3"):
        pendulum.predict(np.zeros((2, 32, 32)), 10)
    with pytest.raises(lg.errors.InvalidInput, match="coordinate"):
        lg.pixels.fit(STILL, DT, coordinate="torus")
