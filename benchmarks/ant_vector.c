/* The same as ant.c with sixteen runs at a time, one in each lane of an AVX-512 vector.
 *
 * All lanes take a step together. A lane whose episode ends starts its next episode, and after the
 * last one the next run. Rows of the table are loaded as a whole and transposed, and values are
 * stored one by one, which is faster than gathers and scatters; single values are gathered.
 */
#if defined(__AVX512F__) && defined(__AVX512DQ__)
#include <immintrin.h>
#include <stdlib.h>
#include <string.h>

#include "ant.h"

enum { LANES = 16, N_PAIRS = N_STATES * N_ACTIONS };
/* The distance of the tables of two lanes, with room to load eight floats of the last row. */
enum { TABLE = N_PAIRS + 16 };
/* A cell has its `closer`, then its level or content, and a sign bit if it is not empty. */
enum { LEVEL_AT = 6, CLOSER = 63, OCCUPIED = INT32_MIN };
/* The last transition of a pair: its index in a table, the next row, reward and terminal flag. */
enum { ROW_AT = 11, TRANSITION_AT = 22, PLACE = 2047 };

typedef __m512i Ints;
typedef __m512 Floats;
typedef __mmask16 Mask;

/* The state of sixteen runs that each step reads and changes. */
typedef struct {
    Ints cell, heading, state, step, sum;
    Ints own, view[3];        /* the packed cells of the ant and in view */
    Ints random[2];           /* for eight lanes each */
    Ints explore_up_to;       /* explore if the draw is not larger */
    Mask explores, carries;   /* `explores`: whether epsilon is above 0 */
    Floats values[N_ACTIONS]; /* action values of the state */
    Floats learning_rate, discount;
} Ants;

/* The data in memory, lane by lane. */
typedef struct {
    float q[LANES * TABLE];
    uint64_t random[LANES];
    int32_t start_cell[LANES], start_heading[LANES], start_own[LANES], start_view[3][LANES];
    int32_t explore_up_to[LANES], explores[LANES];
    float learning_rate[LANES], discount[LANES];
    Run run[LANES];
    int32_t number[LANES], episode[LANES]; /* the run and its episode; -1 without a run */
    int32_t running;                       /* lanes with a run */
    int32_t visited[LANES];                /* the number of visited pairs */
    int16_t place[LANES][N_PAIRS];         /* the place of a pair in the order of first visits, from 1 */
    uint32_t transitions[LANES][N_PAIRS];     /* from the lowest bit: pair, next row, transition */
    int32_t stride;                        /* the distance of lanes in `cells` */
    int32_t *cells, *fresh;                /* `fresh`: the cells at the start of an episode */
} Memory;

INLINE Ints all(int32_t value) { return _mm512_set1_epi32(value); }
INLINE Ints load(const int32_t *from) { return _mm512_loadu_si512(from); }

INLINE Ints times_lane(int32_t stride)
{
    const Ints lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    return _mm512_mullo_epi32(lanes, all(stride));
}

/* The steps to neighbours, by heading and position in view. */
INLINE Ints steps_of(const World *world)
{
    return _mm512_castsi256_si512(_mm256_loadu_si256((const __m256i *)world->offsets));
}

INLINE Ints mix(Ints z)
{
    z = _mm512_mullo_epi64(_mm512_xor_si512(z, _mm512_srli_epi64(z, 30)),
                           _mm512_set1_epi64((int64_t)0xBF58476D1CE4E5B9u));
    z = _mm512_mullo_epi64(_mm512_xor_si512(z, _mm512_srli_epi64(z, 27)),
                           _mm512_set1_epi64((int64_t)0x94D049BB133111EBu));
    return _mm512_xor_si512(z, _mm512_srli_epi64(z, 31));
}

/* Combine the lower and upper halves of two vectors of eight into vectors of sixteen. */
INLINE void split(Ints a, Ints b, Ints *low, Ints *high)
{
    const Ints even =
        _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
    *low = _mm512_permutex2var_epi32(a, even, b);
    *high = _mm512_permutex2var_epi32(a, _mm512_add_epi32(even, all(1)), b);
}

/* The next draw of some lanes, as words of 32 bits. */
INLINE void draw_some(Ints random[2], Mask some, Ints *low, Ints *high)
{
    const Ints gamma = _mm512_set1_epi64((int64_t)0x9E3779B97F4A7C15u);
    random[0] = _mm512_mask_add_epi64(random[0], (__mmask8)some, random[0], gamma);
    random[1] = _mm512_mask_add_epi64(random[1], (__mmask8)(some >> 8), random[1], gamma);
    split(mix(random[0]), mix(random[1]), low, high);
}

/* word * n >> 32 */
INLINE Ints below_some(Ints word, Ints n)
{
    Ints even = _mm512_srli_epi64(_mm512_mul_epu32(word, n), 32);
    Ints odd = _mm512_mul_epu32(_mm512_srli_epi64(word, 32), _mm512_srli_epi64(n, 32));
    return _mm512_mask_mov_epi32(even, 0xAAAA, odd);
}

/* Four floats of each lane, as four vectors. */
INLINE void load_fours(const float *q, const int32_t *at, Floats columns[4])
{
    Floats z[4];
    for (int j = 0; j < 4; j++) {
        z[j] = _mm512_castps128_ps512(_mm_loadu_ps(q + at[j]));
        z[j] = _mm512_mask_broadcast_f32x4(z[j], 0x00F0, _mm_loadu_ps(q + at[4 + j]));
        z[j] = _mm512_mask_broadcast_f32x4(z[j], 0x0F00, _mm_loadu_ps(q + at[8 + j]));
        z[j] = _mm512_mask_broadcast_f32x4(z[j], 0xF000, _mm_loadu_ps(q + at[12 + j]));
    }
    __m512d a = _mm512_castps_pd(_mm512_unpacklo_ps(z[0], z[1]));
    __m512d b = _mm512_castps_pd(_mm512_unpackhi_ps(z[0], z[1]));
    __m512d c = _mm512_castps_pd(_mm512_unpacklo_ps(z[2], z[3]));
    __m512d d = _mm512_castps_pd(_mm512_unpackhi_ps(z[2], z[3]));
    columns[0] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, c));
    columns[1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, c));
    columns[2] = _mm512_castpd_ps(_mm512_unpacklo_pd(b, d));
    columns[3] = _mm512_castpd_ps(_mm512_unpackhi_pd(b, d));
}

/* The start of a state's row in a table. */
INLINE Ints row_of(Ints state)
{
    return _mm512_add_epi32(state, _mm512_slli_epi32(state, 2));
}

/* The start of rows in the tables of all lanes. */
INLINE Ints place_of(Ints row)
{
    return _mm512_add_epi32(row, times_lane(TABLE));
}

/* The action values of the rows that start at these indices. */
INLINE void load_rows(const float *q, Ints row, Floats values[N_ACTIONS])
{
    int32_t at[LANES] __attribute__((aligned(64)));
    Floats rest[4];
    _mm512_store_si512(at, row);
    load_fours(q, at, values);
    load_fours(q + 4, at, rest);
    values[4] = rest[0];
}

INLINE Floats load_values(const float *q, Ints place)
{
    return _mm512_i32gather_ps(place, q, 4);
}

INLINE void store_values(float *q, Ints place, Floats values)
{
    int32_t at[LANES] __attribute__((aligned(64)));
    float value[LANES] __attribute__((aligned(64)));
    _mm512_store_si512(at, place);
    _mm512_store_ps(value, values);
    for (int i = 0; i < LANES; i++)
        q[at[i]] = value[i];
}

INLINE Floats best_of(const Floats v[N_ACTIONS])
{
    return _mm512_max_ps(_mm512_max_ps(_mm512_max_ps(v[0], v[1]), _mm512_max_ps(v[2], v[3])),
                         v[4]);
}

INLINE Floats value_of(const Floats values[N_ACTIONS], Ints action)
{
    Floats chosen = values[0];
    for (int a = 1; a < N_ACTIONS; a++)
        chosen = _mm512_mask_mov_ps(chosen, _mm512_cmpeq_epi32_mask(action, all(a)), values[a]);
    return chosen;
}

/* Action values after an update; a transition is the reward * 2, plus 1 if it is terminal. */
INLINE Floats updated(const Ants *ants, Floats value, Ints transition, Floats next_value)
{
    Mask goes_on = _mm512_testn_epi32_mask(transition, all(1));
    Floats reward = _mm512_cvtepi32_ps(_mm512_srai_epi32(transition, 1));
    Floats discount = _mm512_maskz_mov_ps(goes_on, ants->discount);
    Floats error = _mm512_add_ps(reward, _mm512_mul_ps(discount, next_value));
    error = _mm512_sub_ps(error, value);
    return _mm512_add_ps(value, _mm512_mul_ps(ants->learning_rate, error));
}

/* Epsilon-greedy: choose the action by counting the equally good actions before it. */
INLINE Ints choose(const Ants *ants, const Floats values[N_ACTIONS], Ints low, Ints high)
{
    Mask explores = ants->explores & _mm512_cmple_epu32_mask(high, ants->explore_up_to);
    Floats best = best_of(values);
    Ints counts[N_ACTIONS], n = all(0), action = all(0);
    for (int a = 0; a < N_ACTIONS; a++) {
        Mask good = _mm512_cmp_ps_mask(values[a], best, _CMP_EQ_OQ) | explores;
        counts[a] = n = _mm512_mask_add_epi32(n, good, n, all(1));
    }
    Ints k = below_some(low, n);
    for (int a = 0; a < N_ACTIONS - 1; a++) {
        Mask further = _mm512_cmple_epi32_mask(counts[a], k);
        action = _mm512_mask_add_epi32(action, further, action, all(1));
    }
    return action;
}

/* The cells in view. */
INLINE void look(const World *world, const Memory *memory, Ants *ants)
{
    const Ints here = _mm512_add_epi32(ants->cell, times_lane(memory->stride));
    for (int k = 0; k < 3; k++) {
        Ints towards = _mm512_add_epi32(ants->heading, all(k));
        Ints there = _mm512_add_epi32(here, _mm512_permutexvar_epi32(towards, steps_of(world)));
        ants->view[k] = _mm512_i32gather_epi32(there, memory->cells, 4);
    }
}

/* The state index of the cells in view. */
INLINE void judge(Ants *ants)
{
    const Ints closer = _mm512_and_si512(ants->own, all(CLOSER));
    const Ints twice = _mm512_or_si512(closer, _mm512_slli_epi32(closer, N_HEADINGS));
    const Ints nearer = _mm512_srlv_epi32(twice, ants->heading);
    const int bits[3] = {1 << (N_HEADINGS - 1), 1, 2};
    Ints levels[3], strongest = all(2);
    for (int k = 0; k < 3; k++) {
        levels[k] = _mm512_max_epi32(_mm512_srai_epi32(ants->view[k], LEVEL_AT), all(0));
        strongest = _mm512_max_epi32(strongest, levels[k]);
    }
    Ints state = _mm512_maskz_mov_epi32(ants->carries, all(1));
    Ints shift = _mm512_mask_mov_epi32(all(LEVEL_AT), ants->carries, all(LEVEL_AT + 2));
    for (int k = 0; k < 3; k++) {
        Mask occupied = _mm512_movepi32_mask(ants->view[k]);
        Mask trail = _mm512_cmpge_epi32_mask(_mm512_slli_epi32(levels[k], 1), strongest);
        Mask near = _mm512_test_epi32_mask(nearer, all(bits[k])) & (Mask)~occupied;
        Mask lure = (trail & (Mask)~ants->carries) | (near & ants->carries);
        Ints code = _mm512_srlv_epi32(ants->view[k], shift);
        code = _mm512_maskz_and_epi32(occupied, code, all(3));
        code = _mm512_mask_mov_epi32(code, lure, all(SEES_CUE));
        state = _mm512_or_si512(_mm512_slli_epi32(state, 2), code);
    }
    ants->state = state;
}

INLINE void lay_trail(Memory *memory, Mask some, Ints cell, Ints packed)
{
    const Ints closer = _mm512_and_si512(packed, all(CLOSER));
    const Ints trail = _mm512_or_si512(closer, all(DEPOSIT << LEVEL_AT));
    Ints place = _mm512_add_epi32(cell, times_lane(memory->stride));
    int32_t at[LANES] __attribute__((aligned(64)));
    int32_t value[LANES] __attribute__((aligned(64)));
    _mm512_store_si512(at, place);
    _mm512_store_si512(value, trail);
    for (int rest = some; rest; rest &= rest - 1) {
        int i = __builtin_ctz((unsigned)rest);
        memory->cells[at[i]] = value[i];
    }
}

/* Pick up one of the food items in view. */
INLINE void pick_up(const World *world, Memory *memory, Ants *ants, Mask some)
{
    Ints counts[3], n = all(0), position = all(0), low, high, food = ants->view[0];
    for (int k = 0; k < 3; k++) {
        Ints code = _mm512_and_si512(_mm512_srli_epi32(ants->state, 4 - 2 * k), all(3));
        Mask goal = _mm512_cmpeq_epi32_mask(code, all(SEES_GOAL));
        counts[k] = n = _mm512_mask_add_epi32(n, goal, n, all(1));
    }
    Mask several = some & _mm512_cmpgt_epi32_mask(n, all(1));
    Ints chosen = all(0);
    if (several) {
        draw_some(ants->random, several, &low, &high);
        chosen = _mm512_maskz_mov_epi32(several, below_some(high, n));
    }
    for (int k = 0; k < 2; k++) {
        Mask further = _mm512_cmple_epi32_mask(counts[k], chosen);
        position = _mm512_mask_add_epi32(position, further, position, all(1));
    }
    food = _mm512_mask_mov_epi32(food, _mm512_cmpeq_epi32_mask(position, all(1)), ants->view[1]);
    food = _mm512_mask_mov_epi32(food, _mm512_cmpeq_epi32_mask(position, all(2)), ants->view[2]);
    Ints towards = _mm512_add_epi32(ants->heading, position);
    Ints there = _mm512_add_epi32(ants->cell, _mm512_permutexvar_epi32(towards, steps_of(world)));
    lay_trail(memory, some, there, food);
    lay_trail(memory, some, ants->cell, ants->own);
    Ints turned = _mm512_add_epi32(ants->heading, all(3));
    turned = _mm512_mask_sub_epi32(turned, _mm512_cmpge_epi32_mask(turned, all(N_HEADINGS)),
                                   turned, all(N_HEADINGS));
    ants->heading = _mm512_mask_mov_epi32(ants->heading, some, turned);
    ants->carries |= some;
}

/* Act; return the rewards, and the lanes that have delivered. */
INLINE Ints act(const World *world, Memory *memory, Ants *ants, Ints action, Mask *delivered)
{
    const Ints headings = _mm512_setr_epi32(5, 0, 1, 2, 3, 4, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    Ints shift = _mm512_sub_epi32(all(4), _mm512_slli_epi32(action, 1));
    Ints code = _mm512_and_si512(_mm512_srlv_epi32(ants->state, shift), all(3));
    Mask turns = _mm512_cmple_epi32_mask(action, all(RIGHT));
    Mask moves = turns & _mm512_testn_epi32_mask(code, all(1));
    Ints towards = _mm512_add_epi32(ants->heading, action);
    Ints target = ants->view[0];
    target = _mm512_mask_mov_epi32(target, _mm512_cmpeq_epi32_mask(action, all(1)), ants->view[1]);
    target = _mm512_mask_mov_epi32(target, _mm512_cmpeq_epi32_mask(action, all(2)), ants->view[2]);
    Ints goals = _mm512_and_si512(ants->state, _mm512_srli_epi32(ants->state, 1));
    Mask sees_goal = _mm512_test_epi32_mask(goals, all(21));
    Mask gives = sees_goal & ants->carries & _mm512_cmpeq_epi32_mask(action, all(GIVE));
    Mask picks = sees_goal & (Mask)~ants->carries & _mm512_cmpeq_epi32_mask(action, all(PICK_UP));
    Ints reward = _mm512_mask_srli_epi32(all(-1), moves, code, 1);
    reward = _mm512_mask_mov_epi32(reward, gives, all(10));
    if (picks) {
        reward = _mm512_mask_mov_epi32(reward, picks, all(3));
        pick_up(world, memory, ants, picks);
    }
    ants->cell = _mm512_mask_add_epi32(ants->cell, moves, ants->cell,
                                       _mm512_permutexvar_epi32(towards, steps_of(world)));
    ants->own = _mm512_mask_mov_epi32(ants->own, moves, target);
    ants->heading = _mm512_mask_permutexvar_epi32(ants->heading, turns, towards, headings);
    Mask lays = moves & ants->carries;
    if (lays)
        lay_trail(memory, lays, ants->cell, target);
    ants->carries &= (Mask)~gives;
    *delivered = gives;
    return reward;
}

/* Store transitions in the models. */
INLINE void remember(Memory *memory, Ints pair, Ints packed)
{
    int32_t pairs[LANES] __attribute__((aligned(64)));
    uint32_t transitions[LANES] __attribute__((aligned(64)));
    _mm512_store_si512(pairs, pair);
    _mm512_store_si512(transitions, packed);
    for (int i = 0; i < LANES; i++) {
        int16_t *place = &memory->place[i][pairs[i]];
        if (*place == 0)
            *place = (int16_t)++memory->visited[i];
        memory->transitions[i][*place - 1] = transitions[i];
    }
}

/* Update randomly drawn pairs from the models. */
INLINE void plan(Memory *memory, Ants *ants, int steps)
{
    const Ints visited = load(memory->visited), lanes = times_lane(N_PAIRS);
    for (int k = 0; k < steps; k++) {
        int32_t at[LANES] __attribute__((aligned(64)));
        uint32_t seen[LANES] __attribute__((aligned(64)));
        Ints low, high;
        draw_some(ants->random, 0xFFFF, &low, &high);
        _mm512_store_si512(at, _mm512_add_epi32(below_some(high, visited), lanes));
        for (int i = 0; i < LANES; i++)
            seen[i] = memory->transitions[0][at[i]];
        const Ints packed = _mm512_load_si512(seen);
        Ints place = place_of(_mm512_and_si512(packed, all(PLACE)));
        Ints row = _mm512_and_si512(_mm512_srli_epi32(packed, ROW_AT), all(PLACE));
        Ints transition = _mm512_srai_epi32(packed, TRANSITION_AT);
        Floats values[N_ACTIONS];
        load_rows(memory->q, place_of(row), values);
        Floats value = load_values(memory->q, place);
        store_values(memory->q, place, updated(ants, value, transition, best_of(values)));
    }
}

/* Start a run in a lane. */
static void begin_run(const World *world, const Job *job, Memory *memory, int lane, int number,
                      Run run)
{
    memory->number[lane] = number;
    memory->episode[lane] = 0;
    memory->run[lane] = run;
    memory->random[lane] = run.random;
    memory->learning_rate[lane] = run.learning_rate;
    memory->discount[lane] = run.discount;
    memory->visited[lane] = 0;
    memset(memory->place[lane], 0, sizeof memory->place[lane]);
    memory->start_cell[lane] = run.cell;
    memory->start_heading[lane] = run.heading;
    memory->start_own[lane] = memory->fresh[run.cell];
    for (int k = 0; k < 3; k++)
        memory->start_view[k][lane] = memory->fresh[run.cell + world->offsets[run.heading + k]];
    const float *q = job->q + (size_t)number * N_PAIRS;
    for (int pair = 0; pair < N_PAIRS; pair++)
        memory->q[lane * TABLE + pair] = q[pair];
}

/* Write the outcome of an episode, and the table after the last episode of a run. */
static void end_episode(const Job *job, Memory *memory, int lane, int sum, int steps)
{
    int number = memory->number[lane], episode = memory->episode[lane]++;
    Run *run = &memory->run[lane];
    job->returns[(size_t)number * job->episodes + episode] = sum;
    job->steps[(size_t)number * job->episodes + episode] = steps;
    double epsilon = run->epsilon * run->decay;
    run->epsilon = epsilon > run->min_epsilon ? epsilon : run->min_epsilon;
    if (memory->episode[lane] < job->episodes)
        return;
    float *q = job->q + (size_t)number * N_PAIRS;
    for (int pair = 0; pair < N_PAIRS; pair++)
        q[pair] = memory->q[lane * TABLE + pair];
    memory->number[lane] = -1;
    memory->running--;
}

/* End the episodes of some lanes, and start the next ones. A lane without a run repeats the first
 * run, and writes no results. */
static void restart(const World *world, const Job *job, const Run *runs, int *taken,
                    Memory *memory, Ants *ants, Mask some)
{
    int32_t sums[LANES], steps[LANES];
    _mm512_storeu_si512(sums, ants->sum);
    _mm512_storeu_si512(steps, ants->step);
    _mm512_storeu_si512(memory->random, ants->random[0]);
    _mm512_storeu_si512(memory->random + 8, ants->random[1]);
    for (int rest = some; rest; rest &= rest - 1) {
        int lane = __builtin_ctz((unsigned)rest), next;
        if (memory->number[lane] >= 0)
            end_episode(job, memory, lane, sums[lane], steps[lane]);
        if (memory->number[lane] < 0) {
#pragma omp atomic capture
            next = (*taken)++;
            memory->running += next < job->n;
            begin_run(world, job, memory, lane, next < job->n ? next : 0,
                      runs[next < job->n ? next : 0]);
            memory->number[lane] = next < job->n ? next : -1;
        }
        uint64_t explore_below = (uint64_t)(memory->run[lane].epsilon * 4294967296.0);
        memory->explore_up_to[lane] = (int32_t)(uint32_t)(explore_below - 1);
        memory->explores[lane] = explore_below > 0;
        memcpy(memory->cells + lane * memory->stride, memory->fresh,
               (size_t)memory->stride * sizeof(int32_t));
    }
    ants->random[0] = _mm512_loadu_si512(memory->random);
    ants->random[1] = _mm512_loadu_si512(memory->random + 8);
    ants->explore_up_to = load(memory->explore_up_to);
    ants->explores = _mm512_test_epi32_mask(load(memory->explores), all(1));
    ants->learning_rate = _mm512_loadu_ps(memory->learning_rate);
    ants->discount = _mm512_loadu_ps(memory->discount);
    ants->cell = _mm512_mask_mov_epi32(ants->cell, some, load(memory->start_cell));
    ants->heading = _mm512_mask_mov_epi32(ants->heading, some, load(memory->start_heading));
    ants->own = _mm512_mask_mov_epi32(ants->own, some, load(memory->start_own));
    for (int k = 0; k < 3; k++)
        ants->view[k] = _mm512_mask_mov_epi32(ants->view[k], some, load(memory->start_view[k]));
    ants->carries &= (Mask)~some;
    ants->sum = _mm512_mask_mov_epi32(ants->sum, some, all(0));
    ants->step = _mm512_mask_mov_epi32(ants->step, some, all(0));
    judge(ants);
    load_rows(memory->q, place_of(row_of(ants->state)), ants->values);
}

/* Train runs until none is left, for a learner that is known at compile time. */
INLINE void train_lanes(const World *world, const Job *job, const Run *runs, int *taken,
                        Memory *memory, int learner)
{
    Ants ants = {.carries = 0};
    Ints next_action = all(0), low, high;
    Mask ended = 0xFFFF;
    for (;;) {
        if (ended) {
            restart(world, job, runs, taken, memory, &ants, ended);
            if (memory->running == 0)
                return;
            if (learner == SARSA) {
                draw_some(ants.random, ended, &low, &high);
                Ints first = choose(&ants, ants.values, low, high);
                next_action = _mm512_mask_mov_epi32(next_action, ended, first);
            }
        }
        Ints action = next_action, state = ants.state;
        if (learner != SARSA) {
            draw_some(ants.random, 0xFFFF, &low, &high);
            action = choose(&ants, ants.values, low, high);
        }
        Mask delivered;
        Ints reward = act(world, memory, &ants, action, &delivered);
        Mask terminated = job->delivery_truncates ? 0 : delivered;
        look(world, memory, &ants);
        judge(&ants);
        Ints pair = _mm512_add_epi32(row_of(state), action);
        Ints row = row_of(ants.state);
        Floats values[N_ACTIONS], next_value;
        load_rows(memory->q, place_of(row), values);
        if (learner == SARSA) {
            draw_some(ants.random, (Mask)~terminated, &low, &high);
            next_action = choose(&ants, values, low, high);
            next_value = value_of(values, next_action);
        } else {
            next_value = best_of(values);
        }
        Ints transition = _mm512_slli_epi32(reward, 1);
        transition = _mm512_mask_or_epi32(transition, terminated, transition, all(1));
        Floats value = updated(&ants, value_of(ants.values, action), transition, next_value);
        store_values(memory->q, place_of(pair), value);
        if (learner == DYNA_Q) {
            Ints packed = _mm512_or_si512(pair, _mm512_slli_epi32(row, ROW_AT));
            packed = _mm512_or_si512(packed, _mm512_slli_epi32(transition, TRANSITION_AT));
            remember(memory, pair, packed);
            plan(memory, &ants, job->planning_steps);
            load_rows(memory->q, place_of(row), ants.values);
        } else {
            Mask same = _mm512_cmpeq_epi32_mask(state, ants.state);
            for (int a = 0; a < N_ACTIONS; a++) {
                Mask changed = same & _mm512_cmpeq_epi32_mask(action, all(a));
                ants.values[a] = _mm512_mask_mov_ps(values[a], changed, value);
            }
        }
        ants.sum = _mm512_add_epi32(ants.sum, reward);
        ants.step = _mm512_add_epi32(ants.step, all(1));
        ended = delivered | _mm512_cmpge_epi32_mask(ants.step, all(job->max_steps));
    }
}

/* The same as `train` of ant.c. Levels of trails are below 2 ** 25. */
int train_vector(const World *world, const Job *job, const Run *runs)
{
    int taken = 0, enough = 1;
#pragma omp parallel num_threads(job->threads) reduction(&& : enough)
    {
        size_t cells = (size_t)world->size;
        Memory *memory = calloc(1, sizeof(Memory));
        int32_t *room = malloc((LANES + 1) * (cells + 16) * sizeof(int32_t));
        enough = memory != NULL && room != NULL;
        if (enough) {
            memory->stride = world->size + 16;
            memory->cells = room;
            memset(memory->number, -1, sizeof memory->number);
            memory->fresh = room + LANES * (size_t)memory->stride;
            for (int c = 0; c < world->size; c++) {
                int ground = world->ground[c];
                int packed = ground ? OCCUPIED | ground << LEVEL_AT : world->trail[c] << LEVEL_AT;
                memory->fresh[c] = packed | world->closer[c];
            }
            if (job->learner == Q_LEARNING)
                train_lanes(world, job, runs, &taken, memory, Q_LEARNING);
            else if (job->learner == SARSA)
                train_lanes(world, job, runs, &taken, memory, SARSA);
            else
                train_lanes(world, job, runs, &taken, memory, DYNA_Q);
        }
        free(room);
        free(memory);
    }
    return enough;
}
#endif
