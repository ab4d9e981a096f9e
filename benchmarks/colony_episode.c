/* An episode of colony.c, the colony of the lab, for colony_in_c.py. */
#include "colony.c"

/* Run an episode of some ticks, in which ants start without food. */
void run(Colony *c, int rules, int ticks, int threads)
{
    Work w = {0};
    size_t pairs = (size_t)c->states * ROW, groups = c->size / CELLS_TOGETHER + 1;
    uint8_t *wants = calloc(c->size + 2 * margin(c), 1);
    w.ants = calloc(c->n, sizeof *w.ants);
    w.spare = malloc(c->n * sizeof *w.spare);
    w.places = malloc(groups * threads * sizeof *w.places);
    w.wants = wants + margin(c);
    w.greedy = malloc(c->states * sizeof *w.greedy);
    for (int t = 0; t < threads; t++) {
        w.errors[t] = calloc(pairs + 64, sizeof **w.errors); /* no cache line is shared */
        w.pairs[t] = calloc(pairs + 64, sizeof **w.pairs);
    }
    for (int i = 0; i < c->n; i++) {
        w.ants[i].random = c->random[i];
        w.ants[i].cell = c->cells[i];
        w.ants[i].heading = c->headings[i];
    }
    note_best(c, &w);
    look_around(c, &w, rules, 0);
    pass_ticks(c, &w, rules, 0, ticks, threads);
    for (int t = 0; t < threads; t++)
        free(w.errors[t]), free(w.pairs[t]);
    free(w.ants), free(w.spare), free(w.places), free(wants), free(w.greedy);
}
