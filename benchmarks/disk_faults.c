/* What a disk answers when it fails, below the file system: loaded before the C library.
 *
 * Nothing happens before rig_fault_arm: calls that write, synchronise, open, rename or make a folder
 * below one folder are counted from then on, and some of them fail.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static atomic_long calls;
static long first, last = -1;
static int failure;
static char folder[4096];
static size_t folder_length;

static ssize_t (*true_write)(int, const void *, size_t);
static ssize_t (*true_pwrite)(int, const void *, size_t, off_t);
static int (*true_fsync)(int);
static int (*true_fdatasync)(int);
static int (*true_rename)(const char *, const char *);
static int (*true_ftruncate)(int, off_t);
static int (*true_mkdir)(const char *, mode_t);
static int (*true_open)(const char *, int, ...);

static void *next(const char *name) { return dlsym(RTLD_NEXT, name); }

__attribute__((constructor)) static void prepare(void) {
    true_write = next("write");
    true_pwrite = next("pwrite64");
    true_fsync = next("fsync");
    true_fdatasync = next("fdatasync");
    true_rename = next("rename");
    true_ftruncate = next("ftruncate64");
    true_mkdir = next("mkdir");
    true_open = next("open64");
}

/* where: only files below it; which: the first call that fails, from 1, 0 for none; many: so many
 * fail from there on, 0 for all; what: the error, 0 for half a write that says so, and negative for
 * a signal that the program gets instead.
 */
void rig_fault_arm(const char *where, long which, long many, int what) {
    strncpy(folder, where, sizeof folder - 1);
    first = which;
    last = many > 0 ? which + many - 1 : -1;
    failure = what;
    atomic_store(&calls, 0);
    folder_length = strlen(folder);
}

long rig_fault_calls(void) { return atomic_load(&calls); }

static int is_below(const char *path) {
    return folder_length > 0 && strncmp(path, folder, folder_length) == 0;
}

static int is_file_below(int handle) {
    char link[64], path[4096];
    ssize_t length;
    int before = errno;
    if (folder_length == 0)
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", handle);
    length = readlink(link, path, sizeof path - 1);
    errno = before;
    if (length < 0)
        return 0;
    path[length] = 0;
    return is_below(path);
}

static int fails(void) {
    long number = atomic_fetch_add(&calls, 1) + 1;
    if (first == 0 || number < first || (last >= 0 && number > last))
        return 0;
    if (failure >= 0)
        return 1;
    kill(getpid(), -failure);
    return 0;
}

ssize_t write(int handle, const void *data, size_t size) {
    if (is_file_below(handle) && fails()) {
        if (failure == 0)
            return true_write(handle, data, size > 1 ? size / 2 : size);
        errno = failure;
        return -1;
    }
    return true_write(handle, data, size);
}

ssize_t pwrite64(int handle, const void *data, size_t size, off_t at) {
    if (is_file_below(handle) && fails()) {
        if (failure == 0)
            return true_pwrite(handle, data, size > 1 ? size / 2 : size, at);
        errno = failure;
        return -1;
    }
    return true_pwrite(handle, data, size, at);
}

ssize_t pwrite(int handle, const void *data, size_t size, off_t at) {
    return pwrite64(handle, data, size, at);
}

#define FAILING(is_there, call)                \
    if ((is_there) && fails() && failure != 0) { \
        errno = failure;                         \
        return -1;                               \
    }                                            \
    return call;

int fsync(int handle) { FAILING(is_file_below(handle), true_fsync(handle)) }

int fdatasync(int handle) { FAILING(is_file_below(handle), true_fdatasync(handle)) }

int ftruncate64(int handle, off_t size) {
    FAILING(is_file_below(handle), true_ftruncate(handle, size))
}

int ftruncate(int handle, off_t size) { return ftruncate64(handle, size); }

int rename(const char *from, const char *to) { FAILING(is_below(to), true_rename(from, to)) }

int mkdir(const char *path, mode_t mode) { FAILING(is_below(path), true_mkdir(path, mode)) }

int open64(const char *path, int flags, ...) {
    mode_t mode = 0;
    if (flags & (O_CREAT | O_TMPFILE)) {
        va_list more;
        va_start(more, flags);
        mode = va_arg(more, mode_t);
        va_end(more);
    }
    FAILING((flags & (O_WRONLY | O_RDWR | O_CREAT)) && is_below(path), true_open(path, flags, mode))
}

int open(const char *path, int flags, ...) {
    mode_t mode = 0;
    if (flags & (O_CREAT | O_TMPFILE)) {
        va_list more;
        va_start(more, flags);
        mode = va_arg(more, mode_t);
        va_end(more);
    }
    return open64(path, flags, mode);
}
