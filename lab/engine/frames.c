/* Frames for the viewer of the package: the bytes that taichi_ants/viewer/recorder.py makes, in the
 * format of taichi_ants/viewer/frames.py. page.c includes this file. */

enum { N_SECTIONS = 21, BEGIN = 8 * ((1 + N_SECTIONS + 1) / 2), POINT = 6, MOST_POINTS = 2000 };
enum { LOADED = 8, AHEAD = 8 };

static uint8_t *at;     /* where the next element is written */
static int wide;        /* whether cells need 32 bits */
static int n_points, n_new, every, seen;
static double points[MOST_POINTS + 1][POINT];

#define WRITE(type, value) (*(type *)at = (type)(value), at += sizeof(type))

static __attribute__((noinline)) void write_cell(int cell)
{
    if (wide)
        WRITE(uint32_t, cell);
    else
        WRITE(uint16_t, cell);
}

/* End a section, whose elements have `bytes` bytes each. */
static __attribute__((noinline)) void end_section(int *number, int bytes)
{
    static uint8_t *begin;
    begin = *number ? begin : frame.bytes + BEGIN;
    ((uint32_t *)frame.bytes)[1 + (*number)++] = (uint32_t)(at - begin) / bytes;
    while ((at - frame.bytes) & 7)
        *at++ = 0;
    begin = at;
}

static int ground_of(int cell) { return C.ground[cell] >> ANT_SHIFT ? EMPTY : C.ground[cell]; }

/* Forget the frames of another colony. */
static void begin_frames(void)
{
    wide = G.size >= 1 << 16;
    n_points = n_new = seen = 0, every = 1;
    frame.sent_n = -1;
    for (int i = 0; i < C.n; i++)
        frame.numbers[i] = i;
}

/* Add a point of the curves, which lose every other one when there are too many. */
EXPORT void note_point(double epsilon)
{
    if (seen++ % every == 0) {
        const double now[POINT] = {0, tick, (double)C.counts[1], (double)C.counts[0], epsilon, 0};
        memcpy(points[n_points++], now, sizeof now);
        n_new++;
    }
    if (n_points > MOST_POINTS) {
        for (int k = 1; 2 * k < n_points; k++)
            memcpy(points[k], points[2 * k], sizeof *points);
        n_points = (n_points + 1) / 2, every *= 2;
    }
}

/* Pass one tick, and keep what a frame with the actions of ants needs. */
EXPORT void pass_acting(void)
{
    memcpy(frame.before, C.q, 4 * C.states * ROW);
    for (int i = 0; i < C.n; i++) {
        frame.ahead[i] = rules & SARSA && W.ants[i].want;
        frame.rows[i] = W.ants[i].state;
    }
    pass(1);
}

/* The actions of all ants in the last tick: what they did and chose, rewards and TD errors. */
static void write_actions(int *section)
{
    static const uint8_t events[] = {1, 0, 3, 4, 5, 7}; /* see Event in task/constants.py */
    for (int i = 0; i < C.n; i++) {
        const Ant *ant = W.ants + i;
        int event = ant->event == FAILED ? (ant->action <= RIGHT ? 2 : 6) : events[ant->event];
        WRITE(uint8_t, ant->action + 16 * event);
        frame.updates[frame.rows[i] * ROW + ant->action]++;
    }
    end_section(section, 1);
    for (int i = 0; i < C.n; i++)
        WRITE(uint8_t, W.ants[i].action + AHEAD * frame.ahead[i]);
    end_section(section, 1);
    for (int i = 0; i < C.n; i++)
        WRITE(float, C.rewards[W.ants[i].event]);
    end_section(section, 4);
    for (int i = 0; i < C.n && !(rules & FROZEN); i++) {
        int pair = frame.rows[i] * ROW + W.ants[i].action;
        double weight = C.weights[frame.updates[pair]], moved = (double)C.q[pair] - frame.before[pair];
        WRITE(float, weight > 0 ? (float)(moved / weight) : __builtin_nanf(""));
    }
    end_section(section, 4);
    memset(frame.updates, 0, 4 * C.states * ROW);
}

/* Write the cells whose values have changed, or all that are not 0, then the values. */
#define WRITE_CHANGES(type, sent, value)                                                           \
    for (int i = 0; i < G.size; i++)                                                               \
        if ((whole ? 0 : sent[i]) != (value))                                                      \
            write_cell(i);                                                                         \
    end_section(&section, wide ? 4 : 2);                                                           \
    for (int i = 0; i < G.size; i++)                                                               \
        if ((whole ? 0 : sent[i]) != (value))                                                      \
            WRITE(type, value), sent[i] = (value);                                                 \
    end_section(&section, sizeof(type))

/* The places of action values that the page lacks, then the values; of states that ants have seen. */
static void write_values(int *section, int whole)
{
    for (int values = 0; values < 2; values++) {
        for (int s = 0; s < C.states; s++)
            for (int a = 0; frame.known[s] && a < N_ACTIONS; a++) {
                int pair = s * ROW + a, is_new = whole || frame.known[s] == 1;
                if (!is_new && frame.sent_q[pair] == C.q[pair])
                    continue;
                if (values)
                    WRITE(float, C.q[pair]);
                else
                    WRITE(double, s * N_ACTIONS + a);
            }
        end_section(section, values ? 4 : 8);
    }
    memcpy(frame.sent_q, C.q, 4 * C.states * ROW);
    for (int s = 0; s < C.states; s++)
        frame.known[s] = frame.known[s] ? 2 : 0; /* 1: new, 2: sent */
}

/* Write a frame into `frame.bytes`, and return its length: a `whole` one, or the changes since the last
 * one. If it has `acted`, `pass_acting` was called once since then. */
EXPORT int pack_frame(int whole, int acted, double epsilon, double learning_rate)
{
    int section = 0, n = C.n, is_same = !whole && frame.sent_n == n;
    double returns = (double)C.counts[0], delivered = (double)C.counts[1];
    const double clock[] = {0, tick, delivered, returns, epsilon, learning_rate, n, delivered,
                            tick, tick};
    at = frame.bytes + BEGIN;
    memcpy(at, clock, sizeof clock), at += sizeof clock;
    end_section(&section, 8);
    for (int i = 0; i < n; i++)
        is_same = is_same && frame.sent_numbers[i] == frame.numbers[i];
    for (int i = 0; i < n && !is_same; i++)
        WRITE(int32_t, frame.sent_numbers[i] = frame.numbers[i]);
    end_section(&section, 4);
    frame.sent_n = n;
    for (int i = 0; i < n; i++)
        write_cell(W.ants[i].cell);
    end_section(&section, wide ? 4 : 2);
    for (int i = 0; i < n; i++)
        WRITE(uint8_t, W.ants[i].heading + LOADED * W.ants[i].carries);
    end_section(&section, 1);
    end_section(&section, 1); /* groups */
    end_section(&section, 1); /* marks */
    for (int i = 0; i < n; i++) {
        int state = W.ants[i].state;
        frame.known[state] += !frame.known[state];
        WRITE(uint16_t, state);
    }
    end_section(&section, 2);
    if (acted)
        write_actions(&section);
    while (section < 11)
        end_section(&section, 1);
    WRITE_CHANGES(uint8_t, frame.sent_ground, ground_of(i));
    end_section(&section, 1); /* kinds of food, and their cells */
    end_section(&section, 1);
    if (whole || frame.sent_queen != queen)
        write_cell(queen);
    frame.sent_queen = queen;
    end_section(&section, wide ? 4 : 2);
    WRITE_CHANGES(int32_t, frame.sent_trail, C.trail[i]);
    write_values(&section, whole);
    int first = whole ? 0 : n_points - n_new;
    memcpy(at, points[first], (n_points - first) * sizeof *points);
    at += (n_points - first) * sizeof *points;
    end_section(&section, 8);
    n_new = whole ? n_new : 0;
    *(uint32_t *)frame.bytes = (uint32_t)(at - frame.bytes);
    return (int)(at - frame.bytes);
}
