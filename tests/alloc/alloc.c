/* Failing allocations: load, bake, save and preview of small scenes, and the screen-space methods
 * and filters on a small frame, with the n-th allocation of the library refused, for every n until
 * a run needs no more, once alone and once with all after it.
 * Each run must end in CRANNY_MEMORY, or in CRANNY_OK with the result of a run that was refused
 * nothing (shrinking may fail), leave no output behind and free what it took.
 * Only Cranny's own calls are counted: the linker routes them here (--wrap), other libraries' not.
 */
#include "alloc/stages.h"
#include "check.h"

#include <dirent.h>
#include <pthread.h>
#include <unistd.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *block, size_t size);
void *__real_aligned_alloc(size_t alignment, size_t size);
char *__real_strdup(const char *text);
void __real_free(void *block);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *block, size_t size);
void *__wrap_aligned_alloc(size_t alignment, size_t size);
char *__wrap_strdup(const char *text);
void __wrap_free(void *block);

/* The n-th counted allocation fails; `sticky`: and all after it. Blocks made while armed are kept
 * in `live` until they are freed. */
static struct {
    pthread_mutex_t lock;
    bool armed, sticky, failed;
    size_t count, fail_at;
    void *live[1 << 16];
    size_t live_count;
} ledger = {.lock = PTHREAD_MUTEX_INITIALIZER};

static bool refused(void)
{
    pthread_mutex_lock(&ledger.lock);
    bool refuse = false;
    if (ledger.armed) {
        ledger.count++;
        refuse = ledger.count == ledger.fail_at ||
                 (ledger.sticky && ledger.fail_at && ledger.count > ledger.fail_at);
        ledger.failed |= refuse;
    }
    pthread_mutex_unlock(&ledger.lock);
    return refuse;
}

static void *record(void *block)
{
    pthread_mutex_lock(&ledger.lock);
    if (block && ledger.armed) {
        if (ledger.live_count == sizeof ledger.live / sizeof *ledger.live) {
            fprintf(stderr, "alloc: more blocks at once than the test can follow\n");
            exit(1);
        }
        ledger.live[ledger.live_count++] = block;
    }
    pthread_mutex_unlock(&ledger.lock);
    return block;
}

static void forget(const void *block)
{
    pthread_mutex_lock(&ledger.lock);
    for (size_t i = ledger.live_count; block && i-- > 0;) {
        if (ledger.live[i] == block) {
            ledger.live[i] = ledger.live[--ledger.live_count];
            break;
        }
    }
    pthread_mutex_unlock(&ledger.lock);
}

void *__wrap_malloc(size_t size)
{
    return refused() ? NULL : record(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size)
{
    return refused() ? NULL : record(__real_calloc(count, size));
}

void *__wrap_realloc(void *block, size_t size)
{
    if (refused())
        return NULL;
    forget(block);
    return record(__real_realloc(block, size));
}

void *__wrap_aligned_alloc(size_t alignment, size_t size)
{
    return refused() ? NULL : record(__real_aligned_alloc(alignment, size));
}

char *__wrap_strdup(const char *text)
{
    return refused() ? NULL : record(__real_strdup(text));
}

void __wrap_free(void *block)
{
    forget(block);
    __real_free(block);
}

void fold(const struct context *with, const void *bytes, size_t size)
{
    const uint8_t *byte = bytes;
    for (size_t i = 0; i < size; i++)
        *with->digest = (*with->digest ^ byte[i]) * 0x100000001b3u;
}

static void fold_scene(const struct context *with, const struct cranny_scene *scene)
{
    for (uint32_t i = 0; i < cranny_scene_mesh_count(scene); i++) {
        const struct cranny_mesh *mesh = cranny_scene_mesh(scene, i);
        fold(with, mesh->positions, mesh->vertex_count * sizeof *mesh->positions);
        fold(with, mesh->triangles, mesh->triangle_count * sizeof *mesh->triangles);
    }
    for (uint32_t i = 0; i < cranny_scene_texture_count(scene); i++) {
        const struct cranny_alpha_texture *texture = cranny_scene_texture(scene, i);
        fold(with, texture->alpha, (size_t)texture->width * texture->height);
    }
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++)
        fold(with, cranny_scene_instance(scene, i)->world_from_object, 12 * sizeof(double));
}

static void fold_bake(const struct context *with, const struct cranny_bake *bake)
{
    for (uint32_t i = 0; i < cranny_scene_instance_count(with->scene); i++) {
        uint32_t mesh = cranny_scene_instance(with->scene, i)->mesh;
        fold(with, cranny_bake_values(bake, i, CRANNY_CHANNEL_VISIBILITY),
             cranny_scene_mesh(with->scene, mesh)->vertex_count * sizeof(float));
    }
}

static void fold_file(const struct context *with)
{
    static uint8_t bytes[1 << 16];
    FILE *file = fopen(with->output, "rb");
    if (file) {
        fold(with, bytes, fread(bytes, 1, sizeof bytes, file));
        fclose(file);
    }
}

static struct cranny_bake_params small_bake(void)
{
    struct cranny_bake_params params = cranny_bake_params_default();
    params.rays = 4;
    params.samples_max = 4;
    params.threads = 1;
    return params;
}

static enum cranny_status stage_load(const struct context *with, struct cranny_error *why)
{
    struct cranny_scene *scene = NULL;
    enum cranny_status status =
        cranny_scene_load_memory(with->data, with->size, with->name, NULL, &scene, why);
    CHECK_MSG((status == CRANNY_OK) == (scene != NULL), "%s", with->name);
    if (scene)
        fold_scene(with, scene);
    cranny_scene_destroy(&scene);
    return status;
}

static enum cranny_status stage_bake(const struct context *with, struct cranny_error *why)
{
    struct cranny_bake *bake = NULL;
    struct cranny_bake_params params = small_bake();
    enum cranny_status status = cranny_bake_create(with->scene, &params, &bake, why);
    CHECK_MSG((status == CRANNY_OK) == (bake != NULL), "%s", with->name);
    if (bake)
        fold_bake(with, bake);
    cranny_bake_destroy(&bake);
    return status;
}

static enum cranny_status save_to(const struct context *with, enum cranny_output to,
                                  struct cranny_error *why)
{
    struct cranny_save_params params = cranny_save_params_default();
    params.to = to;
    enum cranny_status status =
        cranny_scene_save(with->scene, with->bake, with->output, &params, why);
    bool written = access(with->output, F_OK) == 0;
    CHECK_MSG(written == (status == CRANNY_OK), "%s: status %d, file %d", with->name, status,
              written);
    fold_file(with);
    unlink(with->output);
    return status;
}

static enum cranny_status stage_occlusion(const struct context *with, struct cranny_error *why)
{
    return save_to(with, CRANNY_OUTPUT_OCCLUSION, why);
}

static enum cranny_status stage_color(const struct context *with, struct cranny_error *why)
{
    return save_to(with, CRANNY_OUTPUT_COLOR, why);
}

static enum cranny_status stage_attribute(const struct context *with, struct cranny_error *why)
{
    return save_to(with, CRANNY_OUTPUT_ATTRIBUTE, why);
}

static enum cranny_status stage_preview(const struct context *with, struct cranny_error *why)
{
    uint8_t rgb[16 * 16 * 3];
    enum cranny_status status =
        cranny_preview_render(with->scene, with->bake, -1, 16, 16, NULL, rgb, why);
    if (status == CRANNY_OK)
        fold(with, rgb, sizeof rgb);
    return status;
}

static enum cranny_status stage_arrays(const struct context *with, struct cranny_error *why)
{
    static const float positions[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
    static const uint32_t triangles[1][3] = {{0, 2, 1}};
    const struct cranny_mesh mesh = {.name = "triangle",
                                     .vertex_count = 3,
                                     .triangle_count = 1,
                                     .positions = positions,
                                     .triangles = triangles};
    const struct cranny_instance instance = {
        .name = "one", .world_from_object = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    struct cranny_scene *scene = NULL;
    enum cranny_status status = cranny_scene_create(&scene, why);
    if (status == CRANNY_OK)
        status = cranny_scene_add_mesh(scene, &mesh, NULL, why);
    if (status == CRANNY_OK)
        status = cranny_scene_add_instance(scene, &instance, NULL, why);
    if (status == CRANNY_OK)
        status = cranny_scene_save(scene, NULL, with->output, NULL, why);
    fold_file(with);
    unlink(with->output);
    cranny_scene_destroy(&scene);
    return status;
}

static const struct stage stages[] = {
    {"load", stage_load},
    {"bake", stage_bake},
    {"save occlusion", stage_occlusion},
    {"save color", stage_color},
    {"save attribute", stage_attribute},
    {"preview", stage_preview},
    {"arrays", stage_arrays},
};

static size_t files_in(const char *path)
{
    DIR *folder = opendir(path);
    size_t count = 0;
    if (!folder)
        return SIZE_MAX;
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;)
        count += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    closedir(folder);
    return count;
}

/* One run with the n-th allocation refused (0: none); false when it needed fewer. */
static bool run_once(const struct stage *stage, const struct context *with, size_t n, bool sticky,
                     uint64_t expected)
{
    *with->digest = 0;
    struct cranny_error why = {.message = ""};
    ledger.armed = true;
    ledger.sticky = sticky;
    ledger.failed = false;
    ledger.count = ledger.live_count = 0;
    ledger.fail_at = n;
    enum cranny_status status = stage->run(with, &why);
    ledger.armed = false;
    const char *mode = sticky ? "and all after it" : "alone";
    if (ledger.failed)
        CHECK_MSG(status == CRANNY_OK || status == CRANNY_MEMORY,
                  "%s, %s, allocation %zu %s: %s: %s", with->name, stage->name, n, mode,
                  cranny_status_name(status), why.message);
    else
        CHECK_MSG(status == CRANNY_OK, "%s, %s: %s", with->name, stage->name, why.message);
    CHECK_MSG(status != CRANNY_OK || n == 0 || *with->digest == expected,
              "%s, %s, allocation %zu %s: succeeds with another result", with->name, stage->name, n,
              mode);
    CHECK_MSG(status == CRANNY_OK || *why.message, "%s, %s, allocation %zu %s: no message",
              with->name, stage->name, n, mode);
    CHECK_MSG(ledger.live_count == 0, "%s, %s, allocation %zu %s: %zu blocks leak", with->name,
              stage->name, n, mode, ledger.live_count);
    CHECK_MSG(files_in(with->folder) == 0, "%s, %s, allocation %zu %s: files are left", with->name,
              stage->name, n, mode);
    return ledger.failed;
}

void sweep(const struct stage *stage, const struct context *with)
{
    size_t n = 0;
    run_once(stage, with, 0, false, 0);
    const uint64_t expected = *with->digest;
    for (int sticky = 0; sticky < 2; sticky++)
        for (n = 1; run_once(stage, with, n, sticky, expected); n++)
            ;
    printf("%s, %s: %zu allocations\n", with->name, stage->name, n - 1);
    CHECK_MSG(n > 1, "%s, %s: none of the allocations were seen", with->name, stage->name);
}

static bool read_bytes(const char *path, struct context *into)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    into->data = malloc(1 << 16);
    into->size = into->data ? fread(into->data, 1, 1 << 16, file) : 0;
    fclose(file);
    return into->size > 0;
}

static void check_file(const char *path, const char *folder)
{
    struct cranny_error why = {.message = ""};
    struct context with = {.name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path};
    struct cranny_bake_params params = small_bake();
    uint64_t digest = 0;
    with.digest = &digest;
    snprintf(with.folder, sizeof with.folder, "%s", folder);
    snprintf(with.output, sizeof with.output, "%s/out.glb", with.folder);
    CHECK_MSG(read_bytes(path, &with), "%s", path);
    const enum cranny_status status =
        cranny_scene_load_memory(with.data, with.size, with.name, NULL, &with.scene, &why);
    if (!check_left_out(why.message))
        CHECK_OK(status, why);
    if (with.scene)
        CHECK_OK(cranny_bake_create(with.scene, &params, &with.bake, &why), why);
    if (with.bake)
        for (size_t i = 0; i < sizeof stages / sizeof *stages; i++)
            sweep(&stages[i], &with);
    cranny_bake_destroy(&with.bake);
    cranny_scene_destroy(&with.scene);
    free(with.data);
}

int main(int argc, char **argv)
{
    char folder[64] = "alloc-XXXXXX";
    if (!mkdtemp(folder))
        return check_skip("alloc", "no folder can be made here");
    for (int i = 1; i < argc; i++)
        check_file(argv[i], folder);
    sweep_frames(folder);
    CHECK(rmdir(folder) == 0);
    return check_end("alloc");
}
