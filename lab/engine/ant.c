/* Ants that learn, in plain C, one run after another, for comparison in throughput.py.
 *
 * The program has branches, as one would write it by hand; for the rules, see ant.h. Several
 * threads take one run after another.
 */
#include <stdlib.h>
#include <string.h>

#include "ant.h"

enum { N_PAIRS = N_STATES * N_ACTIONS };

typedef struct {
    int cell, heading, carries, delivered;
    uint64_t random;
    uint8_t *ground;
    int32_t *trail;
} Ant;

/* The last transition of a pair of state and action. */
typedef struct {
    int32_t pair, next; /* indices in the table */
    float reward, discount;
} Transition;

/* The transitions of all visited pairs, in the order of first visits. */
typedef struct {
    int n;
    int16_t place[N_PAIRS]; /* the place of a pair in this order, from 1 */
    Transition transitions[N_PAIRS];
} Model;

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
        nearer |= nearer << N_HEADINGS | nearer << 2 * N_HEADINGS; /* headings are cyclic */
        nearer >>= ant->heading + N_HEADINGS - 1;
        for (int k = 0; k < 3; k++) {
            int ground = ant->ground[in_view(world, ant, k)];
            int lure = (ground == 0) & (nearer >> k);
            state = state << 2 | (lure ? SEES_CUE : ground >> 2);
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
        state = state << 2 | (2 * levels[k] >= strongest ? SEES_CUE : grounds[k] & 3);
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
        return code == SEES_CUE;
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

static float larger(float a, float b) { return a > b ? a : b; }
static float best_of(const float *v)
{
    return larger(larger(larger(v[0], v[1]), larger(v[2], v[3])), v[4]);
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

static void update(float *q, Transition seen, float next_value, float learning_rate)
{
    float error = seen.reward + seen.discount * next_value - q[seen.pair];
    q[seen.pair] += learning_rate * error;
}

static void plan(float *q, Model *model, Transition seen, int steps, float learning_rate,
                 uint64_t *random)
{
    if (model->place[seen.pair] == 0)
        model->place[seen.pair] = (int16_t)++model->n;
    model->transitions[model->place[seen.pair] - 1] = seen;
    for (int k = 0; k < steps; k++) {
        Transition drawn = model->transitions[below(draw(random) >> 32, model->n)];
        update(q, drawn, best_of(q + drawn.next), learning_rate);
    }
}

/* Do one run of a learner that is known at compile time; return 0 if out of memory. */
static inline __attribute__((always_inline)) int train_run(const World *world, const Job *job,
                                                           int number, Run run, int learner)
{
    float *q = job->q + (size_t)number * N_PAIRS;
    Ant ant = {.random = run.random};
    Model *model = learner == DYNA_Q ? calloc(1, sizeof(Model)) : NULL;
    ant.ground = malloc((size_t)world->size);
    ant.trail = malloc((size_t)world->size * sizeof(int32_t));
    int enough = ant.ground != NULL && ant.trail != NULL && (learner != DYNA_Q || model != NULL);
    for (int episode = 0; episode < job->episodes && enough; episode++) {
        memcpy(ant.ground, world->ground, (size_t)world->size);
        memcpy(ant.trail, world->trail, (size_t)world->size * sizeof(int32_t));
        ant.cell = run.cell;
        ant.heading = run.heading;
        ant.carries = ant.delivered = 0;
        uint64_t explore_below = (uint64_t)(run.epsilon * 4294967296.0);
        int state = observe(world, &ant), step = 0, sum = 0, next_action = 0;
        if (learner == SARSA)
            next_action = choose(q + state * N_ACTIONS, draw(&ant.random), explore_below);
        for (; step < job->max_steps && !ant.delivered; step++) {
            int action = next_action;
            if (learner != SARSA)
                action = choose(q + state * N_ACTIONS, draw(&ant.random), explore_below);
            int reward = act(world, &ant, state, action);
            int next = observe(world, &ant), terminated = ant.delivered && !job->delivery_truncates;
            const float *values = q + next * N_ACTIONS;
            if (learner == SARSA && !terminated)
                next_action = choose(values, draw(&ant.random), explore_below);
            Transition seen = {state * N_ACTIONS + action, next * N_ACTIONS, (float)reward,
                            terminated ? 0.0f : run.discount};
            float next_value = learner == SARSA ? values[next_action] : best_of(values);
            update(q, seen, next_value, run.learning_rate);
            if (learner == DYNA_Q)
                plan(q, model, seen, job->planning_steps, run.learning_rate, &ant.random);
            sum += reward;
            state = next;
        }
        job->returns[(size_t)number * job->episodes + episode] = sum;
        job->steps[(size_t)number * job->episodes + episode] = step;
        if (job->deliveries)
            job->deliveries[(size_t)number * job->episodes + episode] = ant.delivered;
        double epsilon = run.epsilon * run.decay;
        run.epsilon = epsilon > run.min_epsilon ? epsilon : run.min_epsilon;
    }
    free(model);
    free(ant.ground);
    free(ant.trail);
    return enough;
}

/* Train all runs; return 0 if out of memory. */
int train(const World *world, const Job *job, const Run *runs)
{
    int enough = 1;
#pragma omp parallel for schedule(dynamic) num_threads(job->threads) reduction(&& : enough)
    for (int i = 0; i < job->n; i++) {
        if (job->learner == Q_LEARNING)
            enough = train_run(world, job, i, runs[i], Q_LEARNING) && enough;
        else if (job->learner == SARSA)
            enough = train_run(world, job, i, runs[i], SARSA) && enough;
        else
            enough = train_run(world, job, i, runs[i], DYNA_Q) && enough;
    }
    return enough;
}
