/* A system clock that is set while a process runs, for that process alone.

   Built and preloaded by set_clock.py. The file named in TWBR_CLOCK_OFFSET holds the nanoseconds
   that are added to CLOCK_REALTIME. A wait on that clock ends when the clock as set has reached
   its end, as the kernel does it. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define SLICE 5000000LL        /* how often a wait looks at the offset [ns] */
#define OLDEST_DATE 1000000000 /* earlier seconds are of the steady clock */

static const volatile int64_t none = 0;
static const volatile int64_t *offset = &none;
static int (*real_gettime)(clockid_t, struct timespec *);
static int (*real_wait)(pthread_cond_t *, pthread_mutex_t *, const struct timespec *);
static int (*real_clockwait)(pthread_cond_t *, pthread_mutex_t *, clockid_t,
                             const struct timespec *);

static void *versioned(const char *name)
{
    void *found = dlvsym(RTLD_NEXT, name, "GLIBC_2.3.2"); /* x86-64 has an older one, too */
    return found ? found : dlsym(RTLD_NEXT, name);
}

__attribute__((constructor)) static void begin(void)
{
    const char *path = getenv("TWBR_CLOCK_OFFSET");
    int file = path ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    real_gettime = dlsym(RTLD_NEXT, "clock_gettime");
    real_wait = versioned("pthread_cond_timedwait");
    real_clockwait = dlsym(RTLD_NEXT, "pthread_cond_clockwait");
    if (file >= 0) {
        void *page = mmap(NULL, sizeof(int64_t), PROT_READ, MAP_SHARED, file, 0);
        if (page != MAP_FAILED)
            offset = page;
        close(file);
    }
}

static int64_t nanoseconds(const struct timespec *time)
{
    return time->tv_sec * SECOND + time->tv_nsec;
}

static struct timespec timespec_of(int64_t time)
{
    return (struct timespec){time / SECOND, time % SECOND};
}

int clock_gettime(clockid_t clock, struct timespec *time)
{
    if (!real_gettime)
        begin();
    int status = real_gettime(clock, time);
    if (status == 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *time = timespec_of(nanoseconds(time) + *offset);
    return status;
}

int gettimeofday(struct timeval *time, void *zone)
{
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    *time = (struct timeval){now.tv_sec, now.tv_nsec / 1000};
    return 0;
}

time_t time(time_t *result)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (result)
        *result = now.tv_sec;
    return now.tv_sec;
}

/* Wait until the clock as set reaches `end`, in slices that see a change of the offset. */
static int wait_in_slices(pthread_cond_t *condition, pthread_mutex_t *mutex, int64_t end)
{
    for (;;) {
        struct timespec now;
        int64_t left, real;
        real_gettime(CLOCK_REALTIME, &now);
        real = nanoseconds(&now);
        left = end - (real + *offset);
        struct timespec until = timespec_of(real + (left < SLICE ? left : SLICE));
        int status = real_wait(condition, mutex, &until);
        if (status != ETIMEDOUT || left <= SLICE)
            return status;
    }
}

int pthread_cond_timedwait(pthread_cond_t *condition, pthread_mutex_t *mutex,
                           const struct timespec *end)
{
    if (end->tv_sec < OLDEST_DATE)
        return real_wait(condition, mutex, end);
    return wait_in_slices(condition, mutex, nanoseconds(end));
}

int pthread_cond_clockwait(pthread_cond_t *condition, pthread_mutex_t *mutex, clockid_t clock,
                           const struct timespec *end)
{
    if (clock != CLOCK_REALTIME)
        return real_clockwait(condition, mutex, clock, end);
    return wait_in_slices(condition, mutex, nanoseconds(end));
}
