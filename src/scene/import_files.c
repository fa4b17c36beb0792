#include "scene/document_parts.h"
#include "scene/import.h"

#include <limits.h>
#include <sys/stat.h>

static size_t read_file(struct aiFile *file, char *out, size_t size, size_t count)
{
    return size ? fread(out, size, count, (FILE *)(void *)file->UserData) : 0;
}

static size_t write_nothing(struct aiFile *file, const char *data, size_t size, size_t count)
{
    (void)file, (void)data, (void)size, (void)count;
    return 0;
}

static size_t tell_file(struct aiFile *file)
{
    const long at = ftell((FILE *)(void *)file->UserData);
    return at < 0 ? 0 : (size_t)at;
}

static size_t file_size(struct aiFile *file)
{
    struct stat info;
    return fstat(fileno((FILE *)(void *)file->UserData), &info) == 0 ? (size_t)info.st_size : 0;
}

static enum aiReturn seek_file(struct aiFile *file, size_t offset, enum aiOrigin origin)
{
    const int whence = origin == aiOrigin_SET   ? SEEK_SET
                       : origin == aiOrigin_CUR ? SEEK_CUR
                                                : SEEK_END;
    if (fseek((FILE *)(void *)file->UserData, (long)offset, whence) != 0)
        return aiReturn_FAILURE;
    return aiReturn_SUCCESS;
}

static void flush_nothing(struct aiFile *file)
{
    (void)file;
}

/* A plain file within the limit that is the scene itself or lies in its folder. */
static bool may_open(const struct document *place, const char *path)
{
    struct stat info;
    if (stat(path, &info) != 0 || !S_ISREG(info.st_mode) ||
        (uint64_t)info.st_size > place->memory_limit)
        return false;
    if (place->allow_outside || strcmp(path, place->path) == 0)
        return true;
    char *folder = path_folder(place->path);
    const bool within = folder && path_within(path, folder);
    free(folder);
    return within;
}

static struct aiFile *open_file(struct aiFileIO *io, const char *path, const char *mode)
{
    const struct import_files *files = (const struct import_files *)(void *)io->UserData;
    if (!mode || mode[0] != 'r' || strchr(mode, '+') || !may_open(files->place, path))
        return NULL;
    struct aiFile *file = alloc_array(1, sizeof *file);
    FILE *stream = file ? fopen(path, "rbe") : NULL;
    if (!stream) {
        free(file);
        return NULL;
    }
    *file = (struct aiFile){.ReadProc = read_file,
                            .WriteProc = write_nothing,
                            .TellProc = tell_file,
                            .FileSizeProc = file_size,
                            .SeekProc = seek_file,
                            .FlushProc = flush_nothing,
                            .UserData = (char *)stream};
    return file;
}

static void close_file(struct aiFileIO *io, struct aiFile *file)
{
    (void)io;
    fclose((FILE *)(void *)file->UserData);
    free(file);
}

void import_files_begin(struct import_files *files, const struct document *place)
{
    *files = (struct import_files){.io = {.OpenProc = open_file, .CloseProc = close_file},
                                   .place = place};
    files->io.UserData = (char *)files;
}
