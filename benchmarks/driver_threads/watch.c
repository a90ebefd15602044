/* Preloaded before Mesa: sees whether llvmpipe frees a fence whose lock a thread of it holds.
 *
 * A thread of the rasterizer counts a fence up, wakes who waits, and gives the fence's lock back.
 * The thread that draws may see the count before the lock is given back, and free the fence. What
 * reuses that memory is then overwritten. HELD_US holds a thread up before it gives the lock back,
 * as another process does that takes its core; AFTER_US holds it so long after the fence was
 * freed; EVERY: each so many-th signal is held. KEEP=1 leaves out the free() of a fence in use.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#define THREADS 64
/* struct lp_fence of Mesa 22.3: two words, the lock, the condition. */
#define LOCK_OFFSET 8
#define CONDITION_OFFSET (LOCK_OFFSET + sizeof(pthread_mutex_t))

extern void __libc_free(void *memory);

static int (*broadcast)(pthread_cond_t *);
static int (*unlock)(pthread_mutex_t *);
static long held_us, after_us, every, keep;
static long signals, freed_in_use;
static int threads;
static __thread int thread = -2; /* -1: none of the rasterizer */
/* The fence that each thread signals, and the one that it signalled last until that is freed. */
static uintptr_t volatile in_use[THREADS], last[THREADS];

static long number(const char *name, long otherwise)
{
    const char *text = getenv(name);
    return text ? atol(text) : otherwise;
}

__attribute__((constructor)) static void start(void)
{
    broadcast = dlvsym(RTLD_NEXT, "pthread_cond_broadcast", "GLIBC_2.3.2");
    unlock = dlvsym(RTLD_NEXT, "pthread_mutex_unlock", "GLIBC_2.2.5");
    held_us = number("HELD_US", 0);
    after_us = number("AFTER_US", 0);
    every = number("EVERY", 1);
    keep = number("KEEP", 0);
}

__attribute__((destructor)) static void end(void)
{
    if (signals)
        fprintf(stderr, "fences signalled %ld, freed in use %ld\n", signals, freed_in_use);
}

static int rasterizer_thread(void)
{
    if (thread == -2) {
        char name[17] = "";
        prctl(PR_GET_NAME, name);
        thread = strncmp(name, "llvmpipe-", 9) ? -1 : __sync_fetch_and_add(&threads, 1) % THREADS;
    }
    return thread;
}

static int64_t now_us(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * INT64_C(1000000) + time.tv_nsec / 1000;
}

int pthread_cond_broadcast(pthread_cond_t *condition)
{
    int i = rasterizer_thread();
    if (i >= 0) {
        in_use[i] = last[i] = (uintptr_t)condition - CONDITION_OFFSET;
        if (__sync_add_and_fetch(&signals, 1) % every == 0 && held_us) {
            int64_t until = now_us() + held_us;
            while (last[i] && now_us() < until)
                usleep(50);
            if (!last[i])
                usleep(after_us);
        }
    }
    return broadcast(condition);
}

int pthread_mutex_unlock(pthread_mutex_t *lock)
{
    int result = unlock(lock);
    if (thread >= 0)
        in_use[thread] = 0;
    return result;
}

void free(void *memory)
{
    int used = 0;
    for (int i = 0; memory && i < threads && i < THREADS; i++) {
        pthread_mutex_t *lock = (pthread_mutex_t *)((char *)memory + LOCK_OFFSET);
        if (last[i] != (uintptr_t)memory)
            continue;
        /* It may have been given back, and only the call has not returned. */
        used |= in_use[i] == (uintptr_t)memory && lock->__data.__lock;
        last[i] = 0;
    }
    if (used && __sync_add_and_fetch(&freed_in_use, 1) == 1)
        fprintf(stderr, "first fence freed in use\n");
    if (!(used && keep))
        __libc_free(memory);
}
