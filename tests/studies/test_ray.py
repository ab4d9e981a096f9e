"""Blocks by Ray: the bytes of a plain run, whatever happens to workers and machines."""

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_lines import (
    assert_one_sentence,
    assert_same_results,
    call,
    descendants,
    environment,
    promptly,
    run,
    start,
)

from taichi_ants.studies.ray import _has_token

SWEEP = """
kind = "runs"
measures = ["return_all", "greedy_deliveries"]
seeds = 1000
episodes = 300
max_steps = 600
rollouts = 3
training = {learner = "sarsa", discount = 0.9, epsilon = 0.3, epsilon_decay = 0.99}
[vary]
training.learning_rate = [0.01, 0.1, 0.2]
task.rewards.shaping = [1, 0]
"""


@pytest.fixture
def sweep(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("my.toml").write_text(SWEEP)
    return lambda *more: call("sweep", ["my.toml", "--out", "a", *more], capsys)


def test_ray_excludes_worker_processes(sweep):
    status, _, err = sweep("--workers", 2, "--ray")
    assert (status, err) == (2, "error: --ray: not allowed with argument --workers; see --help.\n")
    assert not Path("a").exists()


@pytest.mark.parametrize("address", ["host", "host:", "ray://h:1"])
def test_what_is_not_an_address_is_refused(address, sweep):
    status, _, err = sweep("--ray", address)
    assert status == 2
    assert_one_sentence(err)
    assert f"no Ray cluster listens at {address!r}" in err


def test_an_address_where_nobody_listens_is_refused_in_seconds(sweep):
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
    began = time.monotonic()
    status, _, err = sweep("--ray", address)
    assert time.monotonic() - began < promptly()
    assert status == 2
    assert_one_sentence(err)
    assert f"no Ray cluster listens at {address!r} (Connection refused); give HOST:PORT" in err


def test_ray_is_an_extra(monkeypatch, sweep):
    monkeypatch.setitem(sys.modules, "ray", None)
    status, _, err = sweep("--ray")
    assert status == 2
    assert_one_sentence(err)
    assert 'needs ray, which cannot be imported; run pip install -e ".[ray]"' in err


def test_a_token_of_this_machine_is_found(monkeypatch, tmp_path):
    for name in ("RAY_AUTH_TOKEN", "RAY_AUTH_TOKEN_PATH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    assert not _has_token()
    (tmp_path / ".ray").mkdir()
    (tmp_path / ".ray" / "auth_token").write_text("a")
    assert _has_token()


# The slow tests, which start Ray, and the long ones, which start a cluster.


@pytest.fixture(scope="module")
def plain(tmp_path_factory, kernels):
    """The results of the sweep without Ray."""
    folder = tmp_path_factory.mktemp("plain")
    (folder / "my.toml").write_text(SWEEP)
    assert run("sweep", ARGUMENTS, kernels, folder).returncode == 0
    return folder / "a"


@pytest.fixture
def running(kernels, tmp_path):
    """Start the sweep with more arguments, and return its process when it has written a block."""

    def started(*more):
        pytest.importorskip("ray")
        (tmp_path / "my.toml").write_text(SWEEP)
        process = start("sweep", [*ARGUMENTS, *more], kernels, tmp_path)
        until = time.monotonic() + 240
        while not blocks_in(tmp_path) and process.poll() is None and time.monotonic() < until:
            time.sleep(0.05)
        assert process.poll() is None
        assert blocks_in(tmp_path)
        return process

    return started


ARGUMENTS = ["my.toml", "--out", "a", "--no-figures"]


def blocks_in(folder: Path) -> set[Path]:
    return set(folder.rglob("*.npz"))


def kill(pid: int, program: str) -> None:
    """Kill a descendant of a process."""
    os.kill(next(one for one, line in descendants(pid).items() if program in line), 9)


@pytest.mark.long
def test_a_killed_worker_costs_its_blocks_only(plain, running, tmp_path):
    process = running("--ray")
    kill(process.pid, "ray::run_pickled")
    out, err = process.communicate(timeout=500)
    assert (process.returncode, err) == (0, "")
    assert "all results are in a/" in out
    assert_same_results(plain, tmp_path / "a", also=["packages"])


@pytest.mark.long
def test_ctrl_c_ends_ray_and_the_work_resumes(plain, running, kernels, tmp_path):
    process = running("--ray")
    others, began = descendants(process.pid), time.monotonic()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert time.monotonic() - began < promptly()
    assert process.returncode == 130
    assert err == "Stopped; finished parts are saved. Run the same command again to resume.\n"
    while any(Path(f"/proc/{one}").exists() for one in others):
        assert time.monotonic() - began < 2 * promptly()
        time.sleep(0.05)
    assert run("sweep", ARGUMENTS, kernels, tmp_path).returncode == 0
    assert_same_results(plain, tmp_path / "a", also=["packages"])


CLUSTER = """
import sys
from ray.cluster_utils import Cluster
cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
nodes = [cluster.add_node(num_cpus=1, wait=False) for _ in range(8)]
cluster.wait_for_nodes(timeout=240)
print(cluster.address, flush=True)
for line in sys.stdin:
    cluster.remove_node(nodes.pop(), allow_graceful=False)
    print("removed", flush=True)
cluster.shutdown()
"""


@pytest.fixture  # for each test, because Ray prints later that machines are gone
def cluster(kernels):
    """A Ray cluster of nine machines, simulated on this one; writing a line kills one of them.

    Its `address` is that of Ray.
    """
    pytest.importorskip("ray")
    process = subprocess.Popen(
        [sys.executable, "-c", CLUSTER],
        env=environment(kernels, RAY_USAGE_STATS_ENABLED="0", RAY_BACKEND_LOG_LEVEL="fatal"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    with process:
        process.address = process.stdout.readline().strip()
        yield process
        process.stdin.close()


@pytest.mark.long
def test_two_of_eight_machines_die(plain, running, cluster, tmp_path):
    process = running("--ray", cluster.address)
    for _ in range(2):
        cluster.stdin.write("\n")
        cluster.stdin.flush()
        assert cluster.stdout.readline() == "removed\n"
    assert len(blocks_in(tmp_path)) < 8
    _, err = process.communicate(timeout=500)
    assert (process.returncode, err) == (0, "")
    assert_same_results(plain, tmp_path / "a", also=["packages"])


@pytest.mark.long
def test_a_dead_head_ends_the_command_with_a_sentence(plain, running, kernels, cluster, tmp_path):
    process = running("--ray", cluster.address)
    kill(cluster.pid, "gcs_server")
    began = time.monotonic()
    out, err = process.communicate(timeout=500)
    assert time.monotonic() - began < 30 * promptly()  # Ray itself needs a minute
    assert (process.returncode, out) == (1, "")
    assert_one_sentence(err.lstrip("\n"))
    assert "the head of the Ray cluster at '" in err
    assert "does not answer any more; finished parts are saved, so run the same command" in err
    assert run("sweep", ARGUMENTS, kernels, tmp_path).returncode == 0
    assert_same_results(plain, tmp_path / "a", also=["packages"])
