"""Learning in a colony: with one table for all ants, or one table per ant.

With a shared table, all ants choose and compute their TD errors by the table at the start of the
tick. The n errors of a pair are summed as 64-bit fixed-point numbers, so that their order does not
matter. The value moves by weights[n] times their mean, as n successive updates towards one target
would move it.

Each chunk of ants has its own sums, without atomic operations, unless `v.by_ant`. If a world is one
chunk, `touched` lists the pairs with updates: their number, then the pairs. Else `touched` marks
the states with updates, and chunks share the states: each joins the sums of its states into those
of the world, which come before those of chunks, and applies them. With `v.by_ant`, threads join
them atomically: whole numbers, whose order does not matter, as that of ants.
"""

import taichi as ti
from taichi.lang.impl import subscript

from taichi_ants.arithmetic.random_bits import advance, draw_below
from taichi_ants.engines.colony import columns, steps
from taichi_ants.engines.colony.columns import chunks_of, function
from taichi_ants.engines.colony.layout import TOUCHED_LINE, CasteRow, Stage, SumRow, Tally
from taichi_ants.engines.colony.views import ant_view
from taichi_ants.kernel_functions import while_compiling
from taichi_ants.learners import model
from taichi_ants.learners.memory import At, LearnerArrays, Transition, discount_of, values_of
from taichi_ants.task.constants import BEST_AT, N_ACTIONS, ROW, Event
from taichi_ants.task.rules.actions import step_end, terminates
from taichi_ants.task.rules.policy import best_actions

_ONE = 4294967296.0  # fixed-point numbers have 32 binary places


@function
def see_anew(c, v, w, ant, tick):
    """Update the paper's state and the state index of an ant."""
    paper_state, state = steps.observe(c, v, w, ant, tick)
    note_seen(c, v, ant, paper_state, state)


@function
def note_seen(c, v, ant, paper_state, state):
    columns.put(c.paper_state, ant, paper_state)
    if ti.static(not v.sees_paper_state):
        c.state[ant] = state


@function
def begin(c, v, w, chunk, ant, tick):
    """Let an ant observe and its learner start an episode, unless its world is within one."""
    if tick == 0:
        if ti.static(v.misreads):
            # An ant that has observed already must not draw again.
            if c.streams[ant] == c.first_streams[w * c.n_slots + c.number[ant]]:
                see_anew(c, v, w, ant, 0)
        else:
            see_anew(c, v, w, ant, 0)
        begin_to_learn(c, v, ant)
        for born in ti.static(v.at["born"]):
            born(ant_view(c, v, w, ant))


@function
def see_interventions(c, v, w, chunk, ant, tick):
    """Let an ant observe after interventions; an ant that was just added becomes living."""
    if columns.trait(c.stage, ant) == Stage.NEWBORN:
        columns.put(c.stage, ant, Stage.LIVING)
        if ti.static(v.independent):
            reset_slot(c, v, ant)
        for born in ti.static(v.at["born"]):
            born(ant_view(c, v, w, ant))
    see_anew(c, v, w, ant, tick)


@function
def observe_and_learn(c, v, w, chunk, ant, tick):
    """Observe, choose the next action if the learner needs it, and learn."""
    lives, marked = True, w * c.size + c.want[ant]
    if ti.static(v.ants_change):  # else no ant is born within a tick
        lives = columns.trait(c.stage, ant) != Stage.NEWBORN
    acts, stops = lives, False
    for rests in ti.static(v.at["rests"]):
        acts = acts & (rests(ant_view(c, v, w, ant)) == 0)
    for acted in ti.static(v.at["acted"]):
        if acts:
            if acted(ant_view(c, v, w, ant)):
                stops = True
    paper_state, state = steps.observe(c, v, w, ant, tick + 1)
    next_action = -1
    if ti.static(v.has_own_reward):
        c.reward[ant] = 0
        if acts:
            c.reward[ant] = steps.own_reward(c, v, w, ant, paper_state, tick)
            steps.tally(c, v, Tally.RETURNS, chunk, c.reward[ant])
    if acts & learns(c, v, ant):
        if ti.static(v.draws_next_action):
            if terminates(columns.trait(c.event, ant), c.delivery_terminates) == 0:
                c.streams[ant] = advance(c.streams[ant])
                next_action = steps.draw_action(
                    c, v, w, ant, state, paper_state, tick + 1, c.streams[ant]
                )
        if ti.static(v.independent):
            learn_alone(c, v, ant, state, next_action, tick, stops)
        elif ti.static(v.together):
            share_error(c, v, w, chunk, ant, state, next_action)
    if lives:
        c.wants[marked] = 0
    note_seen(c, v, ant, paper_state, state)
    if ti.static(v.at["rests"]):
        next_action = ti.select(stops, -1, next_action)
        rest(c, v, w, ant, acts, stops)
    if ti.static(v.draws_next_action):
        columns.put(c.next_action, ant, next_action)


@while_compiling
def learns(c, v, ant):
    """Return whether an ant learns; without castes, always, while a kernel compiles."""
    return columns.of_caste(c, ant, CasteRow.LEARNS) == 1.0 if v.n_castes > 0 else True


@function
def rest(c, v, w, ant, acts, stops):
    """Let an ant begin to rest if it `stops`; one without an action has the last action -1."""
    if not acts:
        columns.put(c.action, ant, -1)
        if ti.static(v.slips):
            columns.put(c.executed, ant, -1)
    if stops:
        for stopped in ti.static(v.at["stopped"]):
            stopped(ant_view(c, v, w, ant))
        begin_to_learn(c, v, ant)


@function
def memory_of(c, v, owner):
    """Return the start of the tables and of the memory of a slot, or of a world and group."""
    return At(steps.table_of(c, v, owner), owner * c.floats_by_8 * 8, owner * c.integers_by_8 * 8)


@function
def rates_of(c, v, caste):
    """Return learning rate, discount, epsilon and the hyperparameters of the learner."""
    learning_rate, discount, epsilon = c.weights[1], c.discount, c.epsilon
    if ti.static(v.n_castes > 0):
        learning_rate = own_number(c, caste, ti.static(CasteRow.LEARNING_RATE), learning_rate)
        discount = own_number(c, caste, ti.static(CasteRow.DISCOUNT), discount)
        epsilon = own_number(c, caste, ti.static(CasteRow.EPSILON), epsilon)
    return v.read_rates(learning_rate, discount, epsilon, c.hyperparameters, 0)


@function
def own_number(c, caste, row, default):
    """Return a number of a caste as f32, or `usual` if it has none."""
    value = c.castes[row, caste]
    return ti.select(value >= 0.0, ti.cast(value, ti.f32), default)


@while_compiling
def caste_of(c, v, ant):
    """Return the caste of an ant, 0 without castes."""
    return columns.trait(c.caste, ant) if v.n_castes > 0 else 0


@function
def begin_to_learn(c, v, ant):
    """Let the learner of an ant with its own table start an episode."""
    if ti.static(v.begins):
        memory = ti.static(LearnerArrays(c.q, c.floats, c.integers, v.observation.n_states))
        v.learner.begin(memory, memory_of(c, v, ant))


@function
def reset_slot(c, v, ant):
    """Reset the tables and the memory of a slot for a newborn ant."""
    at = memory_of(c, v, ant)
    for i in range(at.table, steps.table_of(c, v, ant + 1)):
        c.q[i] = ti.select(i % ROW < N_ACTIONS, c.initial_q, 0.0)
    for i in range(at.floats, at.floats + c.floats_by_8 * 8):
        c.floats[i] = 0.0
    for i in range(at.integers, at.integers + c.integers_by_8 * 8):
        c.integers[i] = 0
    begin_to_learn(c, v, ant)


@function
def learn_alone(c, v, ant, seen, next_action, tick, stops):
    """Update the ant's own table, as if it were alone; its episode ends if it `stops`."""
    memory = ti.static(LearnerArrays(c.q, c.floats, c.integers, v.observation.n_states))
    event = columns.trait(c.event, ant)
    dies = columns.trait(c.stage, ant) == Stage.DYING
    last = ti.cast(dies | (tick + 1 == c.length) | stops, ti.i32)
    terminated, truncated = step_end(event, c.delivery_terminates, c.ends_at_delivery, last)
    step = Transition(
        state=steps.state_index_of(c, v, ant),
        action=columns.trait(c.action, ant),
        reward=ti.cast(steps.reward_of(c, v, ant), ti.f32),
        next_state=seen,
        next_action=next_action,
        terminated=terminated,
        truncated=truncated,
    )
    _, c.streams[ant] = v.learner.learn(
        memory, memory_of(c, v, ant), step, rates_of(c, v, caste_of(c, v, ant)), c.streams[ant]
    )


@function
def error_of(c, v, w, pair, reward, terminated, seen, next_action):
    """Return the TD error of a pair by the table of its group; see `place_in_tables`."""
    table = steps.table_of(c, v, w * v.n_groups + group_of_pair(v, pair))
    value, rates = place_in_tables(c, v, w, pair), rates_of(c, v, caste_of_pair(v, pair))
    error = v.td_error(
        *(c.q[value], reward, discount_of(rates, terminated)),
        *(values_of(c.q, table, seen), next_action, rates.epsilon),
    )
    if not ti.abs(error) < c.largest_error:
        c.q[value] = ti.math.nan  # a fixed-point sum would hide such an error
    return error


@while_compiling
def group_of_pair(v, pair):
    """Return the group of a pair, whose number is its place in the tables of all groups in turn."""
    return pair // v.n_numbers if v.n_groups > 1 else 0


@function
def caste_of_pair(v, pair):
    """Return the caste of the ants that learn about a pair, 0 without castes."""
    return group_of_pair(v, pair) % ti.static(max(1, v.n_castes))


@function
def place_in_tables(c, v, w, pair):
    """Return the index in `q` of the value of a pair of a world."""
    group = group_of_pair(v, pair)
    return steps.table_of(c, v, w * v.n_groups + group) + pair - group * v.n_numbers


@function
def share_error(c, v, w, chunk, ant, seen, next_action):
    """Add the TD error and the transition of an ant to the sums of its chunk."""
    event = columns.trait(c.event, ant)
    reward = ti.cast(steps.reward_of(c, v, ant), ti.f32)
    terminated = terminates(event, c.delivery_terminates)
    pair = steps.state_index_of(c, v, ant) * ROW + columns.trait(c.action, ant)
    pair += columns.group_of(c, v, ant) * v.n_numbers
    error = error_of(c, v, w, pair, reward, terminated, seen, next_action)
    entry = v.add_to_sums(c, v, chunk, pair, error, fixed(error), 1)
    if ti.static(v.learner.plans):
        transition = model.pack_transition(seen, reward, terminated)
        v.note_transition(c, entry, c.number[ant], transition)


@ti.func
def fixed(error):
    """Return an error as a fixed-point number: f32 -> i64."""
    return ti.cast(ti.floor(ti.cast(error, ti.f64) * _ONE + 0.5), ti.i64)


@function
def touched_of(v, sums):
    """Return the start of what `touched` holds of the sums of a chunk or world."""
    size = ti.static(TOUCHED_LINE * -(-v.n_rows // TOUCHED_LINE) if v.in_chunks else v.n_pairs + 1)
    return size * sums


@function
def sums_of_chunk(c, v, chunk):
    """Return the number of a chunk's sums: those of worlds come first, if worlds have chunks."""
    return c.n_worlds + chunk if ti.static(v.in_chunks) else chunk


@function
def add_to_sums(c, v, chunk, pair, error, total, count):
    """Add `count` updates of a pair to a chunk's sums, the last of them with this error.

    Returns:
        The index of the pair's sums.
    """
    sums = sums_of_chunk(c, v, chunk)
    entry, touched = v.n_pairs * sums + pair, touched_of(v, sums)
    known, summed = c.sums_of[SumRow.COUNT, entry], c.sums[entry]
    if ti.static(v.in_chunks):
        c.touched[touched + pair // ROW] = 1
    else:
        # Without a branch: a new pair stays in the list, others leave their place to the next one.
        # There is room, because a table has pairs that do not exist, see `ROW`.
        n = c.touched[touched]
        c.touched[touched + 1 + n] = pair
        c.touched[touched] = n + ti.cast(known == 0, ti.i32)
    if ti.static(v.learner.plans):
        if known == 0:
            c.sums_of[SumRow.LATEST, entry] = -1
    c.sums_of[SumRow.COUNT, entry] = known + count
    c.sums[entry] = summed + total
    c.errors[entry] = error
    return entry


@function
def note_transition(c, entry, number, transition):
    """Store the transition of a pair for the model if its ant has the highest number so far."""
    if number > c.sums_of[SumRow.LATEST, entry]:
        c.sums_of[SumRow.LATEST, entry] = number
        c.sums_of[SumRow.TRANSITION, entry] = transition


@function
def add_atomically(c, v, chunk, pair, error, total, count):
    """Do the same as `add_to_sums` if many threads process a chunk: of any ant is the last error.

    It is only used for a single one.
    """
    sums = sums_of_chunk(c, v, chunk)
    entry = v.n_pairs * sums + pair
    c.touched[touched_of(v, sums) + pair // ROW] = 1
    c.sums_of[SumRow.COUNT, entry] += count
    c.sums[entry] += total
    c.errors[entry] = error
    return entry


@function
def note_atomically(c, entry, number, transition):
    """Do the same as `note_transition` if many threads process a chunk, in `latest`."""
    words = ti.cast(number, ti.i64) << 32 | ti.cast(ti.cast(transition, ti.u32), ti.i64)
    ti.atomic_max(c.latest[entry], words)


@function
def join_sums(c, v, w, first, last):
    """Join the sums of all chunks of a world in a range of states, and reset them."""
    if ti.static(v.in_chunks):
        for row in range(first, last):
            found, n_chunks = 0, chunks_of(c, v)
            for sums in range(c.n_worlds + w * n_chunks, c.n_worlds + (w + 1) * n_chunks):
                if c.touched[touched_of(v, sums) + row] == 1:
                    c.touched[touched_of(v, sums) + row] = 0
                    for pair in range(row * ROW, row * ROW + N_ACTIONS):
                        join_pair(c, v, v.n_pairs * sums + pair, v.n_pairs * w + pair, found)
                    found = 1
            c.touched[touched_of(v, w) + row] = found


@function
def join_pair(c, v, entry, joined, found):
    """Add the sums of a pair to the joined ones, if any were `found`, and reset them."""
    count, before, total = c.sums_of[SumRow.COUNT, entry], 0, c.sums[entry]
    if found == 1:
        before, total = c.sums_of[SumRow.COUNT, joined], total + c.sums[joined]
    c.sums_of[SumRow.COUNT, joined], c.sums[joined] = before + count, total
    if count > 0:
        c.errors[joined] = c.errors[entry]
        if ti.static(v.learner.plans):
            if before == 0:
                c.sums_of[SumRow.LATEST, joined] = -1
            transition = c.sums_of[SumRow.TRANSITION, entry]
            note_transition(c, joined, c.sums_of[SumRow.LATEST, entry], transition)
        c.sums_of[SumRow.COUNT, entry], c.sums[entry] = 0, 0


@function
def join_atomically(c, v, w, chunk, row):
    """Do the same as `join_sums` for a state of one chunk, while threads join those of others."""
    sums = sums_of_chunk(c, v, chunk)
    if c.touched[touched_of(v, sums) + row] == 1:
        c.touched[touched_of(v, sums) + row], c.touched[touched_of(v, w) + row] = 0, 1
        for pair in range(row * ROW, row * ROW + N_ACTIONS):
            entry, joined = v.n_pairs * sums + pair, v.n_pairs * w + pair
            count = c.sums_of[SumRow.COUNT, entry]
            if count > 0:
                c.sums_of[SumRow.COUNT, joined] += count
                c.sums[joined] += c.sums[entry]
                c.errors[joined] = c.errors[entry]
                c.sums_of[SumRow.COUNT, entry], c.sums[entry] = 0, 0
                if ti.static(v.learner.plans):
                    ti.atomic_max(c.latest[joined], c.latest[entry])
                    c.latest[entry] = 0


@while_compiling
def transition_of(c, v, entry):
    """Return the transition of the ant with the highest number that updates a pair."""
    if v.by_ant:
        return ti.cast(subscript(None, c.latest, entry), ti.i32)
    return subscript(None, c.sums_of, SumRow.TRANSITION, entry)


@function
def each_updated(c, v, w, first, last, update):
    """Call update(c, v, w, pair, entry) for the pairs with joined sums in a range of states."""
    if ti.static(v.in_chunks):
        for row in range(first, last):
            if c.touched[touched_of(v, w) + row] == 1:
                for pair in range(row * ROW, row * ROW + N_ACTIONS):
                    if c.sums_of[SumRow.COUNT, v.n_pairs * w + pair] > 0:
                        update(c, v, w, pair, v.n_pairs * w + pair)
    else:
        touched = touched_of(v, w)
        for i in range(touched + 1, touched + 1 + c.touched[touched]):
            update(c, v, w, c.touched[i], v.n_pairs * w + c.touched[i])


@function
def remember_shared(c, v, w, tick):
    """Store the joined transitions in the shared model, new pairs in ascending order."""
    if ti.static(not v.in_chunks):
        sort_touched(c, v, w)
    each_updated(c, v, w, 0, v.n_rows, remember_pair)


@function
def sort_touched(c, v, w):
    """Sort the list of a world, by insertion because lists are short."""
    listed = touched_of(v, w)
    for i in range(2, c.touched[listed] + 1):
        pair = c.touched[listed + i]
        j = i - 1
        while j >= 1 and c.touched[listed + ti.max(j, 1)] > pair:
            c.touched[listed + j + 1] = c.touched[listed + j]
            j -= 1
        c.touched[listed + j + 1] = pair


@function
def remember_pair(c, v, w, pair, entry):
    """Store the joined transition of a pair in the shared model."""
    memory = ti.static(LearnerArrays(c.q, c.floats, c.integers, v.observation.n_states))
    transition, group = transition_of(c, v, entry), group_of_pair(v, pair)
    at = memory_of(c, v, w * v.n_groups + group)
    model.remember(memory, at, pair - group * v.n_numbers, transition)


@function
def apply_sums(c, v, w, first, last):
    """Update the shared values of a world by the joined sums of a range of states."""
    each_updated(c, v, w, first, last, apply_pair)
    if ti.static(v.by_ant):
        for row in range(first, last):
            c.touched[touched_of(v, w) + row] = 0
    elif ti.static(not v.in_chunks):
        c.touched[touched_of(v, w)] = 0


@function
def apply_pair(c, v, w, pair, entry):
    """Update the shared value of a pair by its joined sums, and reset them."""
    count = c.sums_of[SumRow.COUNT, entry]
    error, value = c.errors[entry], place_in_tables(c, v, w, pair)
    rate = weight_of(c, v, pair, count)
    mean = ti.cast(c.sums[entry], ti.f64) / (ti.cast(count, ti.f64) * _ONE)
    error = ti.select(count > 1, ti.cast(mean, ti.f32), error)
    c.q[value] = c.q[value] + rate * error
    note_best_actions(c, value)
    c.sums_of[SumRow.COUNT, entry], c.sums[entry] = 0, 0
    if ti.static(v.by_ant and v.learner.plans):
        c.latest[entry] = 0


@function
def note_best_actions(c, entry):
    """Store the best actions of a state, of which one value is at a place in `q`."""
    row = entry & -ROW
    c.q[row + BEST_AT] = ti.cast(best_actions(values_of(c.q, row, 0)), ti.f32)


@function
def weight_of(c, v, pair, count):
    """Return the weight of the mean of some errors in an update of a pair; see `update_weights`."""
    weight = c.weights[ti.min(count, c.weights.shape[0] - 1)]  # the last is for more errors
    if ti.static(v.n_castes > 0):
        caste = caste_of_pair(v, pair)
        if c.castes[CasteRow.LEARNING_RATE, caste] >= 0.0:
            weight = c.caste_weights[caste, ti.min(count, c.caste_weights.shape[1] - 1)]
    return weight


@function
def draw_pair(c, v, w, chunk, ant, tick):
    """Draw a visited pair for a planning update of an ant."""
    acted = columns.trait(c.stage, ant) != Stage.NEWBORN
    if ti.static(v.at["rests"]):
        acted = acted & (columns.trait(c.event, ant) != Event.NONE)
    if acted & learns(c, v, ant):
        memory = ti.static(LearnerArrays(c.q, c.floats, c.integers, v.observation.n_states))
        at = memory_of(c, v, steps.owner_of(c, v, w, ant))
        drawn, c.streams[ant] = draw_below(c.streams[ant], model.visited(memory, at))
        pair, transition = model.recall(memory, at, drawn)
        pair += columns.group_of(c, v, ant) * v.n_numbers
        entry = v.add_to_sums(c, v, chunk, pair, 0.0, ti.cast(0, ti.i64), 1)
        v.note_transition(c, entry, 0, transition)


@function
def find_errors(c, v, w, first, last):
    """Set the joined sums of the pairs that ants drew by their errors by the present table."""
    each_updated(c, v, w, first, last, find_error)


@function
def find_error(c, v, w, pair, entry):
    """Compute the error of a pair that ants drew, and set its joined sums."""
    seen = transition_of(c, v, entry)
    reward, terminated = model.reward_of(seen), model.terminated_of(seen)
    error = error_of(c, v, w, pair, reward, terminated, model.next_state_of(seen), -1)
    c.errors[entry] = error
    c.sums[entry] = fixed(error) * c.sums_of[SumRow.COUNT, entry]
