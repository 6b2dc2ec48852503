import numpy as np

from rig.epipolar.line import HALF_HIDDEN, SEEN, UNSEEN, LineFits, fit_lines

X_STEPS, Y_STEPS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]), np.zeros(5)
COLUMNS = np.arange(60, dtype=np.float64)
TRUE_SLOPE_PX = 0.83
NONE = (0.0, 0.0, 0.0)


def wave(columns: np.ndarray) -> np.ndarray:
    return 120 + 30 * np.sin(0.35 * columns) + 20 * np.cos(0.21 * columns)


def views() -> np.ndarray:
    rows = [wave(COLUMNS + TRUE_SLOPE_PX * x) for x in X_STEPS]
    return np.stack([np.tile(row, (8, 1)) for row in rows]).astype(np.float32)


def fit(
    images: np.ndarray, start_px: float, scale: float = 20.0, covered: tuple[int, ...] = ()
) -> LineFits:
    start = np.full(images.shape[1:], start_px, np.float32)
    hidden = np.zeros(images.shape, np.bool_)
    hidden[list(covered)] = True
    return fit_lines(images, X_STEPS, Y_STEPS, 2, start, hidden, scale, 0.0, NONE, 0.3)


def test_one_step_comes_close_to_the_true_slope() -> None:
    lines = fit(views(), TRUE_SLOPE_PX + 0.08)
    strong = lines.information > np.median(lines.information)
    error = np.abs(lines.slope_px - TRUE_SLOPE_PX)[:, 5:-5][strong[:, 5:-5]]
    assert np.median(error) < 0.01
    assert np.all(lines.sight[:, 5:-5] == SEEN)


def test_the_step_is_bounded() -> None:
    lines = fit(views(), TRUE_SLOPE_PX + 3.0)
    assert np.abs(lines.slope_px - TRUE_SLOPE_PX - 3.0).max() <= 0.3 + 1e-5


def test_a_hidden_half_is_left_out() -> None:
    images = views()
    images[:2] = 255 - images[:2]
    lines = fit(images, TRUE_SLOPE_PX, scale=2.0)
    hidden = lines.sight[:, 10:-10] == HALF_HIDDEN
    assert hidden.mean() > 0.8
    assert np.median(np.abs(lines.slope_px - TRUE_SLOPE_PX)[:, 10:-10][hidden]) < 0.01


def test_a_covered_view_hardly_counts() -> None:
    images = views()
    images[4] += 0.2 * np.gradient(images[4], axis=1) + 2.0  # as if 0.2 px off, and brighter
    off = np.abs(fit(images, TRUE_SLOPE_PX).slope_px - TRUE_SLOPE_PX)[:, 10:-10]
    covered = fit(images, TRUE_SLOPE_PX, covered=(4,))
    error = np.abs(covered.slope_px - TRUE_SLOPE_PX)[:, 10:-10]
    assert np.median(off) > 0.03
    assert np.median(error) < 0.01
    assert np.all(covered.sight[:, 5:-5] == SEEN)


def test_no_view_sees_what_falls_outside_all_of_them() -> None:
    images = views()[[2, 3]]
    start = np.full(images.shape[1:], 30.0, np.float32)
    open_to_all = np.zeros(images.shape, np.bool_)
    lines = fit_lines(
        images, np.array([0.0, 1.0]), np.zeros(2), 0, start, open_to_all, 20.0, 0.0, NONE, 0.3
    )
    assert np.all(lines.sight[:, :30] == UNSEEN)
    assert np.all(lines.sight[:, 31:] == SEEN)
