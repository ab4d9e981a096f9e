/* The grid of taichi_ants/grid/hexgrid.py: cells of ranges X, Y, Z in rows, with a border around
 * them; and the purposes of random streams. */
#include <stddef.h>

enum { STREAM_ANT = 0, STREAM_START_CELL = 2, STREAM_START_HEADING = 3, STREAM_BORN = 4,
       STREAM_INTERVENTION = 9 };
enum { BORDER = 5 }; /* what lies outside the world: rock */

typedef struct {
    int x, y, z, width, height, size;
} Grid;

static inline int largest(int a, int b, int c) { return a > b ? (a > c ? a : c) : (b > c ? b : c); }
static inline int smallest(int a, int b, int c) { return -largest(-a, -b, -c); }

static Grid grid_of(int x, int y, int z)
{
    int width = x + z + 1, height = y + z + 1;
    return (Grid){x, y, z, width, height, width * height};
}

static int q_of(const Grid *g, int cell) { return cell % g->width - g->z; }
static int r_of(const Grid *g, int cell) { return cell / g->width - g->z; }
static int cell_at(const Grid *g, int q, int r) { return (r + g->z) * g->width + q + g->z; }

static int exists(const Grid *g, int cell)
{
    int q = q_of(g, cell), r = r_of(g, cell), d = q - r;
    return d < g->x && d > -g->y && q > -g->z && q < g->x && r > -g->z && r < g->y;
}

static int apart(const Grid *g, int a, int b)
{
    int q = q_of(g, a) - q_of(g, b), r = r_of(g, a) - r_of(g, b);
    return largest(q, r, 0) - smallest(q, r, 0);
}

/* Write the steps to the neighbours at headings 5, 0, 1, 2, 3, 4, 5, 0. */
static void write_steps(const Grid *g, int32_t *steps)
{
    int around[6] = {1, 1 + g->width, g->width, -1, -1 - g->width, -g->width};
    for (int k = 0; k < 8; k++)
        steps[k] = around[(k + 5) % 6];
}

/* Write for each cell the neighbours that are nearer to a queen, bit h for heading h. */
static void write_closer(const Grid *g, const int32_t *steps, int queen, uint8_t *closer)
{
    for (int i = 0; i < g->size; i++) {
        closer[i] = 0;
        for (int h = 0; h < 6 && exists(g, i); h++)
            closer[i] |= (apart(g, i + steps[h + 1], queen) < apart(g, i, queen)) << h;
    }
}

/* The place of a cell in the order of (x, y, z). */
static int64_t rank_of(const Grid *g, int cell)
{
    int q = q_of(g, cell), r = r_of(g, cell), low = smallest(q, r, 0);
    int x = q - low, y = r - low, z = -low;
    if (x == 0)
        return (int64_t)y * g->z + z;
    return (int64_t)g->y * g->z + (int64_t)(x - 1) * (g->y + g->z - 1) + (y ? g->z + y - 1 : z);
}
