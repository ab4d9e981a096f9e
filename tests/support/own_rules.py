"""Rules of each kind, which use all inputs and operators; a plugin file for tests."""

from typing import Annotated

from taichi_ants import rules
from taichi_ants.rules import exp, log, pick, power
from taichi_ants.settings import Setting
from taichi_ants.task.constants import Event

HIGHEST = 1000


@rules.register("evaporation")
def power_law(
    level,
    tick,
    exponent: Annotated[float, Setting("exponent of the loss", least=1, most=1.5)] = 1.1,
):
    """Return the level after a loss that grows faster than the level."""
    return max(level - 0.001 * power(level, exponent) - (tick % 2), 0) if level > 1 else 0


@rules.register("deposit")
def weaker(
    level,
    carried,
    carries,
    event,
    paper_state,
    trait,
    tick,
    amount: Annotated[float, Setting("level of a new deposit", least=0, most=300)] = 100.0,
):
    """Return a level that depends on all inputs."""
    found = level
    if event == Event.PICKED_UP or (paper_state % 4 == 2 and not carries):
        found = max(level, 3 * amount)
    elif 0 < tick < 5:
        pass
    else:
        found += amount * exp(-carried / 20) + log(1 + level) + 9 * trait
    return min(found, HIGHEST)


@rules.register("deposit")
def alarm(
    level,
    level_trail,
    level_B,  # noqa: N803
    threshold,
    stimulus,
    carries,
    amount=30.0,
):
    """Return a level that depends on other pheromones and on the division of labour."""
    found = level
    if level_trail < 5 * amount and stimulus > threshold / 4:
        found = amount + level_B / 2 + 7 * carries
    return min(found, HIGHEST)


@rules.register("choice")
def weber(
    codes,
    levels,
    nearer,
    is_open,
    level,
    carries,
    random,
    k: Annotated[float, Setting("attraction of a cell without a trail", least=1, most=30)] = 20.0,
    exponent: Annotated[float, Setting("exponent of the attraction", least=0, most=5)] = 1.5,
):
    """Return an action without action values."""
    weights = [power(k + abs(levels[i] - level / 2), exponent) for i in range(3)]
    weights = [weights[i] if is_open[i] and (nearer[i] or not carries) else 0 for i in range(3)]
    best = pick(weights, random)
    if codes[0] == 3 or codes[1] == 3 or codes[2] == 3:
        best = 4 if carries else 3
    elif best < 0:
        best = 2 * pick([1, 1], random)
    return best


@rules.register("choice")
def restless(
    values,
    epsilon,
    random,
    random_2,
    level_trail,
    levels_trail,
    paper_state,
    trait,
    tick,
    boost: Annotated[int, Setting("addition to a value", least=0, most=9)] = 1,
):
    """Return an action by action values and levels."""
    best = 0
    top = values[0]
    for a in range(1, 5):
        value = values[a]
        if a == 3:
            value += boost * (levels_trail[0] > level_trail)
        if value > top:
            top = value
            best = a
    if random < epsilon + 0.2 * trait:
        best = (random_2 * 5 + tick + paper_state) // 1 % 5
    return best


@rules.register("reward")
def shaped(
    reward,
    event,
    carries,
    paper_state,
    next_paper_state,
    levels,
    level,
    trait,
    tick,
    scale: Annotated[float, Setting("reward for a rising level", least=0, most=9)] = 2.0,
):
    """Return a reward that depends on all inputs."""
    more = 0
    if levels[1] > level and not carries:
        more = scale
    if event == Event.DELIVERED:
        more += 5 + tick % 3
    if paper_state == next_paper_state:
        more -= 1 + (trait < 0.3)
    return min(max((reward + more) // 1, -1000), 1000)


@rules.register("choice")
def hungry(codes, carries, threshold, stimulus, trait, random, random_2):
    """Return an action that depends on the division of labour."""
    action = random * 3 // 1
    if random_2 + stimulus > threshold or trait < 0.5:
        for i in range(3):
            if codes[i] == 3:
                action = 3 + carries
            elif codes[i] == 2:
                action = i
    return min(action, 4)


@rules.register("reward")
def demanded(reward, event, threshold, stimulus):
    """Return a reward that depends on the division of labour."""
    more = 0
    if event == Event.DELIVERED and stimulus > threshold:
        more = 4
    return min(max(reward + more + min(stimulus, 9) // 1, -1000), 1000)
