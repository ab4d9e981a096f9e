"""All tests here take fewer resamples."""

from few_resamples import few_resamples  # noqa: F401
