"""Kernels as they are compiled and launched for a GPU, on the CPU: guards, and equal results."""

import os
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import taichi_ants
from taichi_ants import AntsError, evaluate, learners, runtime, train, worlds
from taichi_ants.envs.forage import HexForageVectorEnv
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task

PACKAGE = Path(taichi_ants.__file__).parent
RULES = {
    "q_learning": Task().replace(choice="softmax"),
    "sarsa": Task().replace(pheromone={"deposit": "fading"}),
    "dyna_q": Task().replace(noise={"slip": 0.1, "misread": 0.1}),
}


@pytest.fixture
def as_on_gpu(monkeypatch):
    monkeypatch.setattr(runtime, "gpu_kernels_on_cpu", True)


def results_of_operators(zero):
    """Return the results of operators of f32 and f64 in a kernel with guards."""
    import taichi as ti

    from taichi_ants.arithmetic.guards import guarded

    runtime.start()
    numbers = ti.types.ndarray(ti.f64, 1)

    @ti.func
    def computed(x, y):
        power, vector, scaled, shared = x**2, ti.Vector([x, y]) * y, x, x
        scaled *= y
        shared /= y
        return ti.Vector(
            [x * y, x / y, x // y, x % y, power, vector[0], (vector / y)[1], scaled, shared]
        )

    @ti.kernel
    def kernel(out: numbers, x: ti.f64, y: ti.f64, zero: ti.i32):
        whole = ti.cast(y, ti.i32) * 10
        of_f64, of_f32 = computed(x, y), computed(ti.cast(x, ti.f32), ti.cast(y, ti.f32))
        for i in ti.static(range(9)):
            out[i], out[9 + i] = of_f64[i], ti.cast(of_f32[i], ti.f64)
        out[18] = ti.cast(whole / 3, ti.f64)
        out[19] = ti.cast(whole * 3 + whole // 3 + whole % 3, ti.f64)

    out = np.zeros(20)
    with runtime.quiet(), guarded(3):
        kernel(out, 17.3, 2.9, zero)
    return out


def test_guards_hide_products_and_quotients_of_reals_from_the_compiler():
    x, y = np.float64(17.3), np.float64(2.9)
    expected = []
    for a, b in ((x, y), (np.float32(x), np.float32(y))):
        whole = np.floor(a / b)
        expected += [a * b, a / b, whole, a - b * whole, a * a, a * b, b * b / b, a * b, a / b]
    expected += [np.float32(20) / np.float32(3), 20 * 3 + 20 // 3 + 20 % 3]
    assert results_of_operators(0).tolist() == [float(value) for value in expected]
    # With another number than 0, all of them change, but not those of whole numbers.
    changed = results_of_operators(-1) != np.array(expected)
    assert changed[:-1].all()
    assert not changed[-1]


def run_script(text, folder, **variables):
    script = folder / "script.py"  # Taichi reads the source of kernels
    script.write_text(text, encoding="utf-8")
    root = PACKAGE.parent
    path = os.pathsep.join(map(str, (root, root / "tests/golden", root / "tests/support")))
    environment = {**os.environ, "PYTHONPATH": path, **variables}
    done = subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(one, marks=[pytest.mark.long] * (one not in (*RULES, "prioritized_sweeping")))
        for one in learners.names()
    ],
)
def test_training_is_the_same_as_on_a_gpu(name, as_on_gpu, monkeypatch):
    config = TrainingConfig(name, 0.2, 0.9, 0.3, 0.97, learning_rate_decay=0.99)
    world, task = worlds.paper(), RULES.get(name)
    on_gpu = train(world, config, [1, 2], 8, 150, task)
    values = evaluate(world, on_gpu.q_values, 3, 5, 150, task, epsilon=0.1)
    monkeypatch.setattr(runtime, "gpu_kernels_on_cpu", False)
    assert_same(vars(train(world, config, [1, 2], 8, 150, task).state), vars(on_gpu.state))
    assert_same(vars(evaluate(world, on_gpu.q_values, 3, 5, 150, task, epsilon=0.1)), vars(values))


def assert_same(left, right):
    for name, value in left.items():
        np.testing.assert_array_equal(value, right[name], err_msg=name)


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_environments_are_the_same_as_on_a_gpu(mode, monkeypatch):
    task = Task().replace(noise={"slip": 0.1, "misread": 0.1}, pheromone={"deposit": "fading"})
    made = {}
    for on_gpu in (False, True):
        monkeypatch.setattr(runtime, "gpu_kernels_on_cpu", on_gpu)
        envs = HexForageVectorEnv(600, task=task, max_steps=60, autoreset_mode=mode)
        envs.reset(seed=4)
        steps = [envs.step(np.full(600, action))[:4] for action in (1, 0, 1, 2, 1)]
        followed = envs.rollout("trail_follower", 130, epsilon=0.3)
        given = envs.rollout(np.random.default_rng(1).integers(5, size=(70, 600)))
        copied = pickle.loads(pickle.dumps(envs))
        now, later = (one._ants.batched.snapshot(7) for one in (envs, copied))
        last = envs.step(np.full(600, 1))[:4]
        made[on_gpu] = [*sum(steps, ()), *followed, *given, now.ground, now.trail, later.trail]
        made[on_gpu] += last
    for number, (ours, theirs) in enumerate(zip(made[False], made[True], strict=True)):
        np.testing.assert_array_equal(ours, theirs, err_msg=str(number))


def test_environments_on_a_gpu_end_with_a_reset_of_taichi(as_on_gpu):
    envs = HexForageVectorEnv(2)
    envs.reset(seed=1)
    envs._ants.batched._cells_on_gpu.taichi = lambda: None  # as if it were of another runtime
    with pytest.raises(AntsError, match="Taichi was reset, which destroys environments"):
        pickle.dumps(envs)


FOR_CUDA = """
import os
import drawing, numpy as np, taichi as ti
from taichi_ants import Colony, learners, runtime, train, worlds
from taichi_ants.engines.colony import stepping
from taichi_ants.envs.forage import HexForageVectorEnv
from taichi_ants.learners.config import TrainingConfig
from taichi_ants.task import Task

runtime.start(arch="cuda")
from taichi_ants.engines.launch import call
from taichi_ants.offline import kernels
numbers = ti.types.ndarray(ti.f32, 1)

@ti.kernel
def unguarded(x: numbers):
    for i in x:
        x[i] = x[i] * x[i + 1] + x[i] / x[i + 2]

unguarded(np.ones(9, np.float32))
os.mkdir(guarded := os.environ["PTX_FOLDER"] + "/guarded")
os.environ["PTX_FOLDER"] = guarded

for name in learners.names():
    train(worlds.paper(), TrainingConfig(name, 0.1, 0.9, 0.1, 0.9), 1, 2, 9)
softmax = Task().replace(choice="softmax")
train(worlds.paper(), TrainingConfig("sarsa", 0.1, 0.9, 0.1, 0.9), 1, 2, 9, softmax)
envs = HexForageVectorEnv(3, task=Task().replace(noise={"slip": 0.1, "misread": 0.1}))
envs.reset(seed=1)
envs.step(np.ones(3, int))
envs.rollout("random", 5)
envs.rollout(np.ones((5, 3), int))
pheromone = {"evaporation": "exponential", "half_life": 20, "diffusion": 0.1}
home = {"home": {"deposited_when": "without_food"}}
task = Task().replace(fields=home, homing_cue="home", pheromone=pheromone)
colony = Colony(worlds.paper(), task, TrainingConfig("sarsa", 0.1, 0.9, 0.1, 0.9), ants=9)
colony.begin_episode()
colony.tick()
i32, f32, f64 = np.zeros(9, np.int32), np.zeros(9, np.float32), np.zeros(9)
call(kernels.replay, f32, i32, i32, i32, i32, i32, np.zeros(9, np.uint8), 1, 0.1, 0.9)
call(kernels.iterate, f64, f64, f64, 0, i32, i32, f64, i32, i32, f64, 1, 0.9, 0.0, 0.1)
for group in ("castes_fields", "labour_soft", "own_deposit"):
    for _, drawn in drawing.colonies_of(group, 1):
        for stepping._MOST_IN_ONE_LOOP in (10**9, 0):
            colony = Colony(*drawn.model, **drawn.options)
            colony.begin_episode()
            colony.tick()
assert colony.schedule == "by_ant"
"""


@pytest.mark.slow  # it compiles twenty kernels
@pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
def test_compiled_for_a_gpu_no_product_is_fused_and_no_quotient_approximated(tmp_path):
    driver = Path(__file__).parents[1] / "support" / "fake_cuda.c"
    library = tmp_path / "libcuda.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, driver], check=True)
    folders = {"PTX_FOLDER": tmp_path, "LD_LIBRARY_PATH": tmp_path, "XDG_CACHE_HOME": tmp_path}
    run_script(FOR_CUDA, tmp_path, **folders)
    assert {"div.approx", "fma.rn"} <= changed_arithmetic(tmp_path / "1.ptx")
    files = [*(tmp_path / "guarded").glob("*.ptx")]
    assert len(files) > 20
    for path in files:
        assert not changed_arithmetic(path), path
        # The lengths of all loops are computed before the first one, else each takes a launch more.
        assert path.read_text(encoding="utf-8").count("_serial(") <= 1, path


def changed_arithmetic(path):
    """Return the operations in a file of PTX that a CPU does not have, or that a GPU may fuse."""
    changed = set()
    for kernel in path.read_text(encoding="utf-8").split(".visible .entry "):
        # `rcp.rn`, which is 1 / x, is rounded as on a CPU.
        changed.update(re.findall(r"fma\.rn|(?:div|rcp)\.(?:approx|full)", kernel))
        products = re.findall(r"\bmul\.(?:\w+\.)*f(?:32|64)\s+(%\w+)", kernel)
        for of_sum in re.findall(r"\b(?:add|sub)\.(?:\w+\.)*f(?:32|64)\s+[^;]*", kernel):
            if not set(products).isdisjoint(re.findall(r"%\w+", of_sum)[1:]):
                changed.add(of_sum)
    return changed


def test_all_kernels_have_guards_on_a_gpu():
    plain = {}
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        kernels = len(re.findall(r"^ *@ti.kernel$", text, re.MULTILINE))
        # A pack has the number for the guards, and the launch of other kernels passes it.
        unguarded = kernels - len(re.findall(r"\([ac]: arguments\):|    zero: ti.i32,", text))
        if unguarded:
            plain[path.relative_to(PACKAGE).as_posix()] = unguarded
    assert plain == {
        "engines/learner_check.py": 2,  # `testing` checks rules and learners on the CPU
        "engines/own_rules.py": 1,
        "rendering/raster_kernels.py": 2,  # colours, rounded to whole numbers
    }
