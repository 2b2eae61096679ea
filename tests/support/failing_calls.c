/* A disk that fails: the N-th call of one kind on a path below FAIL_UNDER returns FAIL_ERRNO (all later ones too where
   FAIL_ON is set).  FAIL_CALL is one of open, write, close, fsync, rename, unlink, flock, mmap, ftruncate, fallocate. `failing_calls` counts them. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

long *failing_calls; /* of this process and of all that it begins */

__attribute__((constructor)) static void begin(void) {
    failing_calls = (long *)syscall(SYS_mmap, NULL, sizeof(long), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
}

static int below(const char *path) {
    const char *under = getenv("FAIL_UNDER");
    char whole[2 * PATH_MAX];
    if (!under || !path) return 0;
    if (path[0] != '/') {
        if (!getcwd(whole, PATH_MAX)) return 0;
        strcat(whole, "/");
        strncat(whole, path, PATH_MAX - 2);
        path = whole;
    }
    return strncmp(path, under, strlen(under)) == 0;
}

static int below_fd(int fd) {
    char link[64], path[PATH_MAX];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t size = readlink(link, path, sizeof path - 1);
    if (size < 0) return 0;
    path[size] = 0;
    return below(path);
}

static int fails(const char *call, int concerned) {
    const char *name = getenv("FAIL_CALL"), *nth = getenv("FAIL_NTH");
    if (!concerned || !name || strcmp(name, call)) return 0;
    long number = __sync_add_and_fetch(failing_calls, 1), wanted = nth ? atol(nth) : 0;
    if (!wanted || !(number == wanted || (getenv("FAIL_ON") && number > wanted))) return 0;
    errno = atoi(getenv("FAIL_ERRNO"));
    return 1;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))
#define OPENING(name)                                                                                              \
    int name(const char *path, int flags, ...) {                                                                   \
        va_list more; va_start(more, flags); mode_t mode = va_arg(more, mode_t); va_end(more);                     \
        return fails("open", below(path)) ? -1 : REAL(name)(path, flags, mode);                                    \
    }
#define ON_FD(type, name, call, parameters, arguments, fd, bad)                                                    \
    type name parameters { return fails(call, below_fd(fd)) ? bad : REAL(name) arguments; }
#define ON_PATH(name, call, parameters, arguments, path)                                                           \
    int name parameters { return fails(call, below(path)) ? -1 : REAL(name) arguments; }

OPENING(open)
OPENING(open64)
ON_FD(ssize_t, write, "write", (int fd, const void *from, size_t size), (fd, from, size), fd, -1)
ON_FD(ssize_t, pwrite, "write", (int fd, const void *from, size_t size, off_t at), (fd, from, size, at), fd, -1)
ON_FD(ssize_t, pwrite64, "write", (int fd, const void *from, size_t size, off64_t at), (fd, from, size, at), fd, -1)
ON_FD(int, fsync, "fsync", (int fd), (fd), fd, -1)
ON_FD(int, flock, "flock", (int fd, int how), (fd, how), fd, -1)
ON_FD(int, ftruncate, "ftruncate", (int fd, off_t size), (fd, size), fd, -1)
ON_FD(int, ftruncate64, "ftruncate", (int fd, off64_t size), (fd, size), fd, -1)
ON_FD(void *, mmap, "mmap", (void *at, size_t size, int how, int flags, int fd, off_t from),
      (at, size, how, flags, fd, from), fd, MAP_FAILED)
ON_FD(void *, mmap64, "mmap", (void *at, size_t size, int how, int flags, int fd, off64_t from),
      (at, size, how, flags, fd, from), fd, MAP_FAILED)
ON_PATH(rename, "rename", (const char *from, const char *to), (from, to), from)
ON_PATH(unlink, "unlink", (const char *path), (path), path)

int posix_fallocate64(int fd, off64_t from, off64_t size) {
    return fails("fallocate", below_fd(fd)) ? errno : REAL(posix_fallocate64)(fd, from, size);
}

int posix_fallocate(int fd, off_t from, off_t size) {
    return fails("fallocate", below_fd(fd)) ? errno : REAL(posix_fallocate)(fd, from, size);
}

int close(int fd) {
    if (!fails("close", below_fd(fd))) return REAL(close)(fd);
    int saved = errno; /* (as Linux does, the descriptor is released although the call fails) */
    REAL(close)(fd);
    errno = saved;
    return -1;
}
