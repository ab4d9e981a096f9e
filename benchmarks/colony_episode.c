/* An episode of colony.c, the colony of the lab, for colony_in_c.py.
 *
 * Large colonies are sorted by cell from time to time, so that neighbours in space are neighbours in
 * memory. The lab does not sort: the place of an ant is its number there.
 */
#include "colony.c"

enum { TICKS_BETWEEN_SORTS = 8, FEWEST_TO_SORT = 2048, CELLS_TOGETHER = 64 };

/* Store the ants in the order of groups of cells, by a counting sort of all threads. */
static void sort(const Colony *c, Ant *ants, Ant *spare, int *places, int threads)
{
    int groups = c->size / CELLS_TOGETHER + 1;
    memset(places, 0, groups * threads * sizeof *places);
#pragma omp parallel num_threads(threads)
    {
        int thread = omp_get_thread_num();
#pragma omp for schedule(static)
        for (int i = 0; i < c->n; i++)
            places[thread * groups + ants[i].cell / CELLS_TOGETHER]++;
#pragma omp single
        for (int group = 0, before = 0; group < groups; group++)
            for (int t = 0; t < threads; t++) {
                int here = places[t * groups + group];
                places[t * groups + group] = before;
                before += here;
            }
#pragma omp for schedule(static)
        for (int i = 0; i < c->n; i++)
            spare[places[thread * groups + ants[i].cell / CELLS_TOGETHER]++] = ants[i];
#pragma omp for schedule(static)
        for (int i = 0; i < c->n; i++)
            ants[i] = spare[i];
    }
}

/* Run an episode of some ticks, in which ants start on these cells without food. */
void run(Colony *c, const int32_t *cells, const uint8_t *headings, const uint64_t *random, int rules,
         int ticks, int threads)
{
    Work w = {0};
    size_t pairs = (size_t)c->states * ROW, groups = c->size / CELLS_TOGETHER + 1;
    uint8_t *wants = calloc(c->size + 2 * margin(c), 1);
    Ant *spare = malloc(c->n * sizeof *spare);
    int *places = malloc(groups * threads * sizeof *places);
    w.ants = calloc(c->n, sizeof *w.ants);
    w.wants = wants + margin(c);
    w.greedy = malloc(c->states * sizeof *w.greedy);
    for (int t = 0; t < threads; t++) {
        w.errors[t] = calloc(pairs + 64, sizeof **w.errors); /* no cache line is shared */
        w.pairs[t] = calloc(pairs + 64, sizeof **w.pairs);
    }
    for (int i = 0; i < c->n; i++)
        w.ants[i] = (Ant){.random = random[i], .cell = cells[i], .heading = headings[i]};
    note_best(c, &w);
    look_around(c, &w, rules, 0);
    int sorts = c->n >= FEWEST_TO_SORT, step = sorts ? TICKS_BETWEEN_SORTS : ticks;
    for (int tick = 0; tick < ticks; tick += step) {
        if (sorts)
            sort(c, w.ants, spare, places, threads);
        pass_ticks(c, &w, rules, tick, ticks - tick < step ? ticks - tick : step, threads);
    }
    for (int t = 0; t < threads; t++)
        free(w.errors[t]), free(w.pairs[t]);
    free(w.ants), free(spare), free(places), free(wants), free(w.greedy);
}
