/* Fails one call of the file system: LAMP_FAIL is the call, LAMP_FAIL_AT which of them, from 1. Only files
   that are written count. A file LAMP_FAIL_DONE says that it has failed. With LAMP_FAIL=store, nothing can
   be made in a folder lamp-store. */

#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

static atomic_long calls;
static atomic_bool written[1 << 16];

static int fails(const char *call) {
    const char *wanted = getenv("LAMP_FAIL");
    if (!wanted || strcmp(wanted, call) != 0) return 0;
    if (atomic_fetch_add(&calls, 1) + 1 != atol(getenv("LAMP_FAIL_AT"))) return 0;
    long done = syscall(SYS_openat, AT_FDCWD, getenv("LAMP_FAIL_DONE"), O_CREAT | O_WRONLY, 0600);
    syscall(SYS_close, done);
    return 1;
}

static int is_closed(const char *path) {
    const char *wanted = getenv("LAMP_FAIL");
    return wanted && strcmp(wanted, "store") == 0 && strstr(path, "lamp-store/");
}

static int is_file(int fd) {
    struct stat found;
    /* Temporary files without a name are no outputs. */
    return fstat(fd, &found) == 0 && S_ISREG(found.st_mode) && found.st_nlink > 0;
}

static int opened(int fd, int flags) {
    if (fd >= 0 && fd < 1 << 16) written[fd] = (flags & O_ACCMODE) != O_RDONLY;
    return fd;
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

#define OPEN(name)                                                            \
    int name(const char *path, int flags, ...) {                              \
        va_list rest;                                                         \
        va_start(rest, flags);                                                \
        mode_t mode = va_arg(rest, mode_t);                                   \
        va_end(rest);                                                         \
        if ((flags & O_CREAT) && is_closed(path)) return errno = EROFS, -1;   \
        if ((flags & O_CREAT) && fails("open")) return errno = EACCES, -1;    \
        return opened(NEXT(name)(path, flags, mode), flags);                  \
    }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                          \
    int name(int at, const char *path, int flags, ...) {                      \
        va_list rest;                                                         \
        va_start(rest, flags);                                                \
        mode_t mode = va_arg(rest, mode_t);                                   \
        va_end(rest);                                                         \
        if ((flags & O_CREAT) && is_closed(path)) return errno = EROFS, -1;   \
        if ((flags & O_CREAT) && fails("open")) return errno = EACCES, -1;    \
        return opened(NEXT(name)(at, path, flags, mode), flags);              \
    }
OPENAT(openat)
OPENAT(openat64)

ssize_t write(int fd, const void *bytes, size_t count) {
    if (is_file(fd)) {
        if (fails("write")) return errno = ENOSPC, -1;
        if (count > 1 && fails("short")) count /= 2;
    }
    return NEXT(write)(fd, bytes, count);
}

ssize_t writev(int fd, const struct iovec *parts, int count) {
    if (is_file(fd)) {
        if (fails("write")) return errno = ENOSPC, -1;
        if (count > 1 && fails("short")) count /= 2;
    }
    return NEXT(writev)(fd, parts, count);
}

int fsync(int fd) {
    if (fails("fsync")) return errno = EIO, -1;
    return NEXT(fsync)(fd);
}

int close(int fd) {
    int counts = fd >= 0 && fd < 1 << 16 && written[fd] && is_file(fd);
    if (counts) written[fd] = 0;
    int result = NEXT(close)(fd);
    if (counts && fails("close")) return errno = EIO, -1;
    return result;
}

int rename(const char *from, const char *to) {
    if (fails("rename")) return errno = EIO, -1;
    return NEXT(rename)(from, to);
}

int mkdir(const char *path, mode_t mode) {
    if (is_closed(path)) return errno = EROFS, -1;
    if (fails("mkdir")) return errno = ENOSPC, -1;
    return NEXT(mkdir)(path, mode);
}

struct dirent64 *readdir64(DIR *folder) {
    if (fails("readdir")) return errno = EIO, NULL;
    return NEXT(readdir64)(folder);
}
