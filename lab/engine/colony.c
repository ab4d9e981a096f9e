/* A colony of ants that share one table, in C, for the lab (page.c) and for the comparison in
 * benchmarks/colony_in_c.py.
 *
 * The rules, random numbers and arithmetic are those of the package (taichi_ants/engines/colony),
 * for a few of its tasks: the paper's, queueing(), and foraging() with any of its three parts.
 * Results are equal to the bit if the compiler does not fuse multiplications and additions
 * (-ffp-contract=off). With OpenMP, several threads share each tick.
 *
 * The ants are an array of small structs, in any order. A cell has one byte for its content and one
 * for what its ant wants, so that a conflict reads all neighbours of a cell in three loads. The
 * largest value of each state and the actions that have it are stored, and change only with the
 * values of the state. A tick makes three or four passes over the ants, and one over the pairs of
 * state and action that had errors.
 */
#include <stdlib.h>
#include <string.h>

#include "common.h"
#ifdef _OPENMP
#include <omp.h>
#else
static int omp_get_thread_num(void) { return 0; }
#endif
#ifdef __AVX2__
#include <immintrin.h>
#endif
#ifdef __wasm_simd128__
#include <wasm_simd128.h>
#endif

/* The rules of a task and its learner, as bits. They are constants of the functions below, so that
 * the compiler makes a loop for each usual set of rules. */
enum {
    DIRECTED = 1,  /* trails rise towards food, and ants see only the strongest */
    SWAPS = 2,     /* ants with food push others aside */
    SEES_ANTS = 4, /* ants see each other */
    QUEUES = 8,    /* ants of a queue move at once; an ant sees which one to follow */
    SARSA = 16,    /* ants learn by SARSA instead of Q-learning */
    FROZEN = 32,   /* ants do not learn */
    PAPERS = 0,
    FORAGING = DIRECTED | SWAPS | SEES_ANTS,
    QUEUEING = FORAGING | QUEUES
};

enum { EMPTY = 0, OBSTACLE = 5, FOOD = 7, QUEEN = 13 };
enum { ENTERED_EMPTY, FAILED, ENTERED_CUE, PICKED_UP, DELIVERED, PUSHED };
enum { ROW = 8 };
/* What the ant on a cell wants: nothing, to enter the cell at a heading, to take the food there. */
enum { ENTER = 1, STANDS = 7, TAKE = 9, MARK = 15 };
/* Flags in the same byte, which other ants read. */
enum { HAS_FOOD = 16, TAKES_FOOD = 32, WINS = 64 };
enum { ANT_SHIFT = 4 }; /* above the ground: 1 for an ant, 2 for a carrier */
enum { MOST_THREADS = 64 };

typedef struct {
    int32_t size, n;
    uint8_t *ground;       /* (size) the ground, and marks of ants, see ANT_SHIFT */
    int32_t *trail;        /* (size) the clock at which the trail has evaporated */
    const uint8_t *closer; /* (size) bit h: the neighbour at heading h is nearer to the queen */
    const int32_t *steps;  /* (8) to the neighbours at headings 5, 0, 1, 2, 3, 4, 5, 0 */
    float *q; /* (states, ROW) */
    int32_t states, evaporates;
    int32_t level, slope, fades_after;
    float discount;
    uint64_t explore_below;
    const float *weights;   /* (n + 1) */
    const int32_t *rewards; /* (6) in the order of the fields of Rewards, as events are here; 0 */
    int64_t counts[4];      /* the results: returns, deliveries, moves, blocked */
    int32_t regrowth;       /* ticks until food is back; only read if there are `sources` */
    int32_t sources;        /* number of food sources */
    int32_t *source_at;     /* (sources) their cells */
    int32_t *taken;         /* (size) the tick in which food of a source was taken, or -1 */
} Colony;

typedef struct {
    uint64_t random;
    int32_t cell, carried;
    uint16_t state;
    uint8_t heading, carries, percept, action;
    uint8_t want; /* under SARSA between two ticks: 1 plus the next action, or 0 */
    uint8_t event;
} Ant;

/* The largest value of a state, and a bit for each action that has it. */
typedef struct {
    float best;
    uint32_t actions;
} Greedy;

/* The TD errors of a pair of state and action in a tick. */
typedef struct {
    int64_t sum; /* with 32 binary places */
    int32_t updates;
    float latest;
} Errors;

typedef struct {
    Ant *ants;      /* (n) */
    uint8_t *wants; /* (size), with room for a row of cells before and after it */
    Greedy *greedy; /* (states) */
    Errors *errors[MOST_THREADS]; /* of each thread, (states * ROW) */
    int32_t *pairs[MOST_THREADS]; /* the pairs with errors: their number, then the pairs */
} Work;

INLINE int bit_number(unsigned mask, int k)
{
#ifdef __AVX2__
    return __builtin_ctz(_pdep_u32(1u << k, mask));
#else
    while (k--)
        mask &= mask - 1;
    return __builtin_ctz(mask);
#endif
}

INLINE int round_turned(int heading) { return heading < 3 ? heading + 3 : heading - 3; }

/* 0 for actions that do not move. */
INLINE int code_in_view(int percept, int action) { return percept << 2 * action >> 4 & 3; }

INLINE int goals_in_view(int percept)
{
    int both = percept & percept >> 1;
    return (both >> 4 & 1) | (both >> 1 & 2) | (both & 1) << 2;
}

/* Unused places of a row hold minus infinity. */
INLINE Greedy greedy_of(const float *row)
{
#ifdef __wasm_simd128__
    v128_t low = wasm_v128_load(row), high = wasm_v128_load(row + 4);
    v128_t best = wasm_f32x4_pmax(low, high); /* of two numbers, `a < b ? b : a` */
    best = wasm_f32x4_pmax(best, wasm_i32x4_shuffle(best, best, 2, 3, 0, 1));
    best = wasm_f32x4_pmax(best, wasm_i32x4_shuffle(best, best, 1, 0, 3, 2));
    unsigned equal = wasm_i32x4_bitmask(wasm_f32x4_eq(low, best));
    equal |= wasm_i32x4_bitmask(wasm_f32x4_eq(high, best)) << 4;
    return (Greedy){wasm_f32x4_extract_lane(best, 0), equal};
#else
    Greedy greedy = {row[0], 0};
    for (int a = 1; a < N_ACTIONS; a++)
        greedy.best = row[a] > greedy.best ? row[a] : greedy.best;
    for (int a = 0; a < N_ACTIONS; a++)
        greedy.actions |= (uint32_t)(row[a] == greedy.best) << a;
    return greedy;
#endif
}

/* Without a branch, because the processor cannot predict what the next ant does. */
INLINE int choose(unsigned greedy, uint64_t bits, uint64_t explore_below)
{
    unsigned mask = bits >> 32 < explore_below ? (1 << N_ACTIONS) - 1 : greedy;
    return bit_number(mask, below(bits & 0xFFFFFFFFu, __builtin_popcount(mask)));
}

INLINE int level_of(const Colony *c, int cell, int clock)
{
    int level = c->trail[cell] - clock;
    return level > 0 ? level : 0;
}

/* The percept of an ant, and the row of its table, which is the percept if it does not see ants. */
INLINE int see(const Colony *c, int rules, int cell, int heading, int carries, int clock, int *row)
{
    int codes[3], levels[3] = {0}, ants[3], nearer, strongest;
    nearer = c->closer[cell];
    nearer = (nearer | nearer << 6 | nearer << 12) >> (heading + 5);
    strongest = rules & DIRECTED ? 1 : 2;
    for (int k = 0; k < 3; k++) {
        int place = cell + c->steps[heading + k];
        codes[k] = c->ground[place] & 15;
        ants[k] = c->ground[place] >> ANT_SHIFT;
        if ((rules & SEES_ANTS) || !carries) {
            levels[k] = level_of(c, place, clock);
            int counts = codes[k] == EMPTY || ((rules & QUEUES) && ants[k] == 2);
            int visible = counts ? levels[k] : 0;
            strongest = visible > strongest ? visible : strongest;
        }
    }
    for (int k = 0; k < 3; k++) {
        if (carries) {
            codes[k] = codes[k] == EMPTY && nearer >> k & 1 ? SEES_CUE : codes[k] >> 2;
        } else {
            int visible = codes[k] == EMPTY ? levels[k] : 0;
            int shows = rules & DIRECTED ? visible >= strongest : 2 * visible >= strongest;
            codes[k] = shows ? SEES_CUE : codes[k] & 3;
        }
    }
    int percept = *row = carries << 6 | codes[0] << 4 | codes[1] << 2 | codes[2];
    if (rules & SEES_ANTS) {
        int index = carries, own = level_of(c, cell, clock);
        for (int k = 0; k < 3; k++) {
            int better = carries ? nearer >> k & 1 : levels[k] > own;
            int code = ants[k] == 2 - carries ? (better ? 4 : 5) : codes[k];
            if ((rules & QUEUES) && ants[k] == 1 + carries && better)
                code = 6;
            index = (rules & QUEUES ? 7 : 6) * index + code;
        }
        *row = index;
    }
    return percept;
}

/* The new value of a cell in `trail`. */
INLINE int after_deposit(const Colony *c, int rules, int cell, int clock, int carried)
{
    int laid = c->level;
    if (rules & DIRECTED) {
        laid -= c->slope * (carried < c->fades_after ? carried : c->fades_after);
        int before = level_of(c, cell, clock);
        laid = before > laid ? before : laid;
    }
    return clock + laid;
}

/* Whether ants can enter cells with ants. */
INLINE int shares_cells(int rules) { return (rules & (SWAPS | QUEUES)) != 0; }

INLINE void choose_and_want(const Colony *c, const Work *w, int rules, Ant *ant)
{
    int percept = ant->percept, action = rules & SARSA ? ant->want - 1 : -1;
    uint64_t random = ant->random;
    if (action < 0) {
        random = advance(random);
        unsigned greedy = w->greedy[ant->state].actions;
        action = choose(greedy, bits_of(random), c->explore_below);
    }
    int cell = ant->cell, heading = turned(ant->heading, action);
    int enters = !(code_in_view(percept, action) & 1), shared = shares_cells(rules);
    if (shared)
        enters |= c->ground[cell + c->steps[heading + 1]] >> ANT_SHIFT != 0;
    int want = (enters & (action <= RIGHT)) ? ENTER + heading : shared ? STANDS : 0;
    int foods = goals_in_view(percept);
    if ((foods != 0) & (action == PICK_UP) & !ant->carries) {
        int k = 0;
        if (foods & (foods - 1)) {
            random = advance(random);
            k = below(bits_of(random) >> 32, __builtin_popcount(foods));
        }
        int towards = heading + bit_number(foods, k) + N_HEADINGS - 1;
        want = (TAKE + towards % N_HEADINGS) | (shared ? TAKES_FOOD : 0);
    }
    ant->random = random;
    ant->heading = heading;
    ant->action = action;
    ant->want = want & MARK;
    w->wants[cell] = want | (shared ? ant->carries * HAS_FOOD : 0);
}

INLINE int wanted_by(const Colony *c, int cell, int want)
{
    return cell + c->steps[(want & 7)]; /* both ENTER and TAKE are 1 modulo 8, as `steps` begins */
}

/* Return the bytes of the neighbours of a cell, in the order of AROUND. Cells are stored in rows:
 * the neighbours at headings 4 and 5, at 2 and 1, and at 3 and 0 with the cell between them are
 * next to each other. The last byte is of another cell. */
INLINE uint64_t around(const Colony *c, const uint8_t *wants, int cell)
{
    uint16_t before, after;
    uint32_t row;
    memcpy(&before, wants + cell + c->steps[5], sizeof before);
    memcpy(&after, wants + cell + c->steps[3], sizeof after);
    memcpy(&row, wants + cell - 1, sizeof row);
    return before | (uint64_t)after << 16 | (uint64_t)row << 32;
}

static const int8_t AROUND[8] = {4, 5, 2, 1, 3, -1, 0, -1};
#define EACH(byte) ((byte) * (uint64_t)0x0101010101010101)

/* Return bit 7 of the byte of each neighbour that wants to enter or take a cell, and whose other
 * `bits` are those of `mark`; the bytes are those of `around` this cell. */
INLINE uint64_t who_want(uint64_t marks, int bits, int mark)
{
    const uint64_t enters = 0xFF04FF0105060302, neighbours = 0x00FF00FFFFFFFFFF;
    uint64_t other = (marks & EACH(bits) & neighbours) ^ (enters | EACH(mark));
    return ~(((other & EACH(127)) + EACH(127)) | other) & EACH(128);
}

/* `loads` are the bytes `wants` if ants with food precede others, else NULL. */
static __attribute__((noinline)) int beats_rivals(
    const int32_t *steps, const uint8_t *loads, uint64_t rivals, int cell, int wanted, int tick)
{
    uint64_t own = bits_of(advance(bits_of(advance(cell)) ^ (uint64_t)tick));
    for (; rivals; rivals &= rivals - 1) {
        int other = wanted + steps[AROUND[__builtin_ctzll(rivals) >> 3] + 1];
        if (other == cell)
            continue;
        int before = loads ? (loads[other] & HAS_FOOD) - (loads[cell] & HAS_FOOD) : 0;
        if (before == 0)
            before = bits_of(advance(bits_of(advance(other)) ^ (uint64_t)tick)) <= own;
        if (before > 0)
            return 0;
    }
    return 1;
}

/* Whether an ant wins: no other ant wants the same, or its key is the smallest. */
INLINE int wins(const Colony *c, const Work *w, int rules, int cell, int want, int tick)
{
    int wanted = wanted_by(c, cell, want);
    const uint8_t *loads = rules & QUEUES ? w->wants : NULL;
    uint64_t rivals = who_want(around(c, w->wants, wanted), MARK, want & 8);
    return !(rivals & (rivals - 1)) || beats_rivals(c->steps, loads, rivals, cell, wanted, tick);
}

INLINE int claims(int want) { return want != 0 && want != STANDS; }

/* The heading towards the ant that wins a cell and has all these `bits`, -1 if there is none. */
INLINE int entered_from(const Colony *c, const Work *w, int cell, int bits)
{
    uint64_t found = who_want(around(c, w->wants, cell), MARK | bits, bits);
    return found ? AROUND[__builtin_ctzll(found) >> 3] : -1;
}

/* Whether the ant on a cell lets an ant with food pass; in queues, only asked of ants that stay. */
INLINE int gives_way(const Colony *c, const Work *w, int rules, int cell)
{
    int mark = w->wants[cell];
    if (mark & (HAS_FOOD | TAKES_FOOD))
        return 0;
    return (rules & QUEUES) || !(mark & WINS) || w->wants[wanted_by(c, cell, mark & MARK)];
}

/* Whether a winner finds the cell `ahead` empty. A queue moves if its first ant does; a ring does
 * not move. */
INLINE int way_is_free(const Colony *c, const Work *w, int rules, int cell, int ahead)
{
    if (rules & QUEUES)
        while (ahead != cell && (w->wants[ahead] & (WINS | TAKES_FOOD)) == WINS)
            ahead = wanted_by(c, ahead, w->wants[ahead] & MARK);
    return !w->wants[ahead];
}

/* Where ants share cells: mark winners, and judge whether a cell with an ant shows a cue. */
INLINE void resolve(const Colony *c, const Work *w, int rules, Ant *ant, int tick, int clock)
{
    int cell = ant->cell, want = ant->want;
    if (!claims(want))
        return;
    int won = wins(c, w, rules, cell, want, tick);
    if (won)
        w->wants[cell] |= WINS;
    else
        ant->want = STANDS;
    if (want < TAKE && (won || (rules & QUEUES))) { /* in a queue, an ant can be pushed there */
        int ahead = wanted_by(c, cell, want);
        int code = code_in_view(ant->percept, ant->action);
        if (w->wants[ahead]) {
            int better = ant->carries ? c->closer[cell] >> ant->heading & 1
                                      : level_of(c, ahead, clock) > level_of(c, cell, clock);
            code = better ? ENTERED_CUE : ENTERED_EMPTY;
        }
        ant->event = code;
    }
}

INLINE void act(const Colony *c, const Work *w, int rules, Ant *ant, int tick, int clock,
                int64_t *counts)
{
    int cell = ant->cell, want = ant->want, action = ant->action, carries = ant->carries;
    int wanted = wanted_by(c, cell, want), claim = claims(want), event = FAILED, goes = cell;
    int moves = action <= RIGHT, filled = 0, came = 0;
    if (shares_cells(rules)) {
        int enters = 0;
        if (moves && claim) {
            enters = way_is_free(c, w, rules, cell, wanted);
            if (rules & QUEUES)
                filled = enters && entered_from(c, w, cell, WINS) >= 0;
            if (!enters && carries && gives_way(c, w, rules, wanted))
                enters = filled = 1;
            if (enters) {
                goes = wanted;
                came = want;
                event = ant->event;
            }
        }
        if (!enters) {
            int towards = entered_from(c, w, cell, WINS | HAS_FOOD);
            if (towards >= 0 && gives_way(c, w, rules, cell)) {
                came = 1 + towards;
                goes = cell + c->steps[came];
                filled = 1;
                event = PUSHED;
                if ((rules & QUEUES) && moves && ant->heading == towards) {
                    enters = 1; /* it wanted to go there */
                    event = ant->event;
                }
            }
        }
        counts[3] += moves && !enters;
    } else {
        claim &= wins(c, w, rules, cell, want, tick); /* also if it wants nothing: faster than a branch */
        int enters = moves & claim;
        goes = enters ? wanted : cell;
        came = enters ? want : 0;
        event = enters ? code_in_view(ant->percept, action) : FAILED;
        counts[3] += moves & !claim;
    }
    counts[2] += moves;
    if (!filled)
        c->ground[cell] = EMPTY;
    int32_t nowhere; /* without a branch, too */
    *((carries & (goes != cell)) ? &c->trail[goes] : &nowhere) =
        after_deposit(c, rules, goes, clock, ant->carried);
    if (carries & (action == GIVE) & (goals_in_view(ant->percept) != 0)) {
        event = DELIVERED;
        carries = ant->carries = 0;
        ant->carried = 0;
        if (rules & QUEUES)
            ant->heading = round_turned(ant->heading);
        counts[1]++;
    } else if (!carries & !moves & claim) {
        event = PICKED_UP;
        carries = ant->carries = 1;
        c->ground[wanted] = EMPTY;
        c->trail[wanted] = after_deposit(c, rules, wanted, clock, 0);
        c->trail[cell] = after_deposit(c, rules, cell, clock, 0);
        ant->heading = round_turned(ant->heading);
    }
    c->ground[goes] = OBSTACLE | (1 + carries) << ANT_SHIFT;
    ant->cell = goes;
    if (rules & DIRECTED)
        ant->carried += carries;
    ant->event = event;
    ant->want = came;
    counts[0] += c->rewards[event];
}

/* `pairs` has the n pairs that the thread has updated in this tick; return the new n. */
INLINE int sense_and_learn(const Colony *c, const Work *w, int rules, Ant *ant, int clock,
                           Errors *errors, int32_t *pairs, int n)
{
    int event = ant->event, next = 0, cell = ant->cell, drawn = 0;
    int percept = see(c, rules, cell, ant->heading, ant->carries, clock, &next);
    float next_value = w->greedy[next].best;
    if ((rules & SARSA) && event != DELIVERED) {
        ant->random = advance(ant->random);
        int action = choose(w->greedy[next].actions, bits_of(ant->random), c->explore_below);
        next_value = c->q[next * ROW + action];
        drawn = 1 + action;
    }
    if (!(rules & FROZEN)) {
        int pair = ant->state * ROW + ant->action;
        float discount = event == DELIVERED ? 0.0f : c->discount;
        float error = (float)c->rewards[event] + discount * next_value - c->q[pair];
        pairs[n] = pair;
        n += errors[pair].updates == 0;
        errors[pair].updates++;
        errors[pair].sum += (int64_t)__builtin_floor((double)error * 4294967296.0 + 0.5);
        errors[pair].latest = error;
    }
    ant->percept = percept;
    ant->state = next;
    w->wants[cell - (ant->want ? c->steps[ant->want] : 0)] = 0; /* its previous cell */
    if (rules & SARSA)
        ant->want = drawn;
    return n;
}

/* Note whose food was taken in a tick, and let food grow back on empty cells when it is time. */
INLINE void regrow(const Colony *c, int tick)
{
    for (int k = 0; k < c->sources; k++) {
        int cell = c->source_at[k], taken = c->taken[cell];
        if (taken < 0 && c->ground[cell] != FOOD)
            taken = tick;
        if (taken >= 0 && tick - taken >= c->regrowth && c->ground[cell] == EMPTY) {
            c->ground[cell] = FOOD;
            taken = -1;
        }
        c->taken[cell] = taken;
    }
}

/* Update the table by the errors of all threads, and reset the errors. */
INLINE void apply(const Colony *c, const Work *w, int threads)
{
    Errors *all = w->errors[0];
    int32_t *pairs = w->pairs[0] + 1, n = w->pairs[0][0];
    for (int t = 1; t < threads; t++)
        for (int k = 1; k <= w->pairs[t][0]; k++) {
            int pair = w->pairs[t][k];
            pairs[n] = pair;
            n += all[pair].updates == 0;
            all[pair].updates += w->errors[t][pair].updates;
            all[pair].sum += w->errors[t][pair].sum;
            all[pair].latest = w->errors[t][pair].latest;
            w->errors[t][pair] = (Errors){0};
        }
    for (int k = 0; k < n; k++) {
        int pair = pairs[k], updates = all[pair].updates;
        float error = all[pair].latest;
        if (updates > 1)
            error = (float)((double)all[pair].sum / ((double)updates * 4294967296.0));
        c->q[pair] += c->weights[updates] * error;
        all[pair] = (Errors){0};
        w->greedy[pair / ROW] = greedy_of(c->q + pair / ROW * ROW);
    }
}

INLINE void pass_as(Colony *colony, const Work *work, int rules, int tick, int ticks, int threads)
{
#pragma omp parallel num_threads(threads)
    {
        /* Copies that no store through a byte pointer can change. */
        const Colony own = *colony, *c = &own;
        const Work mine = *work, *w = &mine;
        int64_t counts[4] = {0};
        int thread = omp_get_thread_num();
        for (int end = tick + ticks, now = tick; now < end; now++) {
            int clock = now * c->evaporates, n = 0;
#pragma omp for schedule(static)
            for (int i = 0; i < c->n; i++)
                choose_and_want(c, w, rules, w->ants + i);
            if (shares_cells(rules)) {
#pragma omp for schedule(static)
                for (int i = 0; i < c->n; i++)
                    resolve(c, w, rules, w->ants + i, now, clock);
            }
#pragma omp for schedule(static)
            for (int i = 0; i < c->n; i++)
                act(c, w, rules, w->ants + i, now, clock, counts);
            if (c->sources) {
#pragma omp single
                regrow(c, now);
            }
            clock += c->evaporates;
            Errors *errors = w->errors[thread];
            int32_t *pairs = w->pairs[thread];
#pragma omp for schedule(static) nowait
            for (int i = 0; i < c->n; i++)
                n = sense_and_learn(c, w, rules, w->ants + i, clock, errors, pairs + 1, n);
            pairs[0] = n;
#pragma omp barrier
#pragma omp single
            apply(c, w, threads);
        }
#pragma omp critical
        for (int k = 0; k < 4; k++)
            colony->counts[k] += counts[k];
    }
}

/* Advance a colony by some ticks from this one. */
static void pass_ticks(Colony *c, const Work *w, int rules, int tick, int ticks, int threads)
{
    if (rules == PAPERS)
        pass_as(c, w, PAPERS, tick, ticks, threads);
    else if (rules == FORAGING)
        pass_as(c, w, FORAGING, tick, ticks, threads);
    else if (rules == QUEUEING)
        pass_as(c, w, QUEUEING, tick, ticks, threads);
    else
        pass_as(c, w, rules, tick, ticks, threads); /* others: bits known at run time */
}

/* Let all ants observe what is in view. */
static void look_around(const Colony *c, const Work *w, int rules, int clock)
{
    for (int i = 0; i < c->n; i++) {
        Ant *ant = w->ants + i;
        int row = 0;
        ant->percept = see(c, rules, ant->cell, ant->heading, ant->carries, clock, &row);
        ant->state = row;
    }
}

/* Store the best actions of all states, after the table has been set. */
static void note_best(const Colony *c, const Work *w)
{
    for (int state = 0; state < c->states; state++) {
        float *row = c->q + state * ROW;
        for (int a = N_ACTIONS; a < ROW; a++)
            row[a] = -__builtin_inff();
        w->greedy[state] = greedy_of(row);
    }
}

/* Return how many cells `around` reads before and after an array with a byte for each cell. */
static int margin(const Colony *c) { return c->steps[2] + 2; }
