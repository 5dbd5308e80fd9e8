import numpy as np
from scipy import stats

from racecar.localization.numerics.noise_kernels import deviate, noise, random_seed


def test_noise_is_nearly_normal() -> None:
    seed = random_seed(np.random.default_rng(0))
    drawn = np.array([noise(seed, number) for number in range(40_000)])
    assert abs(drawn.mean()) < 0.02
    assert abs(drawn.std() - 1.0) < 0.01
    assert abs(stats.skew(drawn)) < 0.04
    assert stats.kstest(drawn, "norm").statistic < 0.02


def test_noise_has_no_tails() -> None:
    ends = [deviate(np.uint32(word)) for word in (0, 2**32 - 1)]
    np.testing.assert_allclose(ends, [-np.sqrt(12.0), np.sqrt(12.0)], rtol=0.005)


def test_each_quarter_of_a_word_counts_alike() -> None:
    quarters = [deviate(np.uint32(123 << shift)) for shift in (0, 8, 16, 24)]
    assert len(set(quarters)) == 1


def test_noise_repeats_with_its_seed_and_differs_with_its_number() -> None:
    seeds = [random_seed(np.random.default_rng(seed)) for seed in (1, 1, 2)]
    first, again, other = ([noise(seed, number) for number in range(15)] for seed in seeds)
    assert first == again
    assert len({*first, *other}) > 25  # of a thousand that there are
