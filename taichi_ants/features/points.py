"""The points of a tick at which hooks of features run, in the order of a tick.

A point has the names of the arguments of its hooks. An argument `a` is an ant, `nest` a nest and
`cell` a cell: hooks read and write their values by name, for example `a.idle`. The name of an array
or of a number means that of the ant's nest or caste if there is one for each nest or caste. An
array of a feature that the model does not use reads as its start. All hooks of a point run in the
order of `FEATURES`.
"""

POINTS = {
    # An ant begins: at the start, by a birth, or by an intervention.
    "born": "a",
    # An ant is about to choose an action. The hook returns 1 if the ant rests in this tick, else 0,
    # and the random stream. It rests if one of the hooks returns 1, and then drops an action that
    # it has drawn before.
    "choose": "a stream",
    # An ant that does not rest is about to execute the action of the hook before, at first the
    # chosen one. The hook returns an action and the random stream.
    "execute": "a action stream",
    # The hook returns 1 if the ant rests, else 0, in the tick after `choose`. One hook is enough:
    # the ant then has no event and no reward, lays nothing and does not learn.
    "rests": "a",
    # An ant has taken one load of food from a cell. The hook returns how many are left, by the hook
    # before, at first 0; without a load, the cell is empty.
    "took": "a cell left",
    # An ant needs the reward for the event of its last action. The hook returns that of the hook
    # before, at first by `task.rewards`, or another one.
    "pays": "a event reward",
    # A nest has received n food items in this tick.
    "delivered": "nest n",
    # An ant has delivered its food in this tick.
    "gave": "a",
    # Ants have acted, and newborn ants have their places. The hook returns whether the ant dies;
    # one of the hooks is enough. A dying ant still learns in this tick.
    "aged": "a",
    # An ant that dies has left one load of food in its cell.
    "dropped": "a cell",
    # Food of a kind can grow back in a cell. The hook returns after how many ticks, by the hook
    # before, at first `task.life.regrowth`; never, if negative.
    "waits": "cell kind ticks",
    # Food of a kind has grown back in a cell. The hook returns the number of loads, by the hook
    # before, at first 1.
    "filled": "cell kind n",
    # All ants have acted, and this one, which does not rest, is about to observe. The hook returns
    # whether the ant stops after it has learned; one of the hooks is enough.
    "acted": "a",
    # An ant that stops has learned from its last action.
    "stopped": "a",
    # An ant is about to observe a cell in view, which shows the code of the hook before, at first
    # the true one: 0 to 3, see `taichi_ants.task.constants`. The hook returns the code that the ant
    # sees, and the random stream.
    "see": "a code stream",
    # A tick ends.
    "tick_ended": "nest",
}
