/* A colony of ants that share one table, in C with OpenMP, for comparison in colony_in_c.py.
 *
 * The rules, random numbers and arithmetic are those of the package (taichi_ants/engines/colony),
 * for two of its tasks: the paper's and foraging(). Results are equal to the bit if the compiler
 * does not fuse multiplications and additions (-ffp-contract=off). The design is that of a patient
 * programmer: small columns, one byte per cell for its content and one for what its ant wants,
 * three or four passes over the ants in a tick, and ants sorted by cell from time to time.
 */
#include <math.h>
#include <omp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#ifdef __BMI2__
#include <immintrin.h>
#endif

enum { EMPTY = 0, OBSTACLE = 5, QUEEN = 13 };
enum { LEFT, FORWARD, RIGHT, PICK_UP, GIVE, N_ACTIONS };
enum { ENTERED_EMPTY, FAILED, ENTERED_LURE, PICKED_UP, DELIVERED };
enum { SEES_LURE = 2, ROW = 8, N_HEADINGS = 6 };
/* What the ant on a cell wants: nothing, to enter the cell at a heading, to take the food there. */
enum { ENTER = 1, STANDS = 7, TAKE = 9, MARK = 15 };
/* Flags in the same byte, which other ants read. */
enum { HAS_FOOD = 16, TAKES_FOOD = 32, WINS = 64 };
enum { ANT_SHIFT = 4 }; /* above the ground: 1 for an ant, 2 for a carrier */
enum { TICKS_BETWEEN_SORTS = 8, CELLS_TOGETHER = 64, MOST_THREADS = 64 };

typedef struct {
    int32_t size, n;
    uint8_t *ground;       /* (size) the ground, and marks of ants, see ANT_SHIFT */
    int32_t *trail;        /* (size) the clock at which the trail has evaporated */
    const uint8_t *closer; /* (size) bit h: the neighbour at heading h is nearer to the queen */
    const int32_t *steps;  /* (8) to the neighbours at headings 5, 0, 1, 2, 3, 4, 5, 0 */
    int32_t *cells;        /* (n) the cells of the ants */
    uint8_t *headings;
    uint64_t *random;
    float *q; /* (states, ROW) */
    int32_t states, evaporates;
    int32_t level, slope, fades_after;
    float discount;
    uint64_t explore_below;
    const float *weights;   /* (n + 1) */
    const int32_t *rewards; /* (5) in the order of the fields of Rewards, as events are here */
    int64_t counts[4];      /* the results: returns, deliveries, moves, blocked */
} Colony;

/* Further columns of the ants, and the sums of TD errors of each thread. */
typedef struct {
    uint8_t *carries, *percept, *action, *want, *event, *wants;
    uint16_t *state;
    int32_t *carried;
    int64_t *sums[MOST_THREADS];
    int32_t *updates[MOST_THREADS];
    float *latest[MOST_THREADS];
} Work;

#define INLINE static inline __attribute__((always_inline))

INLINE uint64_t advance(uint64_t state) { return state + 0x9E3779B97F4A7C15u; }

INLINE uint64_t bits_of(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

INLINE int below(uint64_t word, int n) { return (int)((word * (uint64_t)n) >> 32); }

INLINE int bit_number(unsigned mask, int k)
{
#ifdef __BMI2__
    return __builtin_ctz(_pdep_u32(1u << k, mask));
#else
    while (k--)
        mask &= mask - 1;
    return __builtin_ctz(mask);
#endif
}

INLINE int round_turned(int heading) { return heading < 3 ? heading + 3 : heading - 3; }

INLINE int turned(int heading, int action)
{
    static const uint8_t after[N_ACTIONS][8] = {
        {5, 0, 1, 2, 3, 4}, {0, 1, 2, 3, 4, 5}, {1, 2, 3, 4, 5, 0},
        {0, 1, 2, 3, 4, 5}, {0, 1, 2, 3, 4, 5}};
    return after[action][heading];
}

INLINE int goals_in_view(int percept)
{
    int both = percept & percept >> 1;
    return (both >> 4 & 1) | (both >> 1 & 2) | (both & 1) << 2;
}

/* Without a branch, because the processor cannot predict what the next ant does. */
INLINE int choose(const float *q, uint64_t bits, uint64_t explore_below)
{
    float best = q[0];
    for (int a = 1; a < N_ACTIONS; a++)
        best = q[a] > best ? q[a] : best;
    unsigned mask = 0;
    for (int a = 0; a < N_ACTIONS; a++)
        mask |= (unsigned)(q[a] == best) << a;
    mask = bits >> 32 < explore_below ? (1 << N_ACTIONS) - 1 : mask;
    return bit_number(mask, below(bits & 0xFFFFFFFFu, __builtin_popcount(mask)));
}

INLINE int level_of(const Colony *c, int cell, int clock)
{
    int level = c->trail[cell] - clock;
    return level > 0 ? level : 0;
}

/* The percept of an ant, and under the rules of foraging the row of its table. */
INLINE int see(const Colony *c, int foraging, int cell, int heading, int carries, int clock, int *row)
{
    int codes[3], levels[3] = {0}, ants[3], nearer, strongest;
    nearer = c->closer[cell];
    nearer = (nearer | nearer << 6 | nearer << 12) >> (heading + 5);
    strongest = foraging ? 1 : 2;
    for (int k = 0; k < 3; k++) {
        int place = cell + c->steps[heading + k];
        codes[k] = c->ground[place] & 15;
        ants[k] = c->ground[place] >> ANT_SHIFT;
        if (foraging || !carries) {
            levels[k] = level_of(c, place, clock);
            int visible = codes[k] == EMPTY ? levels[k] : 0;
            strongest = visible > strongest ? visible : strongest;
        }
    }
    for (int k = 0; k < 3; k++) {
        if (carries) {
            codes[k] = codes[k] == EMPTY && nearer >> k & 1 ? SEES_LURE : codes[k] >> 2;
        } else {
            int visible = codes[k] == EMPTY ? levels[k] : 0;
            int lures = foraging ? visible >= strongest : 2 * visible >= strongest;
            codes[k] = lures ? SEES_LURE : codes[k] & 3;
        }
    }
    if (foraging) {
        int index = carries, own = level_of(c, cell, clock);
        for (int k = 0; k < 3; k++) {
            int better = carries ? nearer >> k & 1 : levels[k] > own;
            int code = ants[k] == 2 - carries ? (better ? 4 : 5) : codes[k];
            index = 6 * index + code;
        }
        *row = index;
    }
    return carries << 6 | codes[0] << 4 | codes[1] << 2 | codes[2];
}

INLINE void deposit(const Colony *c, int foraging, int cell, int clock, int carried)
{
    int laid = c->level;
    if (foraging) {
        laid -= c->slope * (carried < c->fades_after ? carried : c->fades_after);
        int before = level_of(c, cell, clock);
        laid = before > laid ? before : laid;
    }
    c->trail[cell] = clock + laid;
}

INLINE void choose_and_want(const Colony *c, const Work *w, int foraging, int i)
{
    int row = foraging ? w->state[i] : w->percept[i], percept = w->percept[i];
    uint64_t random = advance(c->random[i]);
    int action = choose(c->q + row * ROW, bits_of(random), c->explore_below);
    int cell = c->cells[i], heading = turned(c->headings[i], action);
    int enters = !(percept >> (4 - 2 * (action & 3)) & 1);
    if (foraging)
        enters |= c->ground[cell + c->steps[heading + 1]] >> ANT_SHIFT;
    int want = enters & (action <= RIGHT) ? ENTER + heading : foraging ? STANDS : 0;
    int foods = goals_in_view(percept);
    if (foods && action == PICK_UP && !w->carries[i]) {
        int k = 0;
        if (foods & (foods - 1)) {
            random = advance(random);
            k = below(bits_of(random) >> 32, __builtin_popcount(foods));
        }
        int towards = heading + bit_number(foods, k) + N_HEADINGS - 1;
        want = (TAKE + towards % N_HEADINGS) | (foraging ? TAKES_FOOD : 0);
    }
    c->random[i] = random;
    c->headings[i] = heading;
    w->action[i] = action;
    w->want[i] = want & MARK;
    w->wants[cell] = want | (foraging && w->carries[i] ? HAS_FOOD : 0);
}

INLINE int wanted_by(const Colony *c, int cell, int want)
{
    return cell + c->steps[(want & 7)]; /* both ENTER and TAKE are 1 modulo 8, as `steps` begins */
}

static __attribute__((noinline)) int beats_rivals(
    const int32_t *steps, const uint8_t *wants, int cell, int wanted, int kind, int tick)
{
    uint64_t own = bits_of(advance(bits_of(advance(cell)) ^ (uint64_t)tick));
    for (int h = 0; h < N_HEADINGS; h++) {
        int other = wanted + steps[h + 1];
        if ((wants[other] & MARK) == (kind | (1 + round_turned(h))) && other != cell &&
            bits_of(advance(bits_of(advance(other)) ^ (uint64_t)tick)) <= own)
            return 0;
    }
    return 1;
}

/* Whether an ant wins: no other ant wants the same, or its key is the smallest. */
INLINE int wins(const Colony *c, const Work *w, int cell, int want, int tick)
{
    int wanted = wanted_by(c, cell, want), kind = want & 8, rivals = -1;
    for (int h = 0; h < N_HEADINGS; h++)
        rivals += (w->wants[wanted + c->steps[h + 1]] & MARK) == (kind | (1 + round_turned(h)));
    return rivals <= 0 || beats_rivals(c->steps, w->wants, cell, wanted, kind, tick);
}

INLINE int claims(int want) { return want != 0 && want != STANDS; }

/* The heading towards the carrier that wins the cell of another ant, -1 if none does. */
INLINE int pushed_towards(const Colony *c, const Work *w, int cell)
{
    int found = -1;
    for (int h = 0; h < N_HEADINGS; h++) {
        int mark = w->wants[cell + c->steps[h + 1]] & (MARK | WINS | HAS_FOOD);
        found = mark == ((1 + round_turned(h)) | WINS | HAS_FOOD) ? h : found;
    }
    return found;
}

INLINE int gives_way(const Colony *c, const Work *w, int cell)
{
    int mark = w->wants[cell];
    if (mark & (HAS_FOOD | TAKES_FOOD))
        return 0;
    return !(mark & WINS) || w->wants[wanted_by(c, cell, mark & MARK)];
}

/* Under the rules of foraging: mark winners, and judge whether a cell with an ant is a lure. */
INLINE void resolve(const Colony *c, const Work *w, int i, int tick, int clock)
{
    int cell = c->cells[i], want = w->want[i];
    if (!claims(want))
        return;
    if (!wins(c, w, cell, want, tick)) {
        w->want[i] = STANDS;
        return;
    }
    w->wants[cell] |= WINS;
    if (want < TAKE) {
        int ahead = wanted_by(c, cell, want);
        int code = w->percept[i] >> (4 - 2 * w->action[i]) & 3;
        if (w->wants[ahead]) {
            int better = w->carries[i] ? c->closer[cell] >> c->headings[i] & 1
                                       : level_of(c, ahead, clock) > level_of(c, cell, clock);
            code = better ? ENTERED_LURE : ENTERED_EMPTY;
        }
        w->event[i] = code;
    }
}

INLINE void act(const Colony *c, const Work *w, int foraging, int i, int tick, int clock, int64_t *counts)
{
    int cell = c->cells[i], want = w->want[i], action = w->action[i], carries = w->carries[i];
    int wanted = wanted_by(c, cell, want), claim = claims(want), event = FAILED, goes = cell;
    int moves = action <= RIGHT, filled = 0, came = 0;
    if (foraging) {
        int enters = 0;
        if (moves && claim) {
            enters = !w->wants[wanted];
            if (!enters && carries && gives_way(c, w, wanted))
                enters = filled = 1;
            if (enters) {
                goes = wanted;
                came = want;
                event = w->event[i];
            }
        }
        if (!enters) {
            int towards = pushed_towards(c, w, cell);
            if (towards >= 0 && gives_way(c, w, cell)) {
                came = 1 + towards;
                goes = cell + c->steps[came];
                filled = 1;
                event = ENTERED_EMPTY;
            }
        }
        counts[3] += moves && !enters;
    } else {
        claim &= wins(c, w, cell, want, tick); /* also if it wants nothing, which is faster than a branch */
        int enters = moves & claim;
        goes = enters ? wanted : cell;
        came = enters ? want : 0;
        event = enters ? w->percept[i] >> (4 - 2 * (action & 3)) & 3 : FAILED;
        counts[3] += moves & !claim;
    }
    counts[2] += moves;
    if (!filled)
        c->ground[cell] = EMPTY;
    if (carries) {
        if (goes != cell)
            deposit(c, foraging, goes, clock, foraging ? w->carried[i] : 0);
        else if (action == GIVE && goals_in_view(w->percept[i])) {
            event = DELIVERED;
            carries = w->carries[i] = 0;
            if (foraging)
                w->carried[i] = 0;
            counts[1]++;
        }
    } else if (!moves && claim) {
        event = PICKED_UP;
        carries = w->carries[i] = 1;
        c->ground[wanted] = EMPTY;
        deposit(c, foraging, wanted, clock, 0);
        deposit(c, foraging, cell, clock, 0);
        c->headings[i] = round_turned(c->headings[i]);
    }
    c->ground[goes] = OBSTACLE | (1 + carries) << ANT_SHIFT;
    c->cells[i] = goes;
    if (foraging)
        w->carried[i] += carries;
    w->event[i] = event;
    w->want[i] = came;
    counts[0] += c->rewards[event];
}

INLINE void sense_and_learn(const Colony *c, const Work *w, int foraging, int i, int clock, int thread)
{
    int event = w->event[i], row = 0, cell = c->cells[i];
    int percept = see(c, foraging, cell, c->headings[i], w->carries[i], clock, &row);
    row = foraging ? row : percept;
    int pair = (foraging ? w->state[i] : w->percept[i]) * ROW + w->action[i];
    const float *next = c->q + row * ROW;
    float best = next[0], discount = event == DELIVERED ? 0.0f : c->discount;
    for (int a = 1; a < N_ACTIONS; a++)
        best = next[a] > best ? next[a] : best;
    float error = (float)c->rewards[event] + discount * best - c->q[pair];
    w->updates[thread][pair]++;
    w->sums[thread][pair] += (int64_t)floor((double)error * 4294967296.0 + 0.5);
    w->latest[thread][pair] = error;
    w->percept[i] = percept;
    if (foraging)
        w->state[i] = row;
    w->wants[cell - (w->want[i] ? c->steps[w->want[i]] : 0)] = 0; /* its previous cell */
}

/* Update the table by the errors of all threads, and reset the errors. */
INLINE void apply(const Colony *c, const Work *w, int threads)
{
    for (int pair = 0; pair < c->states * ROW; pair++) {
        int updates = 0;
        int64_t sum = 0;
        float error = 0;
        for (int t = 0; t < threads; t++) {
            if (w->updates[t][pair]) {
                updates += w->updates[t][pair];
                sum += w->sums[t][pair];
                error = w->latest[t][pair];
                w->updates[t][pair] = 0;
                w->sums[t][pair] = 0;
            }
        }
        if (updates) {
            if (updates > 1)
                error = (float)((double)sum / ((double)updates * 4294967296.0));
            c->q[pair] += c->weights[updates] * error;
        }
    }
}

#define REORDER(column)                                                                            \
    do {                                                                                           \
        _Pragma("omp for schedule(static)") for (int i = 0; i < c->n; i++)                         \
            memcpy((char *)spare + (size_t)i * sizeof *(column), &(column)[order[i]],              \
                   sizeof *(column));                                                              \
        _Pragma("omp for schedule(static)") for (int i = 0; i < c->n; i++)                         \
            memcpy(&(column)[i], (char *)spare + (size_t)i * sizeof *(column), sizeof *(column));  \
    } while (0)

/* Store the ants in the order of groups of cells, by a counting sort of all threads. */
INLINE void sort(const Colony *c, const Work *w, int foraging, int *places, int *order, void *spare)
{
    int groups = c->size / CELLS_TOGETHER + 1, thread = omp_get_thread_num();
    int threads = omp_get_num_threads();
    memset(places + thread * groups, 0, groups * sizeof *places);
#pragma omp for schedule(static)
    for (int i = 0; i < c->n; i++)
        places[thread * groups + c->cells[i] / CELLS_TOGETHER]++;
#pragma omp single
    for (int group = 0, before = 0; group < groups; group++)
        for (int t = 0; t < threads; t++) {
            int here = places[t * groups + group];
            places[t * groups + group] = before;
            before += here;
        }
#pragma omp for schedule(static)
    for (int i = 0; i < c->n; i++)
        order[places[thread * groups + c->cells[i] / CELLS_TOGETHER]++] = i;
    REORDER(c->cells);
    REORDER(c->headings);
    REORDER(c->random);
    REORDER(w->carries);
    REORDER(w->percept);
    if (foraging) {
        REORDER(w->state);
        REORDER(w->carried);
    }
}

INLINE void run_as(Colony *colony, const Work *work, int foraging, int ticks, int threads)
{
    int groups = colony->size / CELLS_TOGETHER + 1;
    int *places = malloc(sizeof(int) * groups * threads), *order = malloc(sizeof(int) * colony->n);
    void *spare = malloc(8 * (size_t)colony->n);
#pragma omp parallel num_threads(threads)
    {
        /* Copies that no store through a byte pointer can change. */
        const Colony own = *colony, *c = &own;
        const Work mine = *work, *w = &mine;
        int64_t counts[4] = {0};
        int thread = omp_get_thread_num();
#pragma omp for schedule(static)
        for (int i = 0; i < c->n; i++) {
            int row = 0;
            w->percept[i] = see(c, foraging, c->cells[i], c->headings[i], 0, 0, &row);
            if (foraging)
                w->state[i] = row;
        }
        for (int tick = 0; tick < ticks; tick++) {
            int clock = tick * c->evaporates;
            if (tick % TICKS_BETWEEN_SORTS == 0)
                sort(c, w, foraging, places, order, spare);
#pragma omp for schedule(static)
            for (int i = 0; i < c->n; i++)
                choose_and_want(c, w, foraging, i);
            if (foraging) {
#pragma omp for schedule(static)
                for (int i = 0; i < c->n; i++)
                    resolve(c, w, i, tick, clock);
            }
#pragma omp for schedule(static)
            for (int i = 0; i < c->n; i++)
                act(c, w, foraging, i, tick, clock, counts);
#pragma omp for schedule(static)
            for (int i = 0; i < c->n; i++)
                sense_and_learn(c, w, foraging, i, (tick + 1) * c->evaporates, thread);
#pragma omp single
            apply(c, w, threads);
        }
#pragma omp critical
        for (int k = 0; k < 4; k++)
            colony->counts[k] += counts[k];
    }
    free(places);
    free(order);
    free(spare);
}

/* Run an episode of some ticks, in which ants start without food. Return the seconds of the ticks. */
double run(Colony *c, int foraging, int ticks, int threads)
{
    Work w;
    size_t n = c->n, pairs = (size_t)c->states * ROW;
    uint8_t *columns = calloc(n, 5);
    w.carries = columns, w.percept = columns + n, w.action = columns + 2 * n;
    w.want = columns + 3 * n, w.event = columns + 4 * n;
    w.wants = calloc(c->size, 1);
    w.state = calloc(n, sizeof *w.state);
    w.carried = calloc(n, sizeof *w.carried);
    for (int t = 0; t < threads; t++) {
        w.sums[t] = calloc(pairs + 64, sizeof **w.sums);
        w.updates[t] = calloc(pairs + 64, sizeof **w.updates);
        w.latest[t] = calloc(pairs + 64, sizeof **w.latest);
    }
    double began = omp_get_wtime();
    if (foraging)
        run_as(c, &w, 1, ticks, threads);
    else
        run_as(c, &w, 0, ticks, threads);
    double seconds = omp_get_wtime() - began;
    for (int t = 0; t < threads; t++)
        free(w.sums[t]), free(w.updates[t]), free(w.latest[t]);
    free(columns), free(w.wants), free(w.state), free(w.carried);
    return seconds;
}
