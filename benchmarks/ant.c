/* Q-learning ants in plain C, one after the other: the yardstick of throughput.py.
 *
 * The same world, rules, random numbers and arithmetic as the package's (docs of the rules: the
 * modules of taichi_ants/rules), written as one would by hand. It gives the same returns, to the
 * bit, if the compiler does not fuse multiplications and additions (-ffp-contract=off).
 */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { SEES_EMPTY, SEES_OBSTACLE, SEES_LURE, SEES_GOAL };
enum { LEFT, FORWARD, RIGHT, PICK_UP, GIVE, N_ACTIONS };
enum { N_STATES = 128, N_HEADINGS = 6, DEPOSIT = 250 };

/* Cells lie in flat arrays; a neighbour is a fixed step away. */
typedef struct {
    int32_t size;
    const uint8_t *ground;  /* how a cell looks: two bits without food, two bits with food */
    const int32_t *trail;   /* levels at the start of an episode */
    const uint8_t *closer;  /* bit h: the neighbour at heading h is nearer to the queen */
    const int32_t *offsets; /* steps to the neighbours at headings 5, 0, 1, 2, 3, 4, 5, 0 */
    int32_t cell, heading;  /* where the ant starts */
} World;

typedef struct {
    int cell, heading, carries, delivered;
    uint64_t random;
    uint8_t *ground;
    int32_t *trail;
} Ant;

static uint64_t draw(uint64_t *state)
{
    uint64_t z = *state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static int below(uint64_t word, int n)
{
    return (int)((word * (uint64_t)n) >> 32);
}

/* The cell in view at position 0 (left), 1 (forward) or 2 (right). */
static int in_view(const World *world, const Ant *ant, int position)
{
    return ant->cell + world->offsets[ant->heading + position];
}

static int observe(const World *world, const Ant *ant)
{
    int state = ant->carries;
    if (ant->carries) {
        int nearer = world->closer[ant->cell];
        nearer |= nearer << N_HEADINGS | nearer << 2 * N_HEADINGS; /* headings turn round */
        nearer >>= ant->heading + N_HEADINGS - 1;
        for (int k = 0; k < 3; k++) {
            int ground = ant->ground[in_view(world, ant, k)];
            int lure = (ground == 0) & (nearer >> k);
            state = state << 2 | (lure ? SEES_LURE : ground >> 2);
        }
        return state;
    }
    int grounds[3], levels[3], strongest = 2;
    for (int k = 0; k < 3; k++) {
        int cell = in_view(world, ant, k);
        grounds[k] = ant->ground[cell];
        levels[k] = ant->trail[cell] & -(grounds[k] == 0); /* no branch */
        strongest = levels[k] > strongest ? levels[k] : strongest;
    }
    for (int k = 0; k < 3; k++)
        state = state << 2 | (2 * levels[k] >= strongest ? SEES_LURE : grounds[k] & 3);
    return state;
}

static int act(const World *world, Ant *ant, int state, int action)
{
    if (action <= RIGHT) {
        int code = state >> (4 - 2 * action) & 3;
        int target = in_view(world, ant, action);
        if (action != FORWARD)
            ant->heading = (ant->heading + action + N_HEADINGS - 1) % N_HEADINGS;
        if (code & 1)
            return -1;
        ant->cell = target;
        if (ant->carries)
            ant->trail[target] = DEPOSIT;
        return code == SEES_LURE;
    }
    int goals[3], n = 0;
    for (int k = 0; k < 3; k++)
        if ((state >> (4 - 2 * k) & 3) == SEES_GOAL)
            goals[n++] = k;
    if (n == 0 || (action == GIVE) != ant->carries)
        return -1;
    if (action == GIVE) {
        ant->carries = 0;
        ant->delivered = 1;
        return 10;
    }
    int food = in_view(world, ant, goals[n > 1 ? below(draw(&ant->random) >> 32, n) : 0]);
    ant->ground[food] = 0;
    ant->trail[food] = ant->trail[ant->cell] = DEPOSIT;
    ant->heading = (ant->heading + 3) % N_HEADINGS;
    ant->carries = 1;
    return 3;
}

static float best_of(const float *values)
{
    float best = values[0];
    for (int a = 1; a < N_ACTIONS; a++)
        best = values[a] > best ? values[a] : best;
    return best;
}

static int choose(const float *values, uint64_t bits, uint64_t explore_below)
{
    if (bits >> 32 < explore_below)
        return below(bits & 0xFFFFFFFFu, N_ACTIONS);
    float best = best_of(values);
    int mask = 0, skipped = 0;
    for (int a = 0; a < N_ACTIONS; a++)
        mask |= (values[a] == best) << a;
    if (mask & (mask - 1))
        skipped = below(bits & 0xFFFFFFFFu, __builtin_popcount((unsigned)mask));
    for (; skipped > 0; skipped--)
        mask &= mask - 1;
    return __builtin_ctz((unsigned)mask);
}

/* Train one run; returns and steps of each episode. Returns the number of steps, -1 if out of
 * memory. q holds 128 * 5 action values and must be 0. */
int64_t train(World world, uint64_t random, float learning_rate, float discount, double epsilon,
              double decay, double min_epsilon, int continuing, int episodes, int max_steps,
              float *q, int32_t *returns, int32_t *steps)
{
    int64_t total = 0;
    Ant ant = {.random = random};
    ant.ground = malloc((size_t)world.size);
    ant.trail = malloc((size_t)world.size * sizeof(int32_t));
    if (ant.ground == NULL || ant.trail == NULL)
        total = -1;
    for (int episode = 0; episode < episodes && total >= 0; episode++) {
        memcpy(ant.ground, world.ground, (size_t)world.size);
        memcpy(ant.trail, world.trail, (size_t)world.size * sizeof(int32_t));
        ant.cell = world.cell;
        ant.heading = world.heading;
        ant.carries = ant.delivered = 0;
        uint64_t explore_below = (uint64_t)(epsilon * 4294967296.0);
        int state = observe(&world, &ant), step = 0, sum = 0;
        for (; step < max_steps && !ant.delivered; step++) {
            int action = choose(q + state * N_ACTIONS, draw(&ant.random), explore_below);
            int reward = act(&world, &ant, state, action);
            int seen = observe(&world, &ant);
            float *value = q + state * N_ACTIONS + action;
            float weight = ant.delivered && !continuing ? 0.0f : discount;
            float error = (float)reward + weight * best_of(q + seen * N_ACTIONS) - *value;
            *value += learning_rate * error;
            sum += reward;
            state = seen;
        }
        returns[episode] = sum;
        steps[episode] = step;
        total += step;
        epsilon = epsilon * decay > min_epsilon ? epsilon * decay : min_epsilon;
    }
    free(ant.ground);
    free(ant.trail);
    return total;
}
