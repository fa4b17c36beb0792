#include "bake/cache.h"

#include "base/hash.h"

#include <dirent.h>
#include <errno.h>
#include <sys/stat.h>
#include <unistd.h>

/* Of the scene as a whole: what changes everything. */
struct scene_state {
    double density;
    float ground_height, unused;
};

/* All parameters that the result depends on, and who computes it. */
static uint64_t params_key(const struct cranny_bake_params *params)
{
    const struct cranny_param_table *table = cranny_bake_param_table();
    char text[64];
    uint64_t key = hash_bytes(HASH_BEGIN, CRANNY_VERSION_TEXT, sizeof CRANNY_VERSION_TEXT);
    key = hash_word(key, sizeof(struct kept_values));
    for (size_t i = 0; i < table->row_count; i++) {
        const char *name = table->rows[i].name;
        if (strcmp(name, "threads") == 0)
            continue;
        cranny_params_get(table, params, name, text, sizeof text);
        key = hash_bytes(hash_bytes(key, name, strlen(name)), text, strlen(text));
    }
    return key;
}

/* Only creating a file tells whether the folder takes any. */
static enum cranny_status check_folder(const char *folder, struct cranny_error *why)
{
    static const char name[] = "/.cranny-probe-XXXXXX";
    if (mkdir(folder, 0777) != 0 && errno != EEXIST)
        return fail(why, CRANNY_FAILED, "cache folder %s: cannot be made: %s", folder,
                    strerror(errno));
    char *probe = alloc_array(strlen(folder) + sizeof name, 1);
    if (!probe)
        return fail_memory(why, "cache");
    strcat(strcpy(probe, folder), name);
    const int file = mkstemp(probe);
    const int problem = errno;
    if (file >= 0) {
        close(file);
        unlink(probe);
    }
    free(probe);
    return file >= 0 ? CRANNY_OK
                     : fail(why, CRANNY_FAILED, "cache folder %s: takes no new file: %s", folder,
                            strerror(problem));
}

static uint32_t name_key(const struct cranny_bake_params *params)
{
    const char *name = params->cache_name ? params->cache_name : "";
    return (uint32_t)(hash_bytes(HASH_BEGIN, name, strlen(name)) >> 32);
}

#define NAME_FORMAT "bake-%08x-"

static char *state_path(const struct cranny_bake_params *params, uint64_t key)
{
    const size_t size = strlen(params->cache_folder) + 64;
    char *path = alloc_array(size, 1);
    if (path)
        snprintf(path, size, "%s/" NAME_FORMAT "%016llx.state", params->cache_folder,
                 name_key(params), (unsigned long long)key);
    return path;
}

enum cranny_status cache_create(const struct cranny_bake_params *params, struct cache **cache,
                                struct cranny_error *why)
{
    *cache = NULL;
    if (!params->cache_folder)
        return CRANNY_OK;
    const enum cranny_status status = check_folder(params->cache_folder, why);
    struct cache *made = status == CRANNY_OK ? alloc_array(1, sizeof *made) : NULL;
    if (!made)
        return status == CRANNY_OK ? fail_memory(why, "cache") : status;
    made->params = params;
    made->key = params_key(params);
    made->path = state_path(params, made->key);
    if (!made->path) {
        free(made);
        return fail_memory(why, "cache");
    }
    *cache = made;
    return CRANNY_OK;
}

void cache_destroy(struct cache **cache)
{
    if (!*cache)
        return;
    state_free(&(*cache)->old);
    state_list_free(&(*cache)->next);
    for (size_t i = 0; i < (*cache)->owned_count; i++)
        free((*cache)->owned[i]);
    free((*cache)->owned);
    free((*cache)->now.items);
    change_free(&(*cache)->change);
    free((*cache)->path);
    free(*cache);
    *cache = NULL;
}

/* Whether bakes under this name with other parameters left something. */
static bool others_kept(const struct cache *cache)
{
    char start[32];
    const size_t length =
        (size_t)snprintf(start, sizeof start, NAME_FORMAT, name_key(cache->params));
    DIR *folder = opendir(cache->params->cache_folder);
    bool found = false;
    for (const struct dirent *entry; folder && !found && (entry = readdir(folder));)
        found = strncmp(entry->d_name, start, length) == 0;
    if (folder)
        closedir(folder);
    return found;
}

/* Four times what this scene's own state takes: an older scene may have been larger. */
static uint64_t size_limit(const struct cache *cache, const struct plan *plan)
{
    const struct cranny_scene *scene = plan->scene;
    uint64_t bytes = plan->sample_count * sizeof(struct kept);
    bytes += scene->instance_count * (sizeof(struct occluder) + 1024 +
                                      (uint64_t)cache->params->linear_points * sizeof(struct kept));
    for (size_t i = 0; i < scene->instance_count; i++)
        bytes += scene->meshes[scene->instances[i].view.mesh].view.vertex_count * 8ull;
    return 4 * bytes + (64u << 20);
}

/* Nothing of the old state is of use. */
static void forget(struct cache *cache, enum cranny_reuse outcome)
{
    state_free(&cache->old);
    cache->outcome = outcome;
    cache->news = true;
}

static struct scene_state scene_state(const struct cache *cache, const struct plan *plan)
{
    struct scene_state state = {.density = plan->density};
    double bounds[6];
    cranny_scene_bounds(plan->scene, bounds);
    if (cache->params->ground)
        state.ground_height =
            isnan(cache->params->ground_height) ? (float)bounds[1] : cache->params->ground_height;
    return state;
}

static enum cranny_status keep_scene(struct cache *cache, const struct scene_state *scene,
                                     struct cranny_error *why)
{
    const size_t size = cache->now.count * sizeof *cache->now.items;
    struct scene_state *copy = alloc_array(1, sizeof *copy);
    if (!copy)
        return fail_memory(why, "cache");
    *copy = *scene;
    enum cranny_status status = cache_keep(cache, STATE_SCENE, 0, copy, sizeof *copy, why);
    if (status == CRANNY_OK && !state_add(&cache->next, STATE_INSTANCES, 0, cache->now.items, size))
        status = fail_memory(why, "cache");
    return status;
}

/* From the file's records to what changed. */
static enum cranny_status compare_scenes(struct cache *cache, const struct scene_state *now,
                                         struct cranny_error *why)
{
    size_t scene_size, list_size;
    const struct scene_state *scene = state_find(&cache->old, STATE_SCENE, 0, &scene_size);
    const struct occluder *list = state_find(&cache->old, STATE_INSTANCES, 0, &list_size);
    if (!scene || !list || scene_size != sizeof *scene || list_size % sizeof *list) {
        forget(cache, CRANNY_REUSE_DAMAGED);
        return CRANNY_OK;
    }
    if (memcmp(&scene->density, &now->density, sizeof now->density) != 0 ||
        scene->ground_height != now->ground_height) {
        forget(cache, scene->ground_height != now->ground_height ? CRANNY_REUSE_GROUND
                                                                 : CRANNY_REUSE_DENSITY);
        return CRANNY_OK;
    }
    const enum cranny_status status =
        change_find(list, list_size / sizeof *list, &cache->now, &cache->change, why);
    cache->outcome = CRANNY_REUSE_DONE;
    cache->news |= cache->change.box_count > 0;
    return status;
}

enum cranny_status cache_open(struct cache *cache, const struct plan *plan,
                              struct cranny_error *why)
{
    const double begin = seconds_now();
    const struct scene_state scene = scene_state(cache, plan);
    enum state_found found;
    enum cranny_status status = occluders_list(plan->scene, &cache->now, why);
    if (status == CRANNY_OK)
        status = keep_scene(cache, &scene, why);
    if (status == CRANNY_OK)
        status = state_read(cache->path, cache->key, size_limit(cache, plan), cache->params->hooks,
                            &cache->old, &found, why);
    if (status != CRANNY_OK)
        return status;
    if (found == STATE_READ)
        status = compare_scenes(cache, &scene, why);
    else
        forget(cache, found == STATE_DAMAGED ? CRANNY_REUSE_DAMAGED
                      : others_kept(cache)   ? CRANNY_REUSE_PARAMETERS
                                             : CRANNY_REUSE_FIRST);
    cache->seconds += seconds_now() - begin;
    return status;
}

void cache_save(struct cache *cache)
{
    const double begin = seconds_now();
    struct cranny_error why;
    if (!cache->news) {
        cache->bytes = cache->old.size;
        return;
    }
    if (state_write(cache->path, cache->key, &cache->next, &cache->bytes, &why) != CRANNY_OK)
        hook_warn(cache->params->hooks, "the next bake starts anew: %s", why.message);
    cache->seconds += seconds_now() - begin;
}

enum cranny_status cache_own(struct cache *cache, void *data, struct cranny_error *why)
{
    if (!grow_array((void **)&cache->owned, &cache->owned_capacity, cache->owned_count + 1,
                    sizeof *cache->owned)) {
        free(data);
        return fail_memory(why, "cache");
    }
    cache->owned[cache->owned_count++] = data;
    return CRANNY_OK;
}

enum cranny_status cache_keep(struct cache *cache, enum state_kind kind, uint64_t key, void *data,
                              size_t size, struct cranny_error *why)
{
    const enum cranny_status status = cache_own(cache, data, why);
    if (status != CRANNY_OK)
        return status;
    return state_add(&cache->next, kind, key, data, size) ? CRANNY_OK : fail_memory(why, "cache");
}

struct cache_samples cache_find_samples(const struct cache *cache, const struct target *target)
{
    size_t size, pick_size = 0;
    struct cache_samples found = {.kept =
                                      state_find(&cache->old, STATE_SAMPLES, target->key, &size)};
    if (!found.kept || size != target->sample_count * sizeof *found.kept)
        return (struct cache_samples){.kept = NULL};
    if (target->instance_count == 1)
        return found;
    found.picks = state_find(&cache->old, STATE_PICKS, target->key, &pick_size);
    found.pick_count = (uint32_t)(pick_size / sizeof *found.picks);
    return found.picks && found.pick_count ? found : (struct cache_samples){.kept = NULL};
}

bool cache_add_drift(const struct cache *cache, float reach, struct kept *kept)
{
    const float limit = cache->params->reuse_limit;
    if (!(reach > 0))
        return true;
    const float drift = limit > 0 ? ceilf((float)kept->drift + reach * (255 / limit)) : INFINITY;
    kept->drift = (uint8_t)fminf(drift, 255);
    return drift <= 255;
}

bool cache_stands(const struct cache *cache, const struct gather_plan *gather,
                  const struct gather_point *point, const struct kept *old, struct kept *kept)
{
    if (!old)
        return false;
    *kept = *old;
    if (!cache->change.box_count)
        return true;
    const float reach =
        gather_reach(gather, point, (const float(*)[6])cache->change.boxes, cache->change.box_count,
                     cache->params->dimming == CRANNY_DIMMING_PLAIN);
    return cache_add_drift(cache, reach, kept);
}

static enum cranny_status keep_picks(struct cache *cache, const struct plan *plan,
                                     const struct target *target, struct cranny_error *why)
{
    struct pick *picks = alloc_array(target->instance_count, sizeof *picks);
    if (!picks)
        return fail_memory(why, "cache");
    for (uint32_t i = 0; i < target->instance_count; i++)
        picks[i] = (struct pick){plan->places[plan->order[target->instance_first + i]],
                                 plan->share[target->instance_first + i]};
    return cache_keep(cache, STATE_PICKS, target->key, picks,
                      target->instance_count * sizeof *picks, why);
}

enum cranny_status cache_keep_samples(struct cache *cache, const struct plan *plan,
                                      struct samples *samples, struct cranny_error *why)
{
    struct kept *kept = samples->kept;
    if (!kept)
        return CRANNY_OK;
    samples->kept = NULL;
    enum cranny_status status = cache_own(cache, kept, why);
    for (size_t i = 0; status == CRANNY_OK && i < plan->target_count; i++) {
        const struct target *target = &plan->targets[i];
        if (!target->sample_count)
            continue;
        if (!state_add(&cache->next, STATE_SAMPLES, target->key, kept + target->sample_base,
                       target->sample_count * sizeof *kept))
            return fail_memory(why, "cache");
        if (target->instance_count > 1)
            status = keep_picks(cache, plan, target, why);
    }
    return status;
}

size_t kept_values_size(uint32_t vertex_count)
{
    return sizeof(struct kept_values) + (size_t)vertex_count * 2 * sizeof(float);
}

const struct kept_values *cache_find_values(const struct cache *cache, uint64_t key,
                                            uint32_t vertex_count)
{
    size_t size;
    const struct kept_values *values = state_find(&cache->old, STATE_VALUES, key, &size);
    return values && size == kept_values_size(vertex_count) ? values : NULL;
}

uint64_t cache_fit_key(const struct plan *plan, const struct samples *samples, size_t index)
{
    const struct target *target = &plan->targets[index];
    uint64_t key = hash_word(target->key, target->instance_count);
    key = hash_bytes(key, samples->values + target->sample_base,
                     target->sample_count * sizeof *samples->values);
    return hash_bytes(key, samples->valid + target->sample_base, target->sample_count);
}
