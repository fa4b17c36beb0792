#include "base/base.h"

#include <errno.h>
#include <fcntl.h>
#include <omp.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

void *alloc_array(size_t count, size_t size)
{
    return calloc(count ? count : 1, size);
}

void *alloc_aligned(size_t count, size_t size)
{
    if (size && count > (SIZE_MAX - 64) / size)
        return NULL;
    size_t bytes = (count * size + 63) & ~(size_t)63;
    return aligned_alloc(64, bytes ? bytes : 64);
}

bool grow_array(void **items, size_t *capacity, size_t need, size_t size)
{
    if (need <= *capacity)
        return true;
    size_t wanted = *capacity > SIZE_MAX / 2 ? need : *capacity * 2;
    if (wanted < need)
        wanted = need;
    if (wanted < 16)
        wanted = 16;
    if (wanted > SIZE_MAX / size)
        return false;
    void *grown = realloc(*items, wanted * size);
    if (!grown)
        return false;
    memset((char *)grown + *capacity * size, 0, (wanted - *capacity) * size);
    *items = grown;
    *capacity = wanted;
    return true;
}

char *copy_text(const char *text)
{
    return strdup(text ? text : "");
}

static enum cranny_status read_all(int file, const char *path, uint64_t limit, uint8_t **data,
                                   size_t *size, struct cranny_error *why)
{
    size_t capacity = 0, used = 0;
    uint8_t *bytes = NULL;
    struct stat info;
    if (fstat(file, &info) == 0 && S_ISDIR(info.st_mode))
        return fail(why, CRANNY_INPUT, "%s: is a folder, not a file", path);
    size_t first = info.st_size > 0 && (uint64_t)info.st_size <= limit ? (size_t)info.st_size : 0;
    for (;;) {
        if (used + 1 >= capacity &&
            !grow_array((void **)&bytes, &capacity, used ? used + 65536 : first + 2, 1)) {
            free(bytes);
            return fail_memory(why, path);
        }
        ssize_t got = read(file, bytes + used, capacity - used - 1);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            free(bytes);
            return fail(why, CRANNY_INPUT, "%s: cannot be read: %s", path, strerror(errno));
        }
        if (got == 0)
            break;
        used += (size_t)got;
        if (used > limit) {
            free(bytes);
            return fail(why, CRANNY_INPUT, "%s: larger than the limit of %llu bytes", path,
                        (unsigned long long)limit);
        }
    }
    bytes[used] = 0;
    *data = bytes;
    *size = used;
    return CRANNY_OK;
}

enum cranny_status file_read(const char *path, uint64_t limit, uint8_t **data, size_t *size,
                             struct cranny_error *why)
{
    *data = NULL;
    *size = 0;
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return fail(why, CRANNY_INPUT, "%s: cannot be opened: %s", path, strerror(errno));
    enum cranny_status status = read_all(file, path, limit, data, size, why);
    close(file);
    return status;
}

static bool write_all(int file, const void *data, size_t size)
{
    const char *bytes = data;
    while (size) {
        ssize_t put = write(file, bytes, size < (1u << 30) ? size : (1u << 30));
        if (put < 0 && errno == EINTR)
            continue;
        if (put <= 0)
            return false;
        bytes += put;
        size -= (size_t)put;
    }
    return true;
}

/* The mode a newly created file would get, or that of the file being replaced. */
static mode_t output_mode(const char *path)
{
    struct stat info;
    if (stat(path, &info) == 0)
        return info.st_mode & 07777;
    mode_t mask = umask(0);
    umask(mask);
    return 0666 & ~mask;
}

enum cranny_status file_write(const char *path, const struct file_part *parts, size_t part_count,
                              struct cranny_error *why)
{
    struct stat info;
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode))
        return fail(why, CRANNY_FAILED, "%s: is a folder; name a file", path);
    size_t length = strlen(path) + sizeof ".cranny-XXXXXX";
    char *temporary = malloc(length);
    if (!temporary)
        return fail_memory(why, path);
    snprintf(temporary, length, "%s.cranny-XXXXXX", path);
    int file = mkostemp(temporary, O_CLOEXEC);
    bool good = file >= 0;
    for (size_t i = 0; good && i < part_count; i++)
        good = write_all(file, parts[i].data, parts[i].size);
    good = good && fchmod(file, output_mode(path)) == 0 && fsync(file) == 0;
    int problem = errno;
    if (file >= 0 && close(file) != 0 && good) {
        problem = errno;
        good = false;
    }
    if (good && rename(temporary, path) != 0) {
        problem = errno;
        good = false;
    }
    if (!good && file >= 0)
        unlink(temporary);
    free(temporary);
    if (!good)
        return fail(why, CRANNY_FAILED, "%s: cannot be written: %s", path, strerror(problem));
    return CRANNY_OK;
}

enum cranny_status cranny_file_write(const char *path, const void *data, size_t size,
                                     struct cranny_error *why)
{
    struct file_part part = {data, size};
    return file_write(path, &part, 1, why);
}

double seconds_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

int thread_count(int threads)
{
    return threads > 0 ? threads : omp_get_num_procs();
}
