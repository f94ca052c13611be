/* Seconds that libtiff takes to decode, and to encode, every page of a
 * Group 4 stack in memory, each page the median of five.
 *
 *   cc -O2 benches/libtiff.c -ltiff -o libtiff && ./libtiff blade.tif */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <tiffio.h>

enum { ROUNDS = 5 };

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + now.tv_nsec * 1e-9;
}

static int by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A file that forgets what is written to it. */
static uint64_t at, end;
static tmsize_t no_read(thandle_t h, void *p, tmsize_t n) { (void)h, (void)p, (void)n; return 0; }
static tmsize_t sink(thandle_t h, void *p, tmsize_t n) {
    (void)h, (void)p;
    at += n;
    end = at > end ? at : end;
    return n;
}
static toff_t seek(thandle_t h, toff_t to, int whence) {
    (void)h;
    return at = to + (whence == SEEK_CUR ? at : whence == SEEK_END ? end : 0);
}
static int no_close(thandle_t h) { (void)h; return 0; }
static toff_t size(thandle_t h) { (void)h; return end; }

static double median(double *five) {
    qsort(five, ROUNDS, sizeof *five, by_size);
    return five[ROUNDS / 2];
}

static TIFF *open_sink(uint32_t width, uint32_t height) {
    at = end = 0;
    TIFF *out = TIFFClientOpen("sink", "w", 0, no_read, sink, seek, no_close, size, 0, 0);
    TIFFSetField(out, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(out, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(out, TIFFTAG_ROWSPERSTRIP, height);
    TIFFSetField(out, TIFFTAG_BITSPERSAMPLE, 1);
    TIFFSetField(out, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(out, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(out, TIFFTAG_COMPRESSION, COMPRESSION_CCITTFAX4);
    return out;
}

int main(int argc, char **argv) {
    if (argc != 2) return fprintf(stderr, "usage: libtiff STACK\n"), 2;
    TIFF *in = TIFFOpen(argv[1], "r");
    if (!in) return 1;
    uint32_t width, height;
    TIFFGetField(in, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(in, TIFFTAG_IMAGELENGTH, &height);
    tmsize_t bytes = TIFFStripSize(in);
    void *pixels = malloc(bytes);
    double decode = 0, encode = 0, five[ROUNDS];
    do {
        for (int round = 0; round < ROUNDS; round++) {
            double start = seconds();
            if (TIFFReadEncodedStrip(in, 0, pixels, bytes) != bytes) return 1;
            five[round] = seconds() - start;
        }
        decode += median(five);
        for (int round = 0; round < ROUNDS; round++) {
            TIFF *out = open_sink(width, height);
            double start = seconds();
            if (TIFFWriteEncodedStrip(out, 0, pixels, bytes) < 0) return 1;
            five[round] = seconds() - start;
            TIFFClose(out);
        }
        encode += median(five);
    } while (TIFFReadDirectory(in));
    free(pixels);
    TIFFClose(in);
    printf("decode %f\nencode %f\n", decode, encode);
    return 0;
}
