/* For programs that are linked with musl: settings of their allocator, and on x86-64 copies of memory.
 *
 * Rows of runs are copied and compared a few words at a time. musl starts each copy by `rep movsq`,
 * whose start alone costs more than such a row, and compares byte by byte: `tile` took 1.4 times as
 * long. All loads of a short copy come before its stores, so memmove has the same path. */

#ifdef LAMP_MIMALLOC
void mi_option_set(int option, long value);

/* Before the first allocation. mimalloc keeps what is freed for a second, and has the system back 1 GiB
 * at once: commands took twice the memory that their layers need. The numbers are
 * mi_option_arena_eager_commit and mi_option_purge_delay of mimalloc.h. */
__attribute__((constructor(101))) static void keep_little(void) {
    mi_option_set(4, 0);
    mi_option_set(15, 0);
}
#endif

#ifdef __x86_64__
#include <emmintrin.h>
#include <stddef.h>
#include <stdint.h>

typedef uint64_t __attribute__((may_alias, aligned(1))) word64;
typedef uint32_t __attribute__((may_alias, aligned(1))) word32;
typedef uint16_t __attribute__((may_alias, aligned(1))) word16;

#define LOAD(from, k) _mm_loadu_si128((const __m128i *)(const void *)(from) + (k))
#define STORE(to, k, v) _mm_storeu_si128((__m128i *)(void *)(to) + (k), v)

/* At most 128 bytes: words from both ends, which may overlap. */
static inline void copy_short(unsigned char *to, const unsigned char *from, size_t n) {
    const unsigned char *from_end = from + n;
    unsigned char *to_end = to + n;
    if (n > 64) {
        __m128i a = LOAD(from, 0), b = LOAD(from, 1), c = LOAD(from, 2), d = LOAD(from, 3);
        __m128i e = LOAD(from_end, -4), f = LOAD(from_end, -3);
        __m128i g = LOAD(from_end, -2), h = LOAD(from_end, -1);
        STORE(to, 0, a), STORE(to, 1, b), STORE(to, 2, c), STORE(to, 3, d);
        STORE(to_end, -4, e), STORE(to_end, -3, f), STORE(to_end, -2, g), STORE(to_end, -1, h);
    } else if (n > 32) {
        __m128i a = LOAD(from, 0), b = LOAD(from, 1);
        __m128i c = LOAD(from_end, -2), d = LOAD(from_end, -1);
        STORE(to, 0, a), STORE(to, 1, b), STORE(to_end, -2, c), STORE(to_end, -1, d);
    } else if (n >= 16) {
        __m128i a = LOAD(from, 0), b = LOAD(from_end, -1);
        STORE(to, 0, a), STORE(to_end, -1, b);
    } else if (n >= 8) {
        uint64_t a = *(const word64 *)from, b = *(const word64 *)(from_end - 8);
        *(word64 *)to = a, *(word64 *)(to_end - 8) = b;
    } else if (n >= 4) {
        uint32_t a = *(const word32 *)from, b = *(const word32 *)(from_end - 4);
        *(word32 *)to = a, *(word32 *)(to_end - 4) = b;
    } else if (n >= 2) {
        uint16_t a = *(const word16 *)from, b = *(const word16 *)(from_end - 2);
        *(word16 *)to = a, *(word16 *)(to_end - 2) = b;
    } else if (n) {
        *to = *from;
    }
}

/* More than 128 bytes, from the first on. Long copies are the processor's own (ERMS). */
static inline void copy_up(unsigned char *to, const unsigned char *from, size_t n) {
    if (n >= 2048) {
        __asm__ volatile("rep movsb" : "+D"(to), "+S"(from), "+c"(n) : : "memory");
        return;
    }
    const unsigned char *from_end = from + n;
    unsigned char *to_end = to + n;
    /* The last words may be overwritten on the way if both places overlap. */
    __m128i w = LOAD(from_end, -4), x = LOAD(from_end, -3);
    __m128i y = LOAD(from_end, -2), z = LOAD(from_end, -1);
    for (; n > 64; n -= 64, to += 64, from += 64) {
        __m128i a = LOAD(from, 0), b = LOAD(from, 1), c = LOAD(from, 2), d = LOAD(from, 3);
        STORE(to, 0, a), STORE(to, 1, b), STORE(to, 2, c), STORE(to, 3, d);
    }
    STORE(to_end, -4, w), STORE(to_end, -3, x), STORE(to_end, -2, y), STORE(to_end, -1, z);
}

void *memcpy(void *restrict to, const void *restrict from, size_t n) {
    if (n <= 128)
        copy_short(to, from, n);
    else
        copy_up(to, from, n);
    return to;
}

void *memmove(void *to, const void *from, size_t n) {
    if (n <= 128) {
        copy_short(to, from, n);
    } else if ((uintptr_t)to - (uintptr_t)from >= n) {
        copy_up(to, from, n);
    } else {
        /* The destination starts within the source: from the last on. */
        unsigned char *to_end = (unsigned char *)to + n;
        const unsigned char *from_end = (const unsigned char *)from + n;
        __m128i w = LOAD(from, 0), x = LOAD(from, 1), y = LOAD(from, 2), z = LOAD(from, 3);
        for (; n > 64; n -= 64, to_end -= 64, from_end -= 64) {
            __m128i a = LOAD(from_end, -4), b = LOAD(from_end, -3);
            __m128i c = LOAD(from_end, -2), d = LOAD(from_end, -1);
            STORE(to_end, -4, a), STORE(to_end, -3, b), STORE(to_end, -2, c), STORE(to_end, -1, d);
        }
        STORE(to, 0, w), STORE(to, 1, x), STORE(to, 2, y), STORE(to, 3, z);
    }
    return to;
}

int memcmp(const void *one, const void *other, size_t n) {
    const unsigned char *a = one, *b = other;
    for (; n >= 16; n -= 16, a += 16, b += 16) {
        unsigned equal = (unsigned)_mm_movemask_epi8(_mm_cmpeq_epi8(LOAD(a, 0), LOAD(b, 0)));
        if (equal != 0xffff) {
            unsigned at = (unsigned)__builtin_ctz(~equal);
            return a[at] - b[at];
        }
    }
    for (; n >= 8; n -= 8, a += 8, b += 8) {
        uint64_t differ = *(const word64 *)a ^ *(const word64 *)b;
        if (differ) {
            unsigned at = (unsigned)__builtin_ctzll(differ) / 8;
            return a[at] - b[at];
        }
    }
    for (; n; n--, a++, b++)
        if (*a != *b)
            return *a - *b;
    return 0;
}

int bcmp(const void *one, const void *other, size_t n) {
    return memcmp(one, other, n);
}
#endif
