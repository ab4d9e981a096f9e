/* Common parts of all programs: actions, and random numbers (taichi_ants/grid/randomness.py). */
#include <stdint.h>

#define EXPORT __attribute__((visibility("default")))
#define INLINE static inline __attribute__((always_inline))

enum { LEFT, FORWARD, RIGHT, PICK_UP, GIVE, N_ACTIONS };
enum { SEES_EMPTY, SEES_OBSTACLE, SEES_CUE, SEES_GOAL, N_HEADINGS = 6 };

INLINE uint64_t advance(uint64_t state) { return state + 0x9E3779B97F4A7C15u; }

INLINE uint64_t bits_of(uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

INLINE uint64_t draw(uint64_t *state) { return bits_of(*state = advance(*state)); }

INLINE int below(uint64_t word, int n) { return (int)((word * (uint64_t)n) >> 32); }

/* The first state of a random stream. */
INLINE uint64_t stream_of(uint64_t seed, uint64_t purpose, uint64_t number)
{
    uint64_t of_seed = bits_of(advance(seed));
    return bits_of(advance(bits_of(advance(of_seed ^ purpose)) ^ number));
}

INLINE int turned(int heading, int action)
{
    static const uint8_t after[N_ACTIONS][8] = {
        {5, 0, 1, 2, 3, 4}, {0, 1, 2, 3, 4, 5}, {1, 2, 3, 4, 5, 0},
        {0, 1, 2, 3, 4, 5}, {0, 1, 2, 3, 4, 5}};
    return after[action][heading];
}
