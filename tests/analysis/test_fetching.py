"""The best policy of the task "fetching" delivers, and that of the paper's rewards walks a trail.

Bounds are exact where the state space allows. A world of the kind "open" has up to 54 million
states, too many for them. But few of them are states of an ant without food, in which another
argument is exact, too: the soonest possible pick-up needs no failed action, nor does the way home
after it. A policy that never delivers returns at most the reward of this pick-up, and the way home
adds that of a delivery, at every discount.
"""

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from taichi_ants import Task, worlds
from taichi_ants.analysis.bounds import EpisodeBounds, ExpectedEpisode, in_view, look_around
from taichi_ants.worlds import World

FETCHING = Task.named()["fetching"]


def steps_from(starts: np.ndarray, edges: np.ndarray, n: int) -> np.ndarray:
    """The number of steps along `edges`, (2, E), from the nearest of `starts` to each state."""
    first = np.stack([np.full(len(starts), n), starts])  # from one further state
    froms, to = np.concatenate([edges, first], axis=1)
    graph = coo_array((np.ones(len(to)), (froms, to)), shape=(n + 1, n + 1)).tocsr()
    return dijkstra(graph, indices=n, unweighted=True)[:n] - 1


def delivering_pays(world: World) -> bool:
    """Whether the argument above holds: no failed action is needed, neither out nor home."""
    around = look_around(world)
    [cell], [heading] = world.start(seed=0)
    start = np.array([heading * len(around.cells) + np.searchsorted(around.cells, cell)])
    states, follows = np.tile(np.arange(around.n_states), (3, 1)), around.moves(around.empty)
    succeeds = in_view(around.empty)
    every = np.stack([states.reshape(-1), follows.reshape(-1)])
    good = np.stack([states[succeeds], follows[succeeds]])
    takes = around.sees(around.food)
    soonest = steps_from(start, every, around.n_states)[takes].min()
    out = steps_from(start, good, around.n_states)[takes]
    back = steps_from(around.sees(around.queen), good[::-1], around.n_states)
    home = np.isfinite(back[around.turned_round(takes)])
    return bool(np.isfinite(soonest) and (home & (out == soonest)).any())


@pytest.mark.parametrize(("name", "steps"), [("paper", 34), ("double_bridge", 64)])
def test_the_best_policy_delivers_at_every_discount(name: str, steps: int) -> None:
    world = worlds.build(name)
    bounds = EpisodeBounds(world, FETCHING)
    assert delivering_pays(world)
    assert bounds.shortest() == ExpectedEpisode(13, steps, 1)
    for discount in (0.9, 0.95, 0.99, 0.999) if name == "paper" else (0.999,):
        assert bounds.optimal(discount, 600)[1] == pytest.approx((13, steps, 1))


@pytest.mark.parametrize("name", ["open", "far_piles"])
def test_circling_never_pays_in_drawn_worlds(name: str) -> None:
    assert all(delivering_pays(worlds.build(name, seed)) for seed in range(20))


def test_a_dead_end_is_found() -> None:
    """The control: in a corridor, an ant that faces the queen can turn only by a failed move."""
    faces_food, faces_queen = (
        World((5, 1, 1), (0, 0, 0), foods=[(4, 0, 0)], ants=[((1, 0, 0), heading)])
        for heading in (0, 3)
    )
    assert delivering_pays(faces_food)
    assert not delivering_pays(faces_queen)


def outcomes(world: World) -> list[float]:
    """The return and steps of the shortest delivery, and the best returns at 0.9 and 0.99."""
    bounds = EpisodeBounds(world, Task())
    shortest, near, far = bounds.shortest(), *(bounds.optimal(d, 600)[1] for d in (0.9, 0.99))
    assert shortest is not None
    assert [shortest.deliveries, near.deliveries, far.deliveries] == pytest.approx([1, 1, 0])
    return [shortest.episode_return, shortest.steps, near.episode_return, far.episode_return]


def test_under_the_papers_rewards_the_best_policy_delivers_only_at_low_discounts() -> None:
    """The numbers on docs/how-to/train_an_agent.md."""
    assert outcomes(worlds.paper()) == pytest.approx([45, 34, 45, 476])
    bounds = EpisodeBounds(worlds.paper(), Task())
    best = [bounds.optimal(discount, 600)[1].deliveries for discount in (0.961, 0.962)]
    assert best == pytest.approx([1, 0])


@pytest.mark.slow
def test_the_same_holds_in_larger_worlds() -> None:
    assert outcomes(worlds.double_bridge()) == pytest.approx([41, 64, 41, 268])
    assert outcomes(worlds.open_world(ranges=(12, 12, 12))) == pytest.approx([17, 10, 17, 285])
