/* TalkItOut in a room of 8 x 8 with everything hard-wired: what an engine that knows one scenario only can reach.

   Left out beside the scenario: rooms of other sizes, histories longer than 64 words, layouts, counters, snapshots,
   checks of the actions. An episode that has ended is reset by the next step. With AVX-512 VBMI a board is four planes of
   64 bytes, each a register, and the picture is four byte permutations; elsewhere, or with -DPORTABLE, it is a gather. */

#include <stdint.h>
#include <string.h>

#if defined(__AVX512VBMI__) && !defined(PORTABLE)
#include <immintrin.h>
#define PLANES 1
#else
#define PLANES 0
#endif

enum { SIDE = 8, CELLS = 64, VIEW = 7, PICTURE = VIEW * VIEW, OWN_PLACE = 27, WORDS = 64, HORIZON = 100 };
enum { DOORS = 4, NPCS = 3, COLORS = 6, WIZARD = 0, HONEST = 1, LIAR = 2 };
enum { FORWARD = 2, TOGGLE = 5, DONE = 6, NOUNS = 16 };
enum { WHERE_IS_THE_EXIT = 1, OPEN_SESAME = 1 * NOUNS, HOW_ARE_YOU = 3 * NOUNS + 3 };
enum { PAD, GANDALF, JOHN, JACK, I, AM, FINE, ASK, GO, TO, THE, DOOR, RED };

/* A cell is kind, color, status and direction, a byte each. */
static const uint32_t EMPTY = 1, WALL = 2 | 5 << 8, OPEN_DOOR = 4, CLOSED_DOOR = 4 | 1 << 16, NPC = 11 | 1u << 24;
static const int STEP[4] = {1, SIDE, -1, -SIDE}; /* right, down, left, up */
static const uint64_t FLOOR = 0x007E7E7E7E7E7E00ULL;

/* What is drawn at a reset. Cells are numbered row by row. */
typedef struct {
    int32_t agent, facing, door[DOORS], door_color[DOORS], exit, npc[NPCS], npc_color[NPCS], honest_is_jack;
} Room;

typedef struct {
#if PLANES
    uint8_t board[4][CELLS];
#else
    uint32_t board[CELLS];
#endif
    uint64_t solid, random;
    uint8_t agent, facing, t, ended, exit, words, acquainted, honest_is_jack;
    uint8_t door[DOORS], door_color[DOORS], npc[NPCS];
} __attribute__((aligned(64))) Env;

/* For each pose and place in the picture the cell seen; what lies outside is a wall, as cell 0 is. */
static uint8_t VIEWS[CELLS * 4][64] __attribute__((aligned(64)));

static uint64_t draw(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15ULL);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
}

static int below(uint64_t *state, int n) { return (int)(((draw(state) >> 32) * (uint64_t)n) >> 32); }

static int pick(uint64_t *state, uint64_t set) {
    for (int skip = below(state, __builtin_popcountll(set)); skip; skip--) set &= set - 1;
    return __builtin_ctzll(set);
}

static void prepare_views(void) {
    for (int pose = 0; pose < CELLS * 4; pose++) {
        int x = pose / 4 % SIDE, y = pose / 4 / SIDE, d = pose % 4;
        int ahead_x = (1 - d) * (1 - d % 2), ahead_y = (2 - d) * (d % 2);
        for (int cell = 0; cell < PICTURE; cell++) {
            int ahead = VIEW - 1 - cell % VIEW, right = cell / VIEW - VIEW / 2;
            int sx = x + ahead * ahead_x - right * ahead_y, sy = y + ahead * ahead_y + right * ahead_x;
            int inside = sx >= 0 && sx < SIDE && sy >= 0 && sy < SIDE;
#if PLANES /* in the order in which unpacking puts them right */
            int place = (cell / 4 % 4) * 16 + (cell / 16) * 4 + cell % 4;
#else
            int place = cell;
#endif
            VIEWS[pose][place] = (uint8_t)(inside ? sy * SIDE + sx : 0);
        }
    }
}

static void set_cell(Env *e, int cell, uint32_t look) {
#if PLANES
    for (int plane = 0; plane < 4; plane++) e->board[plane][cell] = (uint8_t)(look >> 8 * plane);
#else
    e->board[cell] = look;
#endif
}

static void enter(Env *e, const Room *room, int16_t *tokens) {
    for (int cell = 0; cell < CELLS; cell++) set_cell(e, cell, FLOOR >> cell & 1 ? EMPTY : WALL);
    e->solid = ~FLOOR;
    for (int i = 0; i < DOORS; i++) {
        e->door[i] = (uint8_t)room->door[i], e->door_color[i] = (uint8_t)room->door_color[i];
        set_cell(e, room->door[i], CLOSED_DOOR | (uint32_t)room->door_color[i] << 8);
    }
    for (int i = 0; i < NPCS; i++) {
        e->npc[i] = (uint8_t)room->npc[i];
        e->solid |= 1ULL << room->npc[i];
        set_cell(e, room->npc[i], NPC | (uint32_t)room->npc_color[i] << 8 | (uint32_t)(i != WIZARD) << 16);
    }
    e->agent = (uint8_t)room->agent, e->facing = (uint8_t)room->facing, e->exit = (uint8_t)room->exit;
    e->honest_is_jack = (uint8_t)room->honest_is_jack;
    e->t = e->ended = e->words = e->acquainted = 0;
    memset(tokens, 0, WORDS * sizeof *tokens);
}

static void draw_room(uint64_t *random, Room *room) {
    uint64_t fronts = 0, free = FLOOR, colors = (1 << COLORS) - 1;
    for (int i = 0; i < DOORS; i++) { /* top, bottom, left, right; two cells from the corners */
        int along = 2 + below(random, 4), across = i % 2 ? SIDE - 1 : 0, inside = i % 2 ? SIDE - 2 : 1;
        room->door[i] = i < 2 ? across * SIDE + along : along * SIDE + across;
        fronts |= 1ULL << (i < 2 ? inside * SIDE + along : along * SIDE + inside);
        room->door_color[i] = pick(random, colors);
        colors &= ~(1ULL << room->door_color[i]);
    }
    room->exit = below(random, DOORS);
    for (int i = 0; i < NPCS; i++) {
        room->npc[i] = pick(random, free & ~fronts);
        free &= ~(1ULL << room->npc[i]);
        uint64_t others = (1 << COLORS) - 1;
        if (i == LIAR) others &= ~(1ULL << room->npc_color[HONEST]);
        room->npc_color[i] = pick(random, others);
    }
    room->agent = pick(random, free);
    room->facing = below(random, 4);
    room->honest_is_jack = below(random, 2);
}

static int next_to(int a, int b) {
    int dx = (a & 7) - (b & 7), dy = (a >> 3) - (b >> 3);
    return dx * dx + dy * dy == 1;
}

static void hear(Env *e, int16_t *tokens, const int16_t *line, int count) {
    if (e->words + count > WORDS) { /* the oldest words make room */
        int gone = e->words + count - WORDS;
        memmove(tokens, tokens + gone, (size_t)(e->words - gone) * sizeof *tokens);
        e->words -= (uint8_t)gone;
    }
    memcpy(tokens + e->words, line, (size_t)count * sizeof *tokens);
    e->words += (uint8_t)count;
}

static __attribute__((noinline)) void listen(Env *e, int16_t *tokens, int utterance) {
    for (int i = 0; i < NPCS; i++) {
        if (!next_to(e->agent, e->npc[i])) continue;
        int jack = (i == LIAR) ^ e->honest_is_jack;
        int16_t name = (int16_t)(i == WIZARD ? GANDALF : jack ? JACK : JOHN);
        if (utterance == HOW_ARE_YOU && !(e->acquainted >> i & 1)) {
            e->acquainted |= (uint8_t)(1 << i);
            hear(e, tokens, (int16_t[]){name, I, AM, FINE}, 4);
        } else if (utterance == WHERE_IS_THE_EXIT && e->acquainted >> i & 1) {
            if (i == WIZARD) {
                hear(e, tokens, (int16_t[]){name, ASK, (int16_t)(e->honest_is_jack ? JACK : JOHN)}, 3);
            } else {
                int door = i == HONEST ? e->exit : pick(&e->random, 15 & ~(1ULL << e->exit));
                hear(e, tokens, (int16_t[]){name, GO, TO, THE, (int16_t)(RED + e->door_color[door]), DOOR}, 6);
            }
        }
    }
}

static void open_door(Env *e, int cell) {
    for (int i = 0; i < DOORS; i++) {
        if (e->door[i] == cell) set_cell(e, cell, OPEN_DOOR | (uint32_t)e->door_color[i] << 8);
    }
}

static inline void look(const Env *e, uint8_t *image) {
    const uint8_t *cells = VIEWS[e->agent * 4 + e->facing];
#if PLANES
    __m512i at = _mm512_load_si512(cells);
    __m512i a = _mm512_permutexvar_epi8(at, _mm512_load_si512(e->board[0]));
    __m512i b = _mm512_permutexvar_epi8(at, _mm512_load_si512(e->board[1]));
    __m512i c = _mm512_permutexvar_epi8(at, _mm512_load_si512(e->board[2]));
    __m512i d = _mm512_permutexvar_epi8(at, _mm512_load_si512(e->board[3]));
    __m512i low1 = _mm512_unpacklo_epi8(a, b), low2 = _mm512_unpacklo_epi8(c, d);
    __m512i high1 = _mm512_unpackhi_epi8(a, b), high2 = _mm512_unpackhi_epi8(c, d);
    _mm512_storeu_si512(image, _mm512_unpacklo_epi16(low1, low2));
    _mm512_storeu_si512(image + 64, _mm512_mask_set1_epi32(_mm512_unpackhi_epi16(low1, low2), 1 << (OWN_PLACE - 16), EMPTY));
    _mm512_storeu_si512(image + 128, _mm512_unpacklo_epi16(high1, high2));
    int last = _mm_cvtsi128_si32(_mm512_castsi512_si128(_mm512_unpackhi_epi16(high1, high2)));
    memcpy(image + 192, &last, 4);
#else
    for (int i = 0; i < PICTURE; i++) memcpy(image + 4 * i, &e->board[cells[i]], 4);
    memcpy(image + 4 * OWN_PLACE, &EMPTY, 4);
#endif
}

int64_t env_bytes(void) { return sizeof(Env); }

void start(int64_t count, Env *envs, uint64_t seed, uint8_t *image, int16_t *tokens) {
    prepare_views();
    for (int64_t i = 0; i < count; i++) {
        envs[i].random = seed + (uint64_t)i * 0xD1342543DE82EF95ULL;
        Room room;
        draw_room(&envs[i].random, &room);
        enter(&envs[i], &room, tokens + i * WORDS);
        look(&envs[i], image + i * PICTURE * 4);
    }
}

void enter_rooms(int64_t count, Env *envs, const Room *rooms, uint8_t *image, int16_t *tokens) {
    for (int64_t i = 0; i < count; i++) {
        enter(&envs[i], &rooms[i], tokens + i * WORDS);
        look(&envs[i], image + i * PICTURE * 4);
    }
}

int64_t step(int64_t count, Env *envs, const int64_t *actions, uint8_t *image, int16_t *tokens, double *reward,
             uint8_t *terminated, uint8_t *truncated) {
    int64_t endings = 0;
    for (int64_t i = 0; i < count; i++) {
        Env *e = &envs[i];
        const int64_t *action = actions + 4 * i;
        double earned = 0;
        int over = 0, late = 0;
        if (__builtin_expect(e->ended, 0)) {
            Room room;
            draw_room(&e->random, &room);
            enter(e, &room, tokens + i * WORDS);
        } else {
            int body = (int)action[0];
            e->facing = (uint8_t)((e->facing + (body == 1) - (body == 0)) & 3);
            int target = e->agent + (body == FORWARD ? STEP[e->facing] : 0);
            e->agent = e->solid >> target & 1 ? e->agent : (uint8_t)target;
            e->t++;
            int utterance = action[1] ? (int)(action[2] * NOUNS + action[3]) : -1;
            if (utterance == HOW_ARE_YOU || utterance == WHERE_IS_THE_EXIT) {
                listen(e, tokens + i * WORDS, utterance);
            } else if (utterance == OPEN_SESAME) {
                for (int door = 0; door < DOORS; door++) {
                    if (!next_to(e->agent, e->door[door])) continue;
                    over = 1;
                    if (door == e->exit) earned = 1 - 0.9 * e->t / HORIZON;
                }
            }
            if (body == TOGGLE || body == DONE) {
                over = 1;
                if (body == TOGGLE) open_door(e, e->agent + STEP[e->facing]);
            }
            late = !over && e->t == HORIZON;
            e->ended = (uint8_t)(over | late);
            endings += e->ended;
        }
        look(e, image + i * PICTURE * 4);
        reward[i] = earned;
        terminated[i] = (uint8_t)over;
        truncated[i] = (uint8_t)late;
    }
    return endings;
}
