/* The colony of a page: one in memory, which a visitor can change between two ticks.
 *
 * Ants keep their places: the place of an ant is its number, so that a page can follow it. All
 * memory is allocated by `lay_out`, so that a page's views of it stay valid. Interventions are those
 * of taichi_ants/engines/colony/interventions.py.
 */
#include "colony.c"
#include "grid.h"

enum { REACH = 8 }; /* of the search for a cell to which an ant can move aside */
enum { TICKS_TO_FADE = 20, FARTHEST = 2048 };

static Colony C;
static Work W;
static Grid G;
static int rules, most, tick, queen, next_number, n_start_cells;
static uint64_t seed, interventions;
static char *memory;

/* What the page reads and writes. */
static struct {
    uint8_t *ground, *levels, *headings, *looks;
    int32_t *cells, *before, *before2, *brush;
    uint16_t *states;
    float *traffic;
    int32_t mind[4];
} page;

/* A frame of frames.c, what the frames before it have sent, and what one with actions needs. */
static struct {
    uint8_t *bytes, *known, *ahead, *sent_ground;
    uint16_t *rows;
    int32_t *numbers, *sent_numbers, *sent_trail, *updates;
    float *before, *sent_q;
    int sent_n, sent_queen;
} frame;

static uint8_t *is_source, *painted;
static int32_t *start_cells; /* all cells in the order in which ants take them */
static uint64_t *keys;

/* Take part of the memory, or only add up what is needed while `memory` is NULL. */
static void *part(size_t *taken, size_t bytes)
{
    char *found = memory ? memory + *taken : NULL;
    *taken += (bytes + 31) & ~(size_t)31;
    return found;
}

static size_t share_memory(void)
{
    size_t n = 0, cells = G.size, pairs = C.states * ROW;
    uint8_t *wants = part(&n, cells + 2 * margin(&C));
    W.wants = memory ? wants + margin(&C) : NULL;
    C.ground = part(&n, cells), C.trail = part(&n, 4 * cells), C.closer = part(&n, cells);
    C.q = part(&n, 4 * pairs), C.weights = part(&n, 4 * (most + 1));
    C.rewards = part(&n, 4 * 6);
    C.source_at = part(&n, 4 * cells), C.taken = part(&n, 4 * cells);
    W.ants = part(&n, most * sizeof *W.ants), W.greedy = part(&n, C.states * sizeof *W.greedy);
    W.errors[0] = part(&n, pairs * sizeof **W.errors), W.pairs[0] = part(&n, 4 * (pairs + 2));
    is_source = part(&n, cells), painted = part(&n, cells);
    start_cells = part(&n, 4 * cells), keys = part(&n, 8 * cells);
    page.ground = part(&n, cells), page.levels = part(&n, cells);
    page.brush = part(&n, 4 * cells), page.traffic = part(&n, 4 * cells);
    page.cells = part(&n, 4 * most), page.before = part(&n, 4 * most);
    page.before2 = part(&n, 4 * most), page.states = part(&n, 2 * most);
    page.headings = part(&n, most), page.looks = part(&n, most);
    frame.known = part(&n, C.states), frame.ahead = part(&n, most);
    frame.rows = part(&n, 2 * most), frame.sent_ground = part(&n, cells);
    frame.numbers = part(&n, 4 * most), frame.sent_numbers = part(&n, 4 * most);
    frame.sent_trail = part(&n, 4 * cells), frame.updates = part(&n, 4 * pairs);
    frame.before = part(&n, 4 * pairs), frame.sent_q = part(&n, 4 * pairs);
    frame.bytes = part(&n, 24 * most + 13 * cells + 12 * pairs + 120000);
    return n;
}

/* Make an empty world of these ranges, with room for some ants, and forget the one before. Return 0
 * if out of memory. The page then writes rocks, food and the queen into the ground. */
EXPORT int lay_out(int x, int y, int z, int ants, int some_rules, int learner)
{
    static const int bits[] = {0, SARSA, FROZEN};
    G = grid_of(x, y, z), most = ants, rules = some_rules | bits[learner];
    free(memory), memory = NULL;
    C = (Colony){.size = G.size, .evaporates = 1};
    C.states = rules & QUEUES ? 686 : rules & SEES_ANTS ? 432 : 128;
    W = (Work){0};
    static int32_t steps[8];
    write_steps(&G, steps), C.steps = steps;
    memory = calloc(share_memory(), 1);
    if (!memory)
        return 0;
    share_memory();
    for (int i = 0; i < G.size; i++)
        C.ground[i] = exists(&G, i) ? EMPTY : OBSTACLE;
    return 1;
}

/* The upper half of the digits of a number; the lower half is the rest. */
static double upper(double a) { return 134217729.0 * a - (134217729.0 * a - a); }

/* Powers in two floats each, because libraries differ in the last bit of theirs; see
 * `update_weights` in taichi_ants/learners/config.py. */
EXPORT void set_rate(double rate)
{
    float *weights = (float *)C.weights;
    double kept = 1.0 - (double)(float)rate, k = upper(kept), high = 1.0, low = 0.0;
    for (int n = 0; n <= most; n++) {
        weights[n] = (float)(1.0 - high);
        double product = high * kept, h = upper(high);
        double lost = h * k - product + h * (kept - k) + (high - h) * k + (high - h) * (kept - k);
        lost += low * kept;
        high = product + lost;
        low = product - high + lost;
    }
    weights[1] = (float)rate;
}

EXPORT void set_numbers(int level, int slope, double discount, double epsilon, int shaping,
                        int regrowth)
{
    const int32_t rewards[6] = {0, -1, shaping, 3, 10, 0};
    memcpy((int32_t *)C.rewards, rewards, sizeof rewards);
    C.level = level, C.slope = slope, C.fades_after = slope ? (level + slope - 1) / slope : 0;
    C.discount = (float)discount, C.explore_below = (uint64_t)(epsilon * 4294967296.0);
    C.regrowth = regrowth;
}

static void add_ant(int cell, int heading, uint64_t stream)
{
    int i = C.n++;
    W.ants[i] = (Ant){.random = stream, .cell = cell, .heading = (uint8_t)heading};
    page.cells[i] = page.before[i] = page.before2[i] = cell;
    C.ground[cell] = OBSTACLE | 1 << ANT_SHIFT;
}

static void add_source(int cell)
{
    if (!is_source[cell])
        C.source_at[C.sources++] = cell;
    is_source[cell] = 1, C.taken[cell] = -1;
}

static void remove_source(int cell)
{
    for (int k = 0; is_source[cell] && k < C.sources; k++)
        if (C.source_at[k] == cell)
            C.source_at[k] = C.source_at[--C.sources], is_source[cell] = 0;
}

/* Sort cells by distance from the queen; keys by the seed break ties. */
static void order_start_cells(void)
{
    static int begins[FARTHEST + 1], ends[FARTHEST + 1];
    memset(begins, 0, sizeof begins);
    for (int i = 0; i < G.size; i++)
        if (exists(&G, i)) {
            begins[apart(&G, i, queen) + 1]++;
            keys[i] = stream_of(seed, STREAM_START_CELL, rank_of(&G, i));
        }
    for (int far = 1; far <= FARTHEST; far++)
        begins[far] += begins[far - 1];
    n_start_cells = begins[FARTHEST];
    memcpy(ends, begins, sizeof ends);
    for (int i = 0; i < G.size; i++)
        if (exists(&G, i)) {
            int far = apart(&G, i, queen), k = ends[far]++;
            for (; k > begins[far] && keys[start_cells[k - 1]] > keys[i]; k--)
                start_cells[k] = start_cells[k - 1];
            start_cells[k] = i;
        }
}

/* Write what a frame shows of the cells. */
EXPORT void pack_cells(void)
{
    for (int i = 0; i < G.size; i++) {
        int level = C.trail[i] - tick;
        page.levels[i] = level <= 0 ? 0 : level >= C.level ? 255 : 1 + level * 254 / C.level;
        page.ground[i] = C.ground[i] & 15;
    }
}

/* Write what a frame shows of the ants. */
static void pack_ants(void)
{
    for (int i = 0; i < C.n; i++) {
        const Ant *ant = W.ants + i;
        page.headings[i] = ant->heading;
        page.looks[i] = ant->carries | ant->event << 1 | ant->action << 4;
        page.states[i] = ant->state;
    }
}

/* Let ants observe anew after an intervention. */
static void look(void)
{
    look_around(&C, &W, rules, tick);
    pack_ants();
}

/* Set the table to the values that the page has written; FROZEN ants act by it. */
EXPORT void read_values(void) { note_best(&C, &W); }

static void begin_frames(void);

/* Start: `first` is the first value of all actions in all states. */
EXPORT void begin(uint32_t low, uint32_t high, int n, float first)
{
    seed = (uint64_t)high << 32 | low, tick = 0, next_number = n;
    for (int i = 0; i < G.size; i++) {
        if (C.ground[i] == QUEEN)
            queen = i;
        if (C.ground[i] == FOOD && C.regrowth >= 0)
            add_source(i);
    }
    write_closer(&G, C.steps, queen, (uint8_t *)C.closer);
    for (int i = 0; i < C.states * ROW; i++)
        C.q[i] = first;
    note_best(&C, &W);
    order_start_cells();
    for (int k = 0; k < n_start_cells && C.n < n; k++)
        if (C.ground[start_cells[k]] == EMPTY)
            add_ant(start_cells[k],
                    below(stream_of(seed, STREAM_START_HEADING, C.n) >> 32, N_HEADINGS),
                    stream_of(seed, STREAM_ANT, C.n));
    interventions = stream_of(seed, STREAM_INTERVENTION, 0);
    begin_frames();
    look();
}

EXPORT __attribute__((noinline)) void pass(int ticks)
{
    for (int end = tick + ticks; tick < end;) {
        for (int i = 0; i < C.n; i++)
            page.before2[i] = page.before[i], page.before[i] = page.cells[i];
        pass_ticks(&C, &W, rules, tick++, 1, 1);
        for (int i = 0; i < C.n; i++) {
            int cell = page.cells[i] = W.ants[i].cell;
            page.traffic[cell] += W.ants[i].carries;
        }
        for (int i = 0; tick % TICKS_TO_FADE == 0 && i < G.size; i++)
            page.traffic[i] *= 0.82f;
    }
    pack_ants();
}

/* ---- Interventions ------------------------------------------------------------------------- */

/* Move ants by this step from painted cells to others that are empty. */
static void move_by(int steps_q, int steps_r)
{
    for (int i = 0; i < C.n; i++) {
        int cell = W.ants[i].cell, q = cell % G.width + steps_q, r = cell / G.width + steps_r;
        int to = r * G.width + q;
        if (!painted[cell] || q < 0 || q >= G.width || r < 0 || r >= G.height)
            continue;
        if (painted[to] || C.ground[to] != EMPTY || !exists(&G, to))
            continue;
        C.ground[to] = C.ground[cell], C.ground[cell] = EMPTY;
        W.ants[i].cell = page.cells[i] = to;
    }
}

/* Move ants from painted cells: steps are tried in the order of distance, then of (x, y, z). */
static void move_aside(void)
{
    for (int far = 1; far <= REACH; far++)
        for (int x = 0; x <= far; x++)
            for (int y = 0; y <= far; y++)
                for (int z = 0; z <= far; z++)
                    if (smallest(x, y, z) == 0 && largest(x, y, z) == far)
                        move_by(x - z, y - z);
}

/* Make the n cells in `brush`, each once, EMPTY, OBSTACLE or FOOD. Ants move aside. */
EXPORT void put(int n, int what)
{
    for (int k = 0; k < n; k++)
        painted[page.brush[k]] = 1;
    if (what != EMPTY)
        move_aside();
    for (int k = 0; k < n; k++) {
        int cell = page.brush[k];
        painted[cell] = 0;
        if (!exists(&G, cell) || C.ground[cell] == QUEEN || C.ground[cell] >> ANT_SHIFT)
            continue;
        C.ground[cell] = what;
        if (what == OBSTACLE)
            C.trail[cell] = 0;
        if (what == FOOD && C.regrowth >= 0)
            add_source(cell);
        else if (what != FOOD)
            remove_source(cell);
    }
    look();
}

/* Set the scent of the n cells in `brush`; 0 removes it. */
EXPORT void lay_scent(int n, int level)
{
    for (int k = 0; k < n; k++)
        if (exists(&G, page.brush[k]) && C.ground[page.brush[k]] != OBSTACLE)
            C.trail[page.brush[k]] = level ? tick + level : 0;
    look();
}

/* The most ants that can live now. */
EXPORT int room(void)
{
    int n = C.n;
    for (int i = 0; i < G.size; i++)
        n += C.ground[i] == EMPTY && exists(&G, i);
    return n < most ? n : most;
}

/* Remove the ants with the highest numbers, or add newborn ones near the queen. */
EXPORT void set_ants(int n)
{
    while (C.n > n)
        C.ground[W.ants[--C.n].cell] = EMPTY;
    for (int k = 0; k < n_start_cells && C.n < n; k++)
        if (C.ground[start_cells[k]] == EMPTY) {
            interventions = advance(interventions);
            frame.numbers[C.n] = next_number;
            add_ant(start_cells[k], below(bits_of(interventions) >> 32, N_HEADINGS),
                    stream_of(seed, STREAM_BORN, next_number++));
        }
    look();
}

/* ---- What the page reads ------------------------------------------------------------------- */

/* The places of arrays, as `look` in engine.js numbers them. */
EXPORT void *array(int k)
{
    void *all[] = {C.ground, page.ground, page.levels, page.traffic, page.brush,
                   page.cells, page.before, page.before2, page.headings, page.looks,
                   page.states, C.q, page.mind, frame.bytes};
    return all[k];
}

EXPORT int ticks_passed(void) { return tick; }
EXPORT int ants(void) { return C.n; }
EXPORT int states(void) { return C.states; }
EXPORT double count(int k) { return (double)C.counts[k]; }

/* Write into `mind` the state of an ant with this place and load, and the bits of its best actions. */
EXPORT void see_from(int cell, int heading, int carries)
{
    see(&C, rules, cell, heading, carries, tick, &page.mind[0]);
    page.mind[1] = (int)W.greedy[page.mind[0]].actions;
}

/* Also write what an ant will do next, and whether it explores. */
EXPORT void read_mind(int i)
{
    const Ant *ant = W.ants + i;
    see_from(ant->cell, ant->heading, ant->carries);
    int drawn = rules & SARSA ? ant->want : 0;
    uint64_t bits = bits_of(drawn ? ant->random : advance(ant->random));
    int action = choose(W.greedy[page.mind[0]].actions, bits, C.explore_below);
    page.mind[2] = drawn ? drawn - 1 : action;
    page.mind[3] = bits >> 32 < C.explore_below;
}

static uint64_t hash;
static void stir(uint64_t word) { hash = bits_of(advance(hash ^ word)); }

/* The hash of the state; see `state_hash` in taichi_ants/lab.py. The page reads it in halves. */
EXPORT uint32_t hash_state(int half)
{
    if (half)
        return (uint32_t)(hash >> 32);
    hash = 0;
    stir(tick);
    for (int i = 0; i < C.n; i++) {
        const Ant *ant = W.ants + i;
        stir((uint64_t)ant->cell << 8 | ant->heading << 1 | ant->carries), stir(ant->random);
    }
    for (int i = 0; i < G.size; i++)
        stir((uint64_t)level_of(&C, i, tick) << 8 | (C.ground[i] & 15));
    for (int s = 0; s < C.states; s++)
        for (int a = 0; a < N_ACTIONS; a++) {
            uint32_t word;
            memcpy(&word, &C.q[s * ROW + a], 4);
            stir(word);
        }
    return (uint32_t)hash;
}

#include "frames.c"
