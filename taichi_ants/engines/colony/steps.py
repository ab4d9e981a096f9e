"""Observations and actions of the ants of a colony in a tick, phase by phase; see `rules`.

In a tick, an ant draws from its random stream in this order, and only what applies: if it is idle,
whether it starts foraging; its action, unless that was drawn in the last tick or is given; whether
the action slips; the choice among several food items. Then whether it becomes idle, see `labour`.
Then, when it observes: whether it misreads each cell in view, in the order of
the observation's cells. Then its next action, if its learner draws ahead; and draws of the learner.

Each ant writes a mark of what it wants into `wants` at its own cell, see `rules.conflicts`. The
marks do not change while ants act; each ant removes its mark when it observes at the end of the
tick. If ants can enter cells with ants, see `Traffic`, an additional phase marks the winners before
all ants act.
"""

from collections.abc import Callable
from functools import cache

import taichi as ti
from taichi.lang.impl import subscript
from taichi.math import popcnt

from taichi_ants.arithmetic.random_bits import advance, bits_of, draw_below
from taichi_ants.engines.colony import columns, layout, trail
from taichi_ants.engines.colony.columns import add, function, nest_of, of_caste, put, trait
from taichi_ants.engines.colony.layout import ANT_GROUND, ANT_STANDS, TALLY_WIDTH, CasteRow, Tally
from taichi_ants.engines.colony.trail import deposit, level_in_view, level_of, level_that_counts
from taichi_ants.engines.colony.views import ant_view, cell_view
from taichi_ants.engines.views import fill_codes
from taichi_ants.features.cues import CUES
from taichi_ants.features.fields import OCCASIONS
from taichi_ants.grid.constants import N_HEADINGS
from taichi_ants.kernel_functions import while_compiling
from taichi_ants.learners.memory import values_of
from taichi_ants.task import constants
from taichi_ants.task.constants import EMPTY, FORWARD, LEFT, OBSTACLE, RIGHT, Event
from taichi_ants.task.rules import actions, conflicts, policy, vision


@while_compiling
def state_index_of(c, v, ant):
    return trait(c.paper_state, ant) if v.sees_paper_state else subscript(None, c.state, ant)


@function
def by_cues(c, v, ant, what, arguments):
    """Return what(c, v, cues, *arguments), an i32, for the cues that the ant's caste follows."""
    result = 0
    if ti.static(len(v.cues) == 1):
        result = what(c, v, ti.static(v.cues[0]), *arguments)
    else:
        for i in ti.static(range(len(v.cues))):
            if of_caste(c, ant, CasteRow.CUES) == i:
                result = what(c, v, ti.static(v.cues[i]), *arguments)
    return result


@function
def observe(c, v, w, ant, tick):
    """Return the paper's state and the state index of an ant, which may misread cells."""
    paper_state, state = 0, 0
    if ti.static(len(v.cues) == 1):
        paper_state, state = observe_by(c, v, ti.static(v.cues[0]), w, ant, tick)
    else:
        for i in ti.static(range(len(v.cues))):
            if of_caste(c, ant, CasteRow.CUES) == i:
                paper_state, state = observe_by(c, v, ti.static(v.cues[i]), w, ant, tick)
    return paper_state, state


@function
def observe_by(c, v, cues, w, ant, tick):
    """Return the paper's state and the state index of an ant that follows some cues."""
    paper_state, state = 0, 0
    if ti.static(v.is_papers):
        paper_state = see(c, v, cues, w, ant, tick)
        state = paper_state
        if ti.static(v.misreads):
            state, c.streams[ant] = vision.misread_paper_state(
                paper_state, c.streams[ant], v.at["see"], ant_view(c, v, w, ant)
            )
    elif trait(c.carries, ant) == 1:  # compiled twice, each time without what the other load needs
        paper_state, state = observe_with(c, v, cues, w, ant, 1, tick)
    else:
        paper_state, state = observe_with(c, v, cues, w, ant, 0, tick)
    return paper_state, state


@function
def observe_with(c, v, cues, w, ant, carries, tick):
    """Return the paper's state and the state index of an ant with or without food (`carries`)."""
    view = view_around(c, v, cues, w, ant, carries, tick)
    paper_state = view.paper_state  # the true one
    if ti.static(v.misreads):
        c.streams[ant] = vision.misread_view(
            view, v.observation, c.streams[ant], v.at["see"], ant_view(c, v, w, ant)
        )
    return paper_state, v.encode(view)


@while_compiling
def cells_ahead(c, here, heading):
    """Return the places of the cells left, forward and right of an ant."""
    return [here + actions.step_towards(c.compass, heading, i) for i in (LEFT, FORWARD, RIGHT)]


@function
def see(c, v, cues, w, ant, tick):
    """Return the paper's state, without values that only other observations need."""
    heading, here = trait(c.heading, ant), w * c.size + c.cell[ant]
    cells = cells_ahead(c, here, heading)
    queen = own_queen(c, v, w, ant)
    grounds = [looks_of(c, v, cells[i], queen) for i in ti.static(range(3))]
    paper_state = 0
    if trait(c.carries, ant) == 1:
        if ti.static(cues.has_sense):
            nearer = vision.nearer_from(better_around(c, v, cues, w, ant), heading)
            paper_state = vision.paper_state_carrying(*grounds, nearer)
        else:
            paper_state = see_by_level(c, v.field(c, cues.followed), 1, grounds, cells, tick)
    else:
        paper_state = see_by_level(c, v.field(c, cues.outbound), 0, grounds, cells, tick)
    return paper_state


@while_compiling
def see_by_level(c, field, carries, grounds, cells, tick):
    """Return the paper's state of an ant that follows a pheromone."""
    levels = [level_in_view(c, field, cell, tick) for cell in cells]
    strongest = strongest_of(c, field, *cells, tick)
    return vision.paper_state_by_level(field.half, carries, *grounds, *levels, strongest)


@function
def strongest_of(c, field, left, forward, right, tick):
    """Return the largest level that counts among the three cells ahead."""
    others = ti.max(
        level_that_counts(c, field, forward, tick), level_that_counts(c, field, right, tick)
    )
    return ti.max(level_that_counts(c, field, left, tick), others)


@function
def cue_level(c, v, cues, carries, index, tick):
    """Return the level of a cell in the pheromone that an ant with this load follows.

    If ants have a compass, this is the outbound cue for all ants, or `Choice.carriers_follow`.
    """
    level = ti.cast(level_of(ti.static(v.field(c, cues.outbound)), index, tick), v.level_type)
    if ti.static(cues.followed != cues.outbound):
        followed = ti.static(v.field(c, cues.followed))
        homing = ti.cast(level_of(followed, index, tick), v.level_type)
        level = ti.select(carries == 1, homing, level)
    return level


@function
def strongest_cue(c, v, cues, carries, here, heading, tick):
    """Return the largest level that counts ahead, in the pheromone of `cue_level`."""
    cells = cells_ahead(c, here, heading)
    outbound = ti.static(v.field(c, cues.outbound))
    level = ti.cast(strongest_of(c, outbound, *cells, tick), v.level_type)
    if ti.static(not cues.has_sense):
        field = ti.static(v.field(c, cues.followed))
        homing = ti.cast(strongest_of(c, field, *cells, tick), v.level_type)
        level = ti.select(carries == 1, homing, level)
    return level


@function
def view_around(c, v, cues, w, ant, carries, tick):
    """Return the view of an ant with food (`carries` is 1) or without."""
    heading, here = trait(c.heading, ant), w * c.size + c.cell[ant]
    nearer = vision.nearer_from(better_around(c, v, cues, w, ant), heading)
    queen = own_queen(c, v, w, ant)
    view = v.view_type(carries=carries, own_level=cue_level(c, v, cues, carries, here, tick))
    cells = ti.static(v.observation.cells)
    for k in ti.static(range(len(cells))):
        index = here + actions.step_around(c.compass, heading, cells[k])
        held = ti.cast(c.ground[index] >> 4, ti.i32)  # 0 without an ant
        standable = (c.ground[index] & 15 == EMPTY) | (held != 0)
        view.levels[k] = ti.select(standable, cue_level(c, v, cues, carries, index, tick), 0)
        # 0 without an ant, 1 with a forager, 2 with a carrier.
        view.ants[k] = (held + 1) >> 3
        if ti.static(v.n_nests > 1):
            ours = held & ANT_STANDS == ANT_STANDS - nest_of(c, v, ant)
            view.ants[k] = ti.select(ours, 1 + (held >> 3), 0)
            view.other_nest_ants[k] = ti.cast((held != 0) & (not ours), ti.i32)
        if ti.static(cues.has_sense):
            view.nearer[k] = nearer >> (cells[k] % N_HEADINGS) & 1
        else:
            view.nearer[k] = ti.cast(view.levels[k] > view.own_level, ti.i32)
        view.codes[k] = looks_of(c, v, index, queen)
        read_fields(c, v, view, k, index, standable, tick)
    read_own_levels(c, v, view, here, tick)
    view.strongest = strongest_cue(c, v, cues, carries, here, heading, tick)
    fill_codes(cues.half, cues.homing_view, view, v.observation)
    return view


@function
def read_fields(c, v, view, k, index, standable, tick):
    """Set the levels of cell number k of a view in the pheromones that the observation reads."""
    for i in ti.static(range(len(v.reads))):
        level = level_of(ti.static(v.field(c, v.reads[i])), index, tick)
        vision.entry_of(view, v.observation.reads[i])[k] = ti.select(standable, level, 0)


@while_compiling
def read_own_levels(c, v, view, here, tick):
    """Set the levels of the ant's own cell in the pheromones that the observation reads."""
    for name, number in zip(v.observation.reads, v.reads, strict=True):
        getattr(view, f"own_{name}")._assign(level_of(v.field(c, number), here, tick))


@function
def looks_of(c, v, index, queen):
    """Return the ground of a cell, i32, as an ant sees it whose queen is on the cell `queen`.

    Ants, and the queens of other nests, look like obstacles.
    """
    ground = ti.cast(c.ground[index] & 15, ti.i32)
    if ti.static(v.n_nests > 1):
        ground = ti.select((ground == constants.QUEEN) & (index != queen), OBSTACLE, ground)
    return ground


@function
def holds_nestmate(c, v, ant, index):
    """Return whether an ant of the same nest is on a cell; others are obstacles."""
    held = ti.cast(c.ground[index] >> 4, ti.i32)
    holds = held != 0
    if ti.static(v.n_nests > 1):
        holds = held & ANT_STANDS == ANT_STANDS - nest_of(c, v, ant)
    return holds


@while_compiling
def own_queen(c, v, w, ant):
    """Return the place of an ant's queen in `ground`; -1 with one nest, which needs none."""
    if v.n_nests == 1:
        return -1
    column = w * v.n_nests + nest_of(c, v, ant)
    return w * c.size + subscript(None, c.nests, layout.NestRow.QUEEN_CELL, column)


@while_compiling
def better_around(c, v, cues, w, ant):
    """Return a bit for each heading: 1 if the homing cue, not a pheromone, is better there."""
    return CUES[cues.sense].better(ant_view(c, v, w, ant)) if cues.sense else 0


@function
def table_of(c, v, owner):
    """Return the start of the tables of an ant, or of a world whose ants share a table."""
    return owner * c.tables * v.n_numbers


@function
def owner_of(c, v, w, ant):
    """Return the owner of the table by which an ant chooses: its slot, or its world and group."""
    return ant if ti.static(v.own_tables) else w * v.n_groups + columns.group_of(c, v, ant)


@function
def draw_action(c, v, w, ant, state, paper_state, tick, random_state):
    """Return the ant's action in a state, by a random stream that was advanced for it."""
    action, bits = 0, bits_of(random_state)
    if ti.static(v.draw_by_cues):
        arguments = ti.static((w, ant, state, paper_state, tick, bits))
        action = by_cues(c, v, ant, v.draw_by_cues, arguments)
    else:
        table = table_of(c, v, owner_of(c, v, w, ant))
        explore_below = explore_below_of(c, v, w, ant)
        if ti.static(v.draw_by_values):
            values = values_of(c.q, table, state)
            action = v.draw_by_values(ant_view(c, v, w, ant), values, bits, explore_below)
        else:
            best = best_actions_of(c, v, table, state)
            action = policy.choose_in_crowd(c.compass, best, bits, explore_below)
    return action


@while_compiling
def best_actions_of(c, v, table, state):
    """Return the `best_actions` of a state; they are stored unless ants have their own tables."""
    if v.independent:
        return policy.best_actions(values_of(c.q, table, state))
    place = table + state * constants.ROW + constants.BEST_AT
    return ti.cast(subscript(None, c.q, place), ti.i32)


@function
def own_reward(c, v, w, ant, paper_state, tick):
    """Return the reward of an ant by your own rule, i32; `paper_state` is the new one."""
    return by_cues(c, v, ant, v.own_reward, ti.static((w, ant, paper_state, tick)))


@function
def cell_ahead(c, v, cues, w, ant, state, paper_state, i: ti.template()):
    """Return how an ant sees the cell left (0), forward (1) or right (2) of it, i32 each.

    `state` is the paper's state as the ant sees it, `paper_state` the true one. A cell with an ant
    is open if the traffic rules ever let an ant with this load enter it.

    Returns:
        Its code; 1 if the ant does not misread it; 1 if it is open; 1 if it is nearer to the queen.
    """
    heading, carries = trait(c.heading, ant), trait(c.carries, ant)
    code = vision.code_in_view(state, i)
    is_true = code == vision.code_in_view(paper_state, i)
    opens = ti.cast(actions.is_open(code), ti.i32)
    nears = ti.cast(code == constants.SEES_CUE, ti.i32) & ti.static(int(cues.has_sense))
    index = w * c.size + c.cell[ant] + actions.step_towards(c.compass, heading, i)
    if is_true & (c.ground[index] >> 4 != 0):  # an ant stands there
        nearer = vision.nearer_from(better_around(c, v, cues, w, ant), heading)
        nears = nearer >> ti.static((i - 1) % N_HEADINGS) & 1
        if ti.static(v.traffic.shared):
            if holds_nestmate(c, v, ant, index):
                opens = 1 if ti.static(v.traffic.follow) else carries
    return code, ti.cast(is_true, ti.i32), opens, nears


@function
def explore_below_of(c, v, w, ant):
    """Return the bound of a random 32-bit word below which an ant explores, u64."""
    bound = c.explore_below
    if ti.static(v.n_castes > 0):
        of_own_caste = of_caste(c, ant, CasteRow.EPSILON)
        if of_own_caste >= 0.0:
            if ti.static(v.epsilon_varies):
                spread = of_caste(c, ant, CasteRow.EPSILON_SPREAD)
                of_own_caste += spread * (2.0 * columns.individual(c, w, ant) - 1.0)
            bound = ti.cast(of_own_caste * 4294967296.0, ti.u64)
    return bound


@function
def draw_cell(c, v, cues, w, ant, state, paper_state, tick, bits):
    """Return the ant's action by a rule that compares levels ahead, with 64 random bits.

    `state` is the paper's state as the ant sees it, `paper_state` the true one. A cell that it
    misreads looks as if it had no trail, and is nearer to the queen if it looks S. With a field as
    homing cue, no cell is nearer.
    """
    heading, carries = trait(c.heading, ant), trait(c.carries, ant)
    here = w * c.size + c.cell[ant]
    codes, opens, nears = ti.Vector([0, 0, 0]), ti.Vector([0, 0, 0]), ti.Vector([0, 0, 0])
    weights = ti.Vector([ti.f64(0.0), ti.f64(0.0), ti.f64(0.0)])
    for i in ti.static((LEFT, FORWARD, RIGHT)):
        codes[i], is_true, opens[i], nears[i] = cell_ahead(
            c, v, cues, w, ant, state, paper_state, i
        )
        index = here + actions.step_towards(c.compass, heading, i)
        level = cue_level(c, v, cues, carries, index, tick)
        weights[i] = v.attraction(ant_view(c, v, w, ant), ti.select(is_true == 1, level, 0))
    return v.choose_cell(carries, codes, opens, nears, weights, bits)


@while_compiling
def executed_by(c, v, ant):
    return trait(c.executed if v.slips else c.action, ant)


@function
def want(c, v, w, chunk, ant, tick):
    """Turn an ant, and write what its action needs: a cell to enter, or food to take.

    There are few branches, because the processor cannot predict the actions of ants.
    """
    action, paper_state = -1, trait(c.paper_state, ant)
    cell, carries = c.cell[ant], trait(c.carries, ant)
    random_state = c.streams[ant]
    if ti.static(v.is_given_actions):
        action = trait(c.action, ant)
    elif ti.static(v.draws_next_action):
        action = trait(c.next_action, ant)
    resting = 0
    for choose in ti.static(v.at["choose"]):
        rests, random_state = choose(ant_view(c, v, w, ant), random_state)
        if rests == 1:  # `act` does nothing then, and `observe_and_learn` removes the action
            resting, action = 1, constants.GIVE
    if action < 0:
        random_state = advance(random_state)
        state = state_index_of(c, v, ant)
        action = draw_action(c, v, w, ant, state, paper_state, tick, random_state)
    chosen = action
    for execute in ti.static(v.at["execute"]):
        if resting == 0:
            action, random_state = execute(ant_view(c, v, w, ant), action, random_state)
    heading = actions.turned_by(c.compass, trait(c.heading, ant), action)
    step = actions.step_towards(c.compass, heading, FORWARD)
    # Arithmetic, because the compiler makes branches of selections between values in memory.
    enters = 1 - (vision.code_in_view(paper_state, action) & 1)
    if ti.static(v.traffic.shared):
        enters |= ti.cast(holds_nestmate(c, v, ant, w * c.size + cell + step), ti.i32)
    enters &= actions.MOVES >> action
    wanted = cell + enters * step
    mark = v.mark_of_rest + enters * (conflicts.ENTER + heading - v.mark_of_rest)
    foods = vision.goals_in_view(paper_state) * (1 - carries)  # no branch by `carries`
    if (foods != 0) & (action == constants.PICK_UP):
        position = policy.lowest_bit_number(foods)
        if foods & (foods - 1) != 0:  # several food items in view
            k, random_state = draw_below(random_state, popcnt(foods))
            position = policy.bit_number(foods, k)
        wanted = cell + actions.step_towards(c.compass, heading, position)
        mark = conflicts.TAKE + (heading + position + N_HEADINGS - 1) % N_HEADINGS
    if ti.static(v.traffic.shared):
        takes = ti.select(mark >= conflicts.TAKE, conflicts.TAKES_FOOD, 0)
        mark |= carries * conflicts.HAS_FOOD | takes
    # All writes are last, because the compiler reads the addresses of arrays again after each.
    c.streams[ant] = random_state
    put(c.action, ant, chosen)
    if ti.static(v.slips):
        put(c.executed, ant, action)
    put(c.heading, ant, heading)
    c.want[ant] = wanted
    c.wants[w * c.size + cell] = ti.cast(mark, ti.u8)


@function
def resolve(c, v, w, chunk, ant, tick):
    """Mark the ant if it wins its cell, and store the event of its move.

    Only rules by which ants can enter cells with ants need this. The event of a move does not
    depend on the deposits of this tick.
    """
    base, cell, wanted = w * c.size, c.cell[ant], c.want[ant]
    if ti.static(v.traffic.reward_pushed):  # then a pushed ant may need the event, too
        put(c.event, ant, event_of(c, v, w, ant, tick))
    if wanted != cell:
        if conflicts.wins_cell(c, v.traffic, base, cell, wanted, tick):
            if ti.static(not v.traffic.reward_pushed):
                put(c.event, ant, event_of(c, v, w, ant, tick))
            c.wants[base + cell] = c.wants[base + cell] | ti.u8(conflicts.WINS)
        else:
            c.want[ant] = cell


@function
def step_ahead(c, ant):
    return actions.step_towards(c.compass, trait(c.heading, ant), FORWARD)


@function
def event_of(c, v, w, ant, tick):
    """Return the event of a successful move; a cell with an ant shows a cue if it is better."""
    action, paper_state = executed_by(c, v, ant), trait(c.paper_state, ant)
    event = actions.move_event(vision.code_in_view(paper_state, action))
    here = w * c.size + c.cell[ant]
    ahead = here + step_ahead(c, ant)
    if conflicts.had_ant(c, ahead):  # rare, so that few trails are read
        better = by_cues(c, v, ant, is_better, ti.static((w, ant, ahead, here, tick)))
        event = ti.select(better == 1, Event.ENTERED_CUE, Event.ENTERED_EMPTY)
    return event


@function
def is_better(c, v, cues, w, ant, ahead, here, tick):
    better = is_stronger(ti.static(v.field(c, cues.outbound)), ahead, here, tick)
    if trait(c.carries, ant) == 1:
        if ti.static(cues.has_sense):
            bits = ti.cast(better_around(c, v, cues, w, ant), ti.i32)
            better = bits >> trait(c.heading, ant) & 1 == 1
        else:
            better = is_stronger(ti.static(v.field(c, cues.followed)), ahead, here, tick)
    return ti.cast(better, ti.i32)


@function
def is_stronger(field, index, from_index, tick):
    """Return whether the level of a cell is higher than that of another one."""
    return level_of(field, index, tick) > level_of(field, from_index, tick)


@function
def act(c, v, w, chunk, ant, tick):
    """Do the action of an ant: move or pick up if it has won, or deliver; and deposit."""
    base = w * c.size
    first = ti.static(v.field(c, 0))
    action, paper_state = executed_by(c, v, ant), trait(c.paper_state, ant)
    cell, wanted = c.cell[ant], c.want[ant]
    carries, heading = trait(c.carries, ant), trait(c.heading, ant)
    moves = actions.MOVES >> action & 1
    goes, filled, enters, takes = cell, False, 0, False
    event = Event.FAILED + moves * ti.static(Event.BLOCKED - Event.FAILED)
    if ti.static(v.traffic.shared):
        ahead = cell + step_ahead(c, ant)
        goes, filled, event, entered = conflicts.resolve_move(
            *(c, v.traffic, base, cell, wanted, ahead, carries, moves == 1, trait(c.event, ant))
        )
        enters = ti.cast(entered, ti.i32)
        takes = (moves == 0) & (wanted != cell)
    else:
        won = conflicts.wins_cell(c, v.traffic, base, cell, wanted, tick)
        # Arithmetic, because the compiler would make branches, which nothing can predict here.
        enters, takes = ti.cast(won, ti.i32) & moves, won & (moves == 0)
        goes = cell + enters * (wanted - cell)
        event += enters * (vision.code_in_view(paper_state, action) + Event.ENTERED_EMPTY - event)
    if not filled:
        c.ground[base + cell] = EMPTY
    c.want[ant] = cell  # the cell with the ant's mark
    had_food, age = carries, c.carried[ant]
    for rests in ti.static(v.at["rests"]):  # an ant that rests with food keeps it
        action = ti.select(rests(ant_view(c, v, w, ant)) == 1, -1, action)
    if carries == 1:
        carried = age
        if goes != cell:
            if ti.static(not v.lays_in_turn):
                if lays(c, v, ant, 0):
                    index = base + goes
                    deposit(c, v, first, w, ant, index, tick, carried, carries, event, paper_state)
        elif actions.can_give(action, paper_state):
            tally(c, v, Tally.CARRIED, chunk, carried)
            event, carries, carried = ti.cast(Event.DELIVERED, ti.i32), 0, -1
            put(c.carries, ant, 0)
            put(c.heading, ant, actions.heading_after_delivery(heading, c.turns_at_queen))
            tally(c, v, Tally.DELIVERIES, chunk, 1)
            count_apart(c, v, ant, chunk)
            for gave in ti.static(v.at["gave"]):
                gave(ant_view(c, v, w, ant))
        c.carried[ant] = carried + 1
    elif takes:
        event, carries = ti.cast(Event.PICKED_UP, ti.i32), 1
        put(c.carries, ant, 1)
        c.carried[ant] = 1
        take_load(c, v, ant, base + wanted, tick)
        if ti.static(not v.lays_in_turn):
            if lays(c, v, ant, 0):
                deposit(c, v, first, w, ant, base + wanted, tick, 0, carries, event, paper_state)
                deposit(c, v, first, w, ant, base + cell, tick, 0, carries, event, paper_state)
        put(c.heading, ant, actions.turn_round(heading))
    if ti.static(len(v.pheromones) > 1):
        age = ti.select(carries == had_food, age, 0)
        occasions = trail.occasions_of(had_food, paper_state, action, event, goes != cell)
        for rests in ti.static(v.at["rests"]):
            occasions *= 1 - rests(ant_view(c, v, w, ant))
        for i in ti.static(range(1, 1 if v.lays_in_turn else len(v.pheromones))):
            if lays(c, v, ant, i):
                field = ti.static(v.field(c, i))
                laid = field.deposited_when & occasions  # a single one, see `Field.deposited_when`
                trail.lay(
                    *(c, v, field, w, ant, laid, cell, goes, wanted, tick, age),
                    *(carries, event, paper_state),
                )
        if c.counts_without_food == 1:
            c.carried[ant] = age + 1
    ground = ANT_GROUND
    if ti.static(v.sees_ants or v.n_nests > 1):
        ground = OBSTACLE | ((ANT_STANDS - nest_of(c, v, ant)) << 4) + (carries << 7)
    c.ground[base + goes] = ti.cast(ground, ti.u8)
    c.cell[ant] = goes
    for rests in ti.static(v.at["rests"]):
        event = ti.select(rests(ant_view(c, v, w, ant)) == 1, ti.cast(Event.NONE, ti.i32), event)
    put(c.event, ant, event)
    tally(c, v, Tally.MOVES, chunk, moves)
    tally(c, v, Tally.BLOCKED, chunk, moves & (1 - enters))
    if ti.static(not v.has_own_reward):
        tally(c, v, Tally.RETURNS, chunk, reward_of(c, v, ant))


@cache
def lays_field(number: int) -> Callable[..., None]:
    """Return the `do` of a phase after `act` in which ants lay a pheromone, see `lays_in_turn`."""

    @function
    def lay_apart(c, v, w, chunk, ant, tick):
        cell, goes, carries = c.want[ant], c.cell[ant], trait(c.carries, ant)
        event, paper_state = trait(c.event, ant), trait(c.paper_state, ant)
        changed = (event == Event.PICKED_UP) | (event == Event.DELIVERED)
        had_food = ti.select(changed, 1 - carries, carries)
        age = ti.select(carries == had_food, c.carried[ant] - 1, 0)
        action = executed_by(c, v, ant)
        occasions = trail.occasions_of(had_food, paper_state, action, event, goes != cell)
        for rests in ti.static(v.at["rests"]):
            occasions *= 1 - rests(ant_view(c, v, w, ant))
        food = cell + c.compass[conflicts.heading_taken(c, w * c.size + cell) + 1]
        field = ti.static(v.field(c, number))
        laid = occasions & ti.static(int(OCCASIONS["with_food"]))
        if ti.static(number > 0):
            laid = occasions & field.deposited_when
        if lays(c, v, ant, number):
            trail.lay(
                *(c, v, field, w, ant, laid, cell, goes, food, tick, age),
                *(carries, event, paper_state),
            )

    return lay_apart


@while_compiling
def lays(c, v, ant, number):
    """Return whether an ant lays a pheromone; without castes, always, while a kernel compiles."""
    if v.n_castes == 0:
        return True
    return ti.cast(of_caste(c, ant, CasteRow.LAYS), ti.i32) >> number & 1 == 1


@function
def tally(c, v, state, chunk, n):
    """Add n to a tally of a chunk."""
    add(v, c.tallies, chunk * TALLY_WIDTH + state, n)


@function
def count_apart(c, v, ant, chunk):
    """Count a delivery by nest and kind of food, if there are several, and by caste."""
    if ti.static(v.counts_by_nest_and_kind):
        column = chunk * layout.NESTS_BY_KINDS + nest_of(c, v, ant) * v.n_kinds
        if ti.static(v.n_kinds > 1):
            column += trait(c.kind, ant)
        add(v, c.delivered, column, 1)
    if ti.static(v.n_castes > 0):
        add(v, c.delivered_by_caste, chunk * constants.MAX_CASTES + trait(c.caste, ant), 1)


@while_compiling
def reward_of(c, v, ant):
    return subscript(None, c.reward, ant) if v.has_own_reward else event_reward(c, v, ant)


@function
def event_reward(c, v, ant):
    """Return the reward of the last event of an ant by the settings of the task, i32."""
    event = trait(c.event, ant)
    reward = c.rewards[event]
    for pays in ti.static(v.at["pays"]):
        reward = pays(ant_view(c, v, None, ant), event, reward)
    return reward


@function
def take_load(c, v, ant, index, tick):
    """Take a load of food from a cell; after its last load, its food source waits from now on."""
    loads_left = 0
    for took in ti.static(v.at["took"]):
        loads_left = took(ant_view(c, v, None, ant), cell_view(c, v, index), loads_left)
    if loads_left == 0:
        c.ground[index] = EMPTY
        if c.n_food_sources > 0:
            source = c.source_of[index]
            if source >= 0:
                c.food_sources[layout.FoodSourceRow.TAKEN, source] = tick
                c.source_of[index] = -1
