/* Common parts of ant.c and ant_vector.c: the world, and a run.
 *
 * The world, rules, random numbers and arithmetic are those of the package (taichi_ants/task/rules,
 * taichi_ants/learners), so that results are equal to the bit if the compiler does not fuse
 * multiplications and additions (-ffp-contract=off).
 */
#include "common.h"

enum { Q_LEARNING, SARSA, DYNA_Q };
enum { N_STATES = 128, DEPOSIT = 250 };

/* Cells lie in flat arrays; a neighbour is a fixed step away. */
typedef struct {
    int32_t size;
    const uint8_t *ground;  /* the code of a cell: two bits for foragers, two for carriers */
    const int32_t *trail;   /* levels at the start of an episode */
    const uint8_t *closer;  /* bit h: the neighbour at heading h is nearer to the queen */
    const int32_t *offsets; /* steps to the neighbours at headings 5, 0, 1, 2, 3, 4, 5, 0 */
} World;

/* A run: one configuration with one seed. */
typedef struct {
    uint64_t random;
    double epsilon, decay, min_epsilon;
    float learning_rate, discount;
    int32_t cell, heading; /* the start of the ant */
} Run;

/* The common settings of all runs of a call, and their results. */
typedef struct {
    int32_t n, learner, planning_steps, delivery_truncates, episodes, max_steps, threads;
    float *q;         /* (n, 128, 5), the initial values */
    int32_t *returns; /* (n, episodes) */
    int32_t *steps;   /* (n, episodes) */
    int32_t *deliveries; /* (n, episodes), or NULL */
} Job;
