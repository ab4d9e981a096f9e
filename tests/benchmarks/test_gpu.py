"""The benchmark of a GPU, without one."""

import ctypes
from concurrent.futures import ThreadPoolExecutor

import gpu
import pytest

from taichi_ants import runtime


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch):
    def pool(workers, context, *start):
        return ThreadPoolExecutor(1, "", *start)

    monkeypatch.setattr(gpu, "ProcessPoolExecutor", pool)
    monkeypatch.setattr(runtime, "gpu_kernels_on_cpu", False)


def run(*arguments, status=0):
    with pytest.raises(SystemExit) as ended:
        gpu.main(arguments)
    assert ended.value.code == status


@pytest.mark.parametrize(
    "case", [pytest.param("environments", marks=pytest.mark.slow), "training: double_q"]
)
def test_results_of_kernels_for_a_gpu_are_those_of_the_cpu(case, capsys):
    run("--on-cpu", "--only", case)
    assert f"{case}  equal\n" in capsys.readouterr().out


def test_results_that_differ_are_an_error(monkeypatch, capsys):
    monkeypatch.setattr(gpu.record, "recorded", lambda: (1, {"sarsa-0-noisy": "another"}))
    monkeypatch.setattr(gpu.record, "of_training", lambda made: "one")
    run("--on-cpu", "--only", "training: sarsa", status=2)
    printed = capsys.readouterr()
    assert "training: sarsa  DIFFERENT\n" in printed.out
    assert "training: sarsa_lambda  FAILED: 'sarsa_lambda-0'\n" in printed.out
    assert printed.err == "error: some parts failed, or differ from those of a CPU.\n"


def test_without_a_gpu_it_says_so(monkeypatch, capsys):
    def missing(name):
        raise OSError(name)

    monkeypatch.setattr(ctypes, "CDLL", missing)
    run(status=2)
    told = "error: no CUDA device is usable here; --on-cpu compares results without one.\n"
    assert capsys.readouterr().err == told
    run("--on-cpu", "--publish", status=2)
    assert "leave out --on-cpu" in capsys.readouterr().err
