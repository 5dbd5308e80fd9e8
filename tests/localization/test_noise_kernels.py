import numpy as np
from scipy import stats

from localization.noise_kernels import deviate, random_words


def test_noise_is_nearly_normal() -> None:
    words = random_words((200_000,), np.random.default_rng(0))
    noise = np.array([deviate(word) for word in words[:40_000]])
    assert abs(noise.mean()) < 0.02
    assert abs(noise.std() - 1.0) < 0.01
    assert abs(stats.skew(noise)) < 0.04
    assert stats.kstest(noise, "norm").statistic < 0.02


def test_noise_has_no_tails() -> None:
    ends = [deviate(np.uint64(word)) for word in (0, 2**64 - 1)]
    np.testing.assert_allclose(ends, [-np.sqrt(12.0), np.sqrt(12.0)], rtol=1e-4)


def test_each_quarter_of_a_word_counts_alike() -> None:
    quarters = [deviate(np.uint64(12345 << shift)) for shift in (0, 16, 32, 48)]
    assert len(set(quarters)) == 1


def test_words_repeat_with_their_seed() -> None:
    first, again, other = (random_words((5, 3), np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)
