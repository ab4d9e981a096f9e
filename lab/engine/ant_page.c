/* Lone ants for a page: training runs of ant.c, in the world of the paper. */
#include <stdint.h>

/* A step of the first run, in the order of NOTES in engine.js: the cell and heading after it, and
 * the value of the pair of observation and action after the ant has learned from it. */
typedef struct {
    int32_t episode, step, state, action, reward, next, terminated, cell, heading;
    float value;
} Note;

static Note *notes;
static int n_notes, most_notes;

#define NOTE(ant, ends, entry)                                                                   \
    if (n_notes < most_notes)                                                                    \
    notes[n_notes++] = (Note){(ant)->episode, (ant)->step, (ant)->state, (ant)->taken,           \
                              (ant)->reward, (ant)->next, (ends), (ant)->cell, (ant)->heading,   \
                              (entry)}
#define TOGETHER 4
#include "ant.c"
#include "grid.h"

static World world;
static Job job;
static Run *runs;
static char *memory;

/* Make the paper's world: queen, food, and a trail between them. */
static void make_world(Grid *g)
{
    static uint8_t ground[21 * 21], closer[21 * 21];
    static int32_t trail[21 * 21], steps[8];
    const int queen = cell_at(g, -9, 0), food = cell_at(g, 9, 0);
    for (int i = 0; i < g->size; i++)
        ground[i] = exists(g, i) ? 0 : BORDER;
    ground[queen] = 13, ground[food] = 7;
    for (int q = -8; q <= 8; q++)
        trail[cell_at(g, q, 0)] = 25;
    write_steps(g, steps);
    write_closer(g, steps, queen, closer);
    world = (World){g->size, ground, trail, closer, steps};
}

/* Make room for n runs of some episodes, and return the address of their seeds, (n) of 64 bits. */
EXPORT uint64_t *prepare(int n, int episodes)
{
    free(memory);
    job = (Job){.n = n, .episodes = episodes, .threads = 1};
    size_t table = sizeof(float) * N_STATES * N_ACTIONS, all = sizeof(int32_t) * n * episodes;
    memory = calloc(n * (sizeof(uint64_t) + sizeof(Run) + table) + 3 * all, 1);
    if (!memory)
        return NULL;
    runs = (Run *)(memory + n * sizeof(uint64_t));
    job.q = (float *)(runs + n);
    job.returns = (int32_t *)(job.q + (size_t)n * N_STATES * N_ACTIONS);
    job.steps = job.returns + (size_t)n * episodes;
    job.deliveries = job.steps + (size_t)n * episodes;
    return (uint64_t *)memory;
}

/* The address of the tables that runs begin with, (n, 128, 5). */
EXPORT float *tables(void) { return job.q; }

/* Make room for notes of so many steps, after `prepare`, which has freed those of the call before;
 * return their address. There must be one run. */
EXPORT Note *note_steps(int most)
{
    notes = malloc(most * sizeof(Note));
    n_notes = 0, most_notes = notes ? most : 0;
    return notes;
}

/* Train the runs that are prepared; return the address of their tables, then returns, steps and
 * deliveries; or NULL if out of memory. Each run draws from the stream of its seed, a purpose and a
 * number. */
EXPORT float *train_all(int learner, double rate, double discount, double epsilon, double decay,
                        int planning_steps, int truncates, int max_steps, int purpose, int number)
{
    Grid grid = grid_of(10, 10, 10);
    const uint64_t *seeds = (uint64_t *)memory;
    make_world(&grid);
    job.learner = learner, job.planning_steps = planning_steps;
    job.delivery_truncates = truncates, job.max_steps = max_steps;
    for (int i = 0; i < job.n; i++)
        runs[i] = (Run){.random = stream_of(seeds[i], purpose, number), .epsilon = epsilon,
                        .decay = decay, .min_epsilon = epsilon < 0.01 ? epsilon : 0.01,
                        .learning_rate = (float)rate, .discount = (float)discount,
                        .cell = cell_at(&grid, -8, 0), .heading = 0};
    return train(&world, &job, runs) ? job.q : NULL;
}
