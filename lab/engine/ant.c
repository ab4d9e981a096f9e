/* Ants that learn, in C without vector instructions, for comparison in throughput.py.
 *
 * For the rules, see ant.h. The program takes TOGETHER runs at once, 4 or 1: all of them act, and
 * then all of them learn. A step is a chain of operations, each of which needs the result of the one
 * before. With four chains, the processor has something to do while one of them waits. There are
 * hardly any branches, since nothing could predict which actions four ants take: a table has the
 * effect of each action in each state, and masks select between values. Each state stores its
 * largest action value and the actions that have it, except with Dyna-Q, which updates many more
 * values than ants read.
 */
#include <stdlib.h>
#include <string.h>

#include "ant.h"
#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#endif

enum { N_PAIRS = N_STATES * N_ACTIONS, ROW = 8 };
/* A cell has its level + 1 above four bits if it is empty, else its ground in these bits. */
enum { LEVEL_AT = 4, NO_LEVEL = 1 << LEVEL_AT };
/* Bits in the effect of an action; above them is the reward + 1 of one that exchanges no food. */
enum { ENTERS = 1, EXCHANGES = 2, REWARD_AT = 2 };

#ifndef NOTE
#define NOTE(ant, terminated, value) /* ant_page.c writes steps down */
#endif
#define LEVEL(level) (((level) + 1) * NO_LEVEL)

/* A set of actions is a list: from the lowest bit, three bits for its length and for each action. */
enum { ALL_ACTIONS = N_ACTIONS | FORWARD << 6 | RIGHT << 9 | PICK_UP << 12 | GIVE << 15 };

/* A state's action values, the largest of them, and the list of actions that have it. */
typedef struct {
    float values[N_ACTIONS], best;
    uint32_t choices, unused;
} Row;

/* The last transition of a pair of state and action. */
typedef struct {
    int16_t value, next; /* the place of the pair in the table, and the next state */
    int16_t reward, terminated;
} Transition;

/* The transitions of all visited pairs, in the order of first visits. */
typedef struct {
    int n;
    int16_t place[N_PAIRS]; /* the place of a pair in this order, from 1 */
    Transition transitions[N_PAIRS];
} Model;

/* An ant in one of the runs, and the step that it takes. */
typedef struct {
    uint64_t random, explore_below;
    float learning_rate, discount;
    int32_t cell, heading, carries, state, step, sum;
    int32_t action, taken, reward, delivered, next; /* `action`: that of the next step, for SARSA */
    int32_t *cells;
    int32_t number, episode;
    Run run;
    Row rows[N_STATES];
    Model model;
} Ant;

/* What all runs share. */
typedef struct {
    const World *world;
    const Job *job;
    const Run *runs;
    int32_t *cells;                       /* (size) at the start of an episode */
    uint8_t *lures;                       /* (size, 8) by heading: bits of a state, see `observe` */
    uint8_t effects[N_STATES * ROW];      /* by state and action */
    uint32_t choices[1 << N_ACTIONS];     /* the list of each set of actions, by its bits */
    int32_t taken;                        /* runs that have begun */
} Shared;

static void tabulate(Shared *shared)
{
    const World *world = shared->world;
    for (int c = 0; c < world->size; c++) {
        shared->cells[c] = world->ground[c] ? world->ground[c] : LEVEL(world->trail[c]);
        for (int h = 0; h < N_HEADINGS; h++) {
            int nearer = world->closer[c]; /* repeated, because headings are cyclic */
            nearer |= nearer << N_HEADINGS | nearer << 2 * N_HEADINGS;
            nearer >>= h + N_HEADINGS - 1;
            int lures = (nearer & 1) << 5 | (nearer & 2) << 2 | (nearer & 4) >> 1;
            shared->lures[8 * c + h] = (uint8_t)lures;
        }
    }
    for (int state = 0; state < N_STATES; state++)
        for (int action = 0; action < N_ACTIONS; action++) {
            int code = state << 2 * action >> 4 & 3, sees_goal = (state & state >> 1 & 21) != 0;
            int enters = action <= RIGHT && !(code & 1), reward = enters ? code == SEES_CUE : -1;
            int exchanges = sees_goal && action == PICK_UP + (state >> 6);
            int effect = enters * ENTERS | exchanges * EXCHANGES | (reward + 1) << REWARD_AT;
            shared->effects[ROW * state + action] = (uint8_t)effect;
        }
    for (uint32_t set = 0; set < 1 << N_ACTIONS; set++) {
        uint32_t list = 0, n = 0;
        for (uint32_t action = 0; action < N_ACTIONS; action++)
            if (set >> action & 1)
                list |= action << 3 * ++n;
        shared->choices[set] = list | n;
    }
}

INLINE int larger_of(int a, int b) { return a > b ? a : b; }

INLINE int observe(const Shared *shared, const Ant *ant)
{
    const int32_t *at = ant->cells + ant->cell, *steps = shared->world->offsets + ant->heading;
    int left = at[steps[LEFT]], forward = at[steps[FORWARD]], right = at[steps[RIGHT]];
    /* A cue is a cell with at least half of the strongest level, or, with food, any empty cell. */
    int most = larger_of(larger_of(left, forward), larger_of(right, LEVEL(2))) + NO_LEVEL - 1;
    most = ant->carries ? 2 * NO_LEVEL - 1 : most;
    int cues = (2 * left > most) << 5 | (2 * forward > most) << 3 | (2 * right > most) << 1;
    /* With food, only if it is nearer to the queen. */
    int allowed = shared->lures[8 * ant->cell + ant->heading] | ((ant->carries - 1) & 42);
    int shift = 2 * ant->carries; /* to the code of a ground for carriers */
    int codes = (left >> shift & 3) << 4 | (forward >> shift & 3) << 2 | (right >> shift & 3);
    return ant->carries << 6 | codes | (cues & allowed);
}

static void pick_up(const Shared *shared, Ant *ant)
{
    int goals[3], n = 0;
    for (int k = 0; k < 3; k++)
        if ((ant->state >> (4 - 2 * k) & 3) == SEES_GOAL)
            goals[n++] = k;
    int position = goals[n > 1 ? below(draw(&ant->random) >> 32, n) : 0];
    ant->cells[ant->cell + shared->world->offsets[ant->heading + position]] = LEVEL(DEPOSIT);
    ant->cells[ant->cell] = LEVEL(DEPOSIT);
    ant->heading = (ant->heading + 3) % N_HEADINGS;
}

INLINE void act(const Shared *shared, Ant *ant)
{
    int action = ant->taken, effect = shared->effects[ROW * ant->state + action];
    if (effect & EXCHANGES) { /* rare */
        ant->delivered = ant->carries;
        ant->reward = ant->carries ? 10 : 3;
        if (!ant->carries)
            pick_up(shared, ant);
        ant->carries ^= 1;
        return;
    }
    int enters = effect & ENTERS;
    int cell = ant->cell + (shared->world->offsets[ant->heading + action] & -enters);
    ant->heading = turned(ant->heading, action);
    ant->cell = cell;
    ant->delivered = 0;
    ant->reward = (effect >> REWARD_AT) - 1;
    if (enters & ant->carries)
        ant->cells[cell] = LEVEL(DEPOSIT);
}

#ifdef __wasm_simd128__ /* where a selection between floats is slow */
INLINE float best_of(const float *v)
{
    v128_t best = wasm_f32x4_pmax(wasm_v128_load(v), wasm_v128_load(v + 1));
    best = wasm_f32x4_pmax(best, wasm_i32x4_shuffle(best, best, 2, 3, 0, 1));
    best = wasm_f32x4_pmax(best, wasm_i32x4_shuffle(best, best, 1, 0, 3, 2));
    return wasm_f32x4_extract_lane(best, 0);
}
INLINE unsigned set_of(const float *v, float best)
{
    unsigned first = wasm_i32x4_bitmask(wasm_f32x4_eq(wasm_v128_load(v), wasm_f32x4_splat(best)));
    return first | (unsigned)(v[GIVE] == best) << GIVE;
}
#else
INLINE float larger(float a, float b) { return a > b ? a : b; }
INLINE float best_of(const float *v)
{
    return larger(larger(larger(v[0], v[1]), larger(v[2], v[3])), v[4]);
}
INLINE unsigned set_of(const float *v, float best)
{
    unsigned set = 0;
    for (int action = 0; action < N_ACTIONS; action++)
        set |= (unsigned)(v[action] >= best) << action;
    return set;
}
#endif

INLINE void note_best(const Shared *shared, Row *row)
{
    row->best = best_of(row->values);
    row->choices = shared->choices[set_of(row->values, row->best)];
}

INLINE int choose(const Row *row, Ant *ant)
{
    uint64_t bits = draw(&ant->random);
    if (TOGETHER == 1 && bits >> 32 >= ant->explore_below) /* one ant's moves are predicted */
        for (int move = LEFT; move <= RIGHT; move++)
            if (row->choices == (1 | (uint32_t)move << 3))
                return move;
    /* All bits are set if the ant explores: a difference that is negative, shifted. */
    uint32_t explores = (uint32_t)((int64_t)((bits >> 32) - ant->explore_below) >> 63);
    uint32_t choices = row->choices ^ ((row->choices ^ ALL_ACTIONS) & explores);
    int k = below(bits & 0xFFFFFFFFu, choices & 7);
    return choices >> (3 * k + 3) & 7;
}

INLINE void update(Ant *ant, float *value, int reward, int terminated, float next_value)
{
    float discount = terminated ? 0.0f : ant->discount;
    float error = (float)reward + discount * next_value - *value;
    *value += ant->learning_rate * error;
}

INLINE void plan(Ant *ant, int action, int terminated, int steps)
{
    Model *model = &ant->model;
    int pair = N_ACTIONS * ant->state + action;
    if (model->place[pair] == 0)
        model->place[pair] = (int16_t)++model->n;
    Transition seen = {(int16_t)(ROW * ant->state + action), (int16_t)ant->next,
                       (int16_t)ant->reward, (int16_t)terminated};
    model->transitions[model->place[pair] - 1] = seen;
    for (int k = 0; k < steps; k++) {
        seen = model->transitions[below(draw(&ant->random) >> 32, model->n)];
        float next_value = best_of(ant->rows[seen.next].values);
        update(ant, (float *)ant->rows + seen.value, seen.reward, seen.terminated, next_value);
    }
}

/* The first half of a step: choose, act and observe. */
INLINE void move(const Shared *shared, Ant *ant, int learner)
{
    Row *row = &ant->rows[ant->state];
    if (learner == DYNA_Q)
        note_best(shared, row);
    ant->taken = learner == SARSA ? ant->action : choose(row, ant);
    act(shared, ant);
    ant->next = observe(shared, ant);
}

/* The second half: learn; return whether the episode ends. */
INLINE int learn(const Shared *shared, Ant *ant, int learner)
{
    const Job *job = shared->job;
    Row *row = &ant->rows[ant->state], *next = &ant->rows[ant->next];
    int terminated = ant->delivered & !job->delivery_truncates;
    float next_value = learner == DYNA_Q ? best_of(next->values) : next->best;
    if (learner == SARSA) {
        if (!terminated)
            ant->action = choose(next, ant);
        next_value = next->values[ant->action];
    }
    update(ant, &row->values[ant->taken], ant->reward, terminated, next_value);
    NOTE(ant, terminated, row->values[ant->taken]);
    if (learner == DYNA_Q)
        plan(ant, ant->taken, terminated, job->planning_steps);
    else
        note_best(shared, row);
    ant->sum += ant->reward;
    ant->state = ant->next;
    ant->step++;
    return ant->delivered | (ant->step >= job->max_steps);
}

INLINE void begin_episode(const Shared *shared, Ant *ant, int learner)
{
    memcpy(ant->cells, shared->cells, (size_t)shared->world->size * sizeof(int32_t));
    ant->cell = ant->run.cell;
    ant->heading = ant->run.heading;
    ant->carries = ant->step = ant->sum = 0;
    ant->explore_below = (uint64_t)(ant->run.epsilon * 4294967296.0);
    ant->state = observe(shared, ant);
    if (learner == SARSA)
        ant->action = choose(&ant->rows[ant->state], ant);
}

/* Begin the next run; return 0 if there is none. */
static inline int begin_run(Shared *shared, Ant *ant, int learner)
{
    int number;
#pragma omp atomic capture
    number = shared->taken++;
    if (number >= shared->job->n)
        return 0;
    ant->number = number;
    ant->episode = 0;
    ant->run = shared->runs[number];
    ant->random = ant->run.random;
    ant->learning_rate = ant->run.learning_rate;
    ant->discount = ant->run.discount;
    ant->model.n = 0;
    memset(ant->model.place, 0, sizeof ant->model.place);
    const float *q = shared->job->q + (size_t)number * N_PAIRS;
    for (int state = 0; state < N_STATES; state++) {
        memcpy(ant->rows[state].values, q + N_ACTIONS * state, sizeof ant->rows[state].values);
        note_best(shared, &ant->rows[state]);
    }
    begin_episode(shared, ant, learner);
    return 1;
}

/* Write the results of an episode, and begin another one; return 0 if no run is left. */
static inline int end_episode(Shared *shared, Ant *ant, int learner)
{
    const Job *job = shared->job;
    size_t at = (size_t)ant->number * (size_t)job->episodes + (size_t)ant->episode++;
    job->returns[at] = ant->sum;
    job->steps[at] = ant->step;
    if (job->deliveries)
        job->deliveries[at] = ant->delivered;
    double epsilon = ant->run.epsilon * ant->run.decay;
    ant->run.epsilon = epsilon > ant->run.min_epsilon ? epsilon : ant->run.min_epsilon;
    if (ant->episode < job->episodes) {
        begin_episode(shared, ant, learner);
        return 1;
    }
    float *q = job->q + (size_t)ant->number * N_PAIRS;
    for (int state = 0; state < N_STATES; state++)
        memcpy(q + N_ACTIONS * state, ant->rows[state].values, sizeof ant->rows[state].values);
    return begin_run(shared, ant, learner);
}

/* Do runs until none is left, with a learner that is known at compile time. */
INLINE void train_ants(Shared *shared, Ant *ants, int learner)
{
    Ant *active[TOGETHER];
    int n = 0;
    for (int k = 0; k < TOGETHER; k++)
        if (begin_run(shared, &ants[k], learner))
            active[n++] = &ants[k];
    while (n > 0) {
        for (int k = 0; k < n; k++)
            move(shared, active[k], learner);
        for (int k = 0; k < n; k++)
            if (learn(shared, active[k], learner) && !end_episode(shared, active[k], learner))
                active[k--] = active[--n];
    }
}

/* Train all runs; return 0 if out of memory. Levels of trails are below 2 ** 26. */
int train(const World *world, const Job *job, const Run *runs)
{
    Shared shared = {.world = world, .job = job, .runs = runs};
    size_t size = (size_t)world->size;
    shared.cells = malloc(size * sizeof(int32_t));
    shared.lures = calloc(size, 8);
    int enough = shared.cells != NULL && shared.lures != NULL;
    if (enough)
        tabulate(&shared);
#pragma omp parallel num_threads(job->threads) reduction(&& : enough)
    {
        Ant *ants = malloc(TOGETHER * sizeof(Ant));
        int32_t *cells = malloc(TOGETHER * size * sizeof(int32_t));
        enough = shared.cells != NULL && shared.lures != NULL && ants != NULL && cells != NULL;
        for (int k = 0; k < TOGETHER && enough; k++)
            ants[k].cells = cells + (size_t)k * size;
        if (enough && job->learner == Q_LEARNING)
            train_ants(&shared, ants, Q_LEARNING);
        else if (enough && job->learner == SARSA)
            train_ants(&shared, ants, SARSA);
        else if (enough)
            train_ants(&shared, ants, DYNA_Q);
        free(ants);
        free(cells);
    }
    free(shared.cells);
    free(shared.lures);
    return enough;
}
