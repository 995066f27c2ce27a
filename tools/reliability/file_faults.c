/* Files that cannot be written, and a process that is killed between two steps of writing.

   Built and preloaded by file_faults.py, which sets `folder` and calls `arm` in the process. Only
   what happens below the folder counts. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

enum stage { OPEN, WRITE, FSYNC, RENAME, CLOSE, REMOVE, STAGES };
#define DESCRIPTORS 1024

static char folder[4096];
static int wanted = -1;    /* stage that fails; STAGES for a kill at any of them */
static long left = 0;      /* calls until then */
static int failure = 0;    /* error number */
static int failed = 0;     /* it has failed: a full disk stays full */
static long counts[STAGES];
static char dirty[DESCRIPTORS]; /* written to and not flushed */

void twbr_arm(const char *where, int stage, long calls, int error)
{
    snprintf(folder, sizeof folder, "%s", where);
    wanted = stage, left = calls, failure = error, failed = 0;
    memset(counts, 0, sizeof counts);
}

long twbr_count(int stage) { return counts[stage]; }

static int below(const char *path) { return folder[0] && strstr(path, folder) == path; }

static int is_below(int descriptor)
{
    char link[64], path[4096];
    if (!folder[0])
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0)
        return 0;
    path[length] = 0;
    return below(path);
}

/* Return whether this call fails; do not return where the process is killed at it. */
static int hit(enum stage stage)
{
    counts[stage]++;
    if (wanted == STAGES && --left == 0)
        kill(getpid(), SIGKILL);
    if (failed && (stage == OPEN || stage == WRITE)) {
        errno = failure;
        return 1;
    }
    if ((int)stage == wanted && --left == 0) {
        failed = 1;
        errno = failure;
        return 1;
    }
    return 0;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define MODE(flags) \
    mode_t mode = 0; \
    if ((flags) & O_CREAT) { \
        va_list rest; \
        va_start(rest, flags); \
        mode = va_arg(rest, mode_t); \
        va_end(rest); \
    }
#define REFUSED(path, flags) (((flags) & O_CREAT) && below(path) && hit(OPEN))

int open(const char *path, int flags, ...)
{
    MODE(flags)
    return REFUSED(path, flags) ? -1 : REAL(open)(path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    MODE(flags)
    return REFUSED(path, flags) ? -1 : REAL(open64)(path, flags, mode);
}

int openat(int at, const char *path, int flags, ...)
{
    MODE(flags)
    return REFUSED(path, flags) ? -1 : REAL(openat)(at, path, flags, mode);
}

int openat64(int at, const char *path, int flags, ...)
{
    MODE(flags)
    return REFUSED(path, flags) ? -1 : REAL(openat64)(at, path, flags, mode);
}

int mkdir(const char *path, mode_t mode)
{
    return below(path) && hit(OPEN) ? -1 : REAL(mkdir)(path, mode);
}

static int unwritable(int descriptor)
{
    if (!is_below(descriptor))
        return 0;
    if (descriptor < DESCRIPTORS)
        dirty[descriptor] = 1;
    return hit(WRITE);
}

ssize_t write(int descriptor, const void *data, size_t size)
{
    return unwritable(descriptor) ? -1 : REAL(write)(descriptor, data, size);
}

ssize_t writev(int descriptor, const struct iovec *parts, int count)
{
    return unwritable(descriptor) ? -1 : REAL(writev)(descriptor, parts, count);
}

ssize_t pwrite64(int descriptor, const void *data, size_t size, off64_t at)
{
    return unwritable(descriptor) ? -1 : REAL(pwrite64)(descriptor, data, size, at);
}

static int unflushed(int descriptor)
{
    if (!is_below(descriptor))
        return 0;
    if (hit(FSYNC))
        return 1;
    if (descriptor < DESCRIPTORS)
        dirty[descriptor] = 0;
    return 0;
}

int fsync(int descriptor) { return unflushed(descriptor) ? -1 : REAL(fsync)(descriptor); }

int fdatasync(int descriptor)
{
    return unflushed(descriptor) ? -1 : REAL(fdatasync)(descriptor);
}

int rename(const char *from, const char *to)
{
    return below(to) && hit(RENAME) ? -1 : REAL(rename)(from, to);
}

int renameat2(int at, const char *from, int to_at, const char *to, unsigned flags)
{
    return below(to) && hit(RENAME) ? -1 : REAL(renameat2)(at, from, to_at, to, flags);
}

/* A close that fails closes nevertheless: what was written did not arrive. */
int close(int descriptor)
{
    int fails = descriptor >= 0 && descriptor < DESCRIPTORS && dirty[descriptor] &&
                is_below(descriptor) && hit(CLOSE);
    int error = errno;
    if (descriptor >= 0 && descriptor < DESCRIPTORS)
        dirty[descriptor] = 0;
    int result = REAL(close)(descriptor);
    if (fails)
        errno = error;
    return fails ? -1 : result;
}

int unlink(const char *path)
{
    if (below(path))
        hit(REMOVE);
    return REAL(unlink)(path);
}

int rmdir(const char *path)
{
    if (below(path))
        hit(REMOVE);
    return REAL(rmdir)(path);
}
