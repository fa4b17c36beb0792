#include "glb.h"

#include "texture.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct bytes {
    uint8_t *data;
    size_t size, capacity;
};

struct writer {
    const struct world *world;
    json_t *views, *accessors;
    struct bytes bin;
    bool failed;
};

static void append(struct writer *w, const void *data, size_t size)
{
    size_t need = w->bin.size + size;
    if (size == 0)
        return;
    if (need > w->bin.capacity) {
        size_t capacity = w->bin.capacity * 2 > need ? w->bin.capacity * 2 : need + 65536;
        uint8_t *grown = realloc(w->bin.data, capacity);
        if (!grown) {
            w->failed = true;
            return;
        }
        w->bin.data = grown;
        w->bin.capacity = capacity;
    }
    memcpy(w->bin.data + w->bin.size, data, size);
    w->bin.size += size;
}

/* A buffer view of `size` bytes; `target` 0: none (images). Its index. */
static size_t add_view(struct writer *w, const void *data, size_t size, int target)
{
    static const uint8_t zeros[4];
    append(w, zeros, (4 - w->bin.size % 4) % 4);
    json_t *view = json_pack("{s:i, s:I, s:I}", "buffer", 0, "byteOffset", (json_int_t)w->bin.size,
                             "byteLength", (json_int_t)size);
    if (target)
        json_object_set_new(view, "target", json_integer(target));
    json_array_append_new(w->views, view);
    append(w, data, size);
    return json_array_size(w->views) - 1;
}

static json_t *add_accessor(struct writer *w, size_t view, int type, size_t count,
                            const char *shape)
{
    json_t *accessor = json_pack("{s:I, s:i, s:I, s:s}", "bufferView", (json_int_t)view,
                                 "componentType", type, "count", (json_int_t)count, "type", shape);
    json_array_append_new(w->accessors, accessor);
    return accessor;
}

static json_t *last_accessor(const struct writer *w)
{
    return json_integer((json_int_t)json_array_size(w->accessors) - 1);
}

static void add_bounds(json_t *accessor, const struct surface *s)
{
    json_t *low = json_array(), *high = json_array();
    for (int k = 0; k < 3; k++) {
        float least = s->positions[0][k], most = least;
        for (size_t i = 1; i < s->vertex_count; i++) {
            least = fminf(least, s->positions[i][k]);
            most = fmaxf(most, s->positions[i][k]);
        }
        json_array_append_new(low, json_real(least));
        json_array_append_new(high, json_real(most));
    }
    json_object_set_new(accessor, "min", low);
    json_object_set_new(accessor, "max", high);
}

static json_t *add_indices(struct writer *w, const struct surface *s)
{
    size_t count = s->triangle_count * 3, size = count * 4;
    const uint32_t *wide = &s->triangles[0][0];
    bool narrow = s->vertex_count < 65535;
    uint16_t *small = narrow ? malloc(count * sizeof *small) : NULL;
    if (narrow && !small) {
        w->failed = true;
        return json_integer(0);
    }
    for (size_t i = 0; narrow && i < count; i++)
        small[i] = (uint16_t)wide[i];
    size_t view = add_view(w, narrow ? (const void *)small : wide, narrow ? size / 2 : size, 34963);
    free(small);
    add_accessor(w, view, narrow ? 5123 : 5125, count, "SCALAR");
    return last_accessor(w);
}

static json_t *add_primitive(struct writer *w, const struct surface *s, enum material material)
{
    const size_t n = s->vertex_count;
    json_t *attributes = json_object();
    size_t view = add_view(w, s->positions, n * sizeof *s->positions, 34962);
    add_bounds(add_accessor(w, view, 5126, n, "VEC3"), s);
    json_object_set_new(attributes, "POSITION", last_accessor(w));
    view = add_view(w, s->normals, n * sizeof *s->normals, 34962);
    add_accessor(w, view, 5126, n, "VEC3");
    json_object_set_new(attributes, "NORMAL", last_accessor(w));
    if (material_is_masked(material)) {
        view = add_view(w, s->uvs, n * sizeof *s->uvs, 34962);
        add_accessor(w, view, 5126, n, "VEC2");
        json_object_set_new(attributes, "TEXCOORD_0", last_accessor(w));
    }
    if (s->colors) {
        view = add_view(w, s->colors, n * sizeof *s->colors, 34962);
        json_object_set_new(add_accessor(w, view, 5121, n, "VEC4"), "normalized", json_true());
        json_object_set_new(attributes, "COLOR_0", last_accessor(w));
    }
    json_t *indices = add_indices(w, s);
    return json_pack("{s:o, s:o, s:i}", "attributes", attributes, "indices", indices, "material",
                     (int)material);
}

static json_t *meshes(struct writer *w)
{
    json_t *list = json_array();
    for (size_t i = 0; i < w->world->mesh_count; i++) {
        const struct mesh *mesh = &w->world->meshes[i];
        json_t *primitives = json_array();
        for (int m = 0; m < MATERIAL_COUNT; m++)
            if (mesh->surfaces[m].triangle_count)
                json_array_append_new(primitives,
                                      add_primitive(w, &mesh->surfaces[m], (enum material)m));
        json_array_append_new(
            list, json_pack("{s:s, s:o}", "name", mesh->name, "primitives", primitives));
    }
    return list;
}

static json_t *materials(void)
{
    static const struct {
        const char *name;
        double color[3], roughness;
        int texture;
    } rows[MATERIAL_COUNT] = {
        [MATERIAL_GROUND] = {"Ground", {1, 1, 1}, 1, -1},
        [MATERIAL_PLASTER] = {"Plaster", {0.80, 0.74, 0.63}, 0.95, -1},
        [MATERIAL_PLASTER_WARM] = {"Plaster_Warm", {0.78, 0.58, 0.38}, 0.95, -1},
        [MATERIAL_STONE] = {"Stone", {0.46, 0.42, 0.36}, 0.9, -1},
        [MATERIAL_WOOD] = {"Wood", {0.46, 0.27, 0.13}, 0.8, -1},
        [MATERIAL_WOOD_DARK] = {"Wood_Dark", {0.17, 0.09, 0.045}, 0.8, -1},
        [MATERIAL_TILE] = {"Roof_Tile", {0.52, 0.17, 0.09}, 0.85, -1},
        [MATERIAL_FLOOR] = {"Floor", {0.50, 0.33, 0.18}, 0.7, -1},
        [MATERIAL_WATER] = {"Water", {0.06, 0.15, 0.18}, 0.1, -1},
        [MATERIAL_IRON] = {"Iron", {0.08, 0.08, 0.085}, 0.5, -1},
        [MATERIAL_CLAY] = {"Clay", {0.56, 0.25, 0.14}, 0.75, -1},
        [MATERIAL_BARK] = {"Bark", {0.25, 0.17, 0.11}, 0.95, -1},
        [MATERIAL_OAK] = {"Foliage_Oak", {0.13, 0.24, 0.05}, 0.9, -1},
        [MATERIAL_PINE] = {"Foliage_Pine", {0.05, 0.14, 0.07}, 0.9, -1},
        [MATERIAL_SHRUB] = {"Foliage_Shrub", {0.20, 0.28, 0.07}, 0.9, -1},
        [MATERIAL_LEAVES] = {"Leaves", {1, 1, 1}, 0.9, TEXTURE_LEAVES},
        [MATERIAL_GRASS] = {"Grass", {1, 1, 1}, 0.9, TEXTURE_GRASS},
        [MATERIAL_FENCE] = {"Fence", {1, 1, 1}, 0.85, TEXTURE_FENCE},
    };
    json_t *list = json_array();
    for (int i = 0; i < MATERIAL_COUNT; i++) {
        const double *c = rows[i].color;
        json_t *surface =
            json_pack("{s:[f,f,f,f], s:f, s:f}", "baseColorFactor", c[0], c[1], c[2], 1.0,
                      "metallicFactor", 0.0, "roughnessFactor", rows[i].roughness);
        json_t *material = json_pack("{s:s}", "name", rows[i].name);
        if (rows[i].texture >= 0) {
            json_object_set_new(surface, "baseColorTexture",
                                json_pack("{s:i}", "index", rows[i].texture));
            json_object_set_new(material, "alphaMode", json_string("MASK"));
            json_object_set_new(material, "alphaCutoff", json_real(0.5));
            json_object_set_new(material, "doubleSided", json_true());
        }
        json_object_set_new(material, "pbrMetallicRoughness", surface);
        json_array_append_new(list, material);
    }
    return list;
}

static json_t *images(struct writer *w)
{
    static const char *const names[TEXTURE_COUNT] = {"Fence", "Leaves", "Grass"};
    json_t *list = json_array();
    for (int i = 0; i < TEXTURE_COUNT; i++) {
        size_t size = 0;
        uint8_t *png = texture_png((enum texture)i, &size);
        w->failed = w->failed || !png;
        if (png)
            json_array_append_new(list, json_pack("{s:s, s:s, s:I}", "name", names[i], "mimeType",
                                                  "image/png", "bufferView",
                                                  (json_int_t)add_view(w, png, size, 0)));
        free(png);
    }
    return list;
}

static json_t *add_vectors(struct writer *w, const void *data, size_t count, int components)
{
    const size_t view = add_view(w, data, count * (size_t)components * sizeof(float), 0);
    add_accessor(w, view, 5126, count, components == 4 ? "VEC4" : "VEC3");
    return last_accessor(w);
}

static json_t *scatter_json(struct writer *w, const struct scatter *s)
{
    json_t *translation = add_vectors(w, s->translations, s->count, 3);
    json_t *rotation = add_vectors(w, s->rotations, s->count, 4);
    json_t *size = add_vectors(w, s->scales, s->count, 3);
    return json_pack("{s:{s:o, s:o, s:o}}", "attributes", "TRANSLATION", translation, "ROTATION",
                     rotation, "SCALE", size);
}

/* The simpler levels, each to be shown below half the former's share of the screen. */
static void add_levels(const struct world *world, const struct node *n, json_t *extensions,
                       json_t *extras)
{
    json_t *ids = json_array(), *coverage = json_array();
    double share = 0.2;
    for (int lod = n->lod; lod >= 0; lod = world->nodes[lod].lod) {
        json_array_append_new(ids, json_integer(lod));
        json_array_append_new(coverage, json_real(share));
        share /= 4;
    }
    json_array_append_new(coverage, json_real(0.001));
    json_object_set_new(extensions, "MSFT_lod", json_pack("{s:o}", "ids", ids));
    json_object_set_new(extras, "MSFT_screencoverage", coverage);
}

static json_t *node_json(struct writer *w, const struct node *n)
{
    json_t *json = json_pack("{s:s}", "name", n->name);
    if (n->mesh >= 0)
        json_object_set_new(json, "mesh", json_integer(n->mesh));
    const double *t = n->translation, *r = n->rotation, *s = n->scale;
    if (t[0] != 0 || t[1] != 0 || t[2] != 0)
        json_object_set_new(json, "translation", json_pack("[f,f,f]", t[0], t[1], t[2]));
    if (r[1] != 0)
        json_object_set_new(json, "rotation", json_pack("[f,f,f,f]", r[0], r[1], r[2], r[3]));
    if (s[0] != 1 || s[1] != 1 || s[2] != 1)
        json_object_set_new(json, "scale", json_pack("[f,f,f]", s[0], s[1], s[2]));
    json_t *extensions = json_object(), *extras = json_object();
    if (n->lod >= 0 && !n->hidden)
        add_levels(w->world, n, extensions, extras);
    if (n->scatter.count)
        json_object_set_new(extensions, "EXT_mesh_gpu_instancing", scatter_json(w, &n->scatter));
    if (n->role)
        json_object_set_new(extras, "cranny_role", json_string(n->role));
    if (json_object_size(extensions))
        json_object_set(json, "extensions", extensions);
    if (json_object_size(extras))
        json_object_set(json, "extras", extras);
    json_decref(extensions);
    json_decref(extras);
    return json;
}

/* Looks along −z of the node: rotation from an orthonormal basis, as a quaternion. */
static json_t *camera_node(const struct view *view, int camera)
{
    struct vec back = unit(sub(view->eye, view->target));
    double yaw = atan2(back.x, back.z), pitch = -asin(back.y);
    double cy = cos(yaw / 2), sy = sin(yaw / 2), cp = cos(pitch / 2), sp = sin(pitch / 2);
    return json_pack("{s:s, s:i, s:[f,f,f], s:[f,f,f,f]}", "name", view->name, "camera", camera,
                     "translation", view->eye.x, view->eye.y, view->eye.z, "rotation", cy * sp,
                     sy * cp, -sy * sp, cy * cp);
}

static void add_nodes(struct writer *w, json_t *root)
{
    const struct world *world = w->world;
    json_t *nodes = json_array(), *roots = json_array(), *cameras = json_array();
    for (size_t i = 0; i < world->node_count; i++) {
        const struct node *n = &world->nodes[i];
        json_array_append_new(nodes, node_json(w, n));
        if (n->hidden)
            continue;
        json_t *parent = n->parent < 0 ? NULL : json_array_get(nodes, (size_t)n->parent);
        json_t *children = parent ? json_object_get(parent, "children") : roots;
        if (!children) {
            children = json_array();
            json_object_set_new(parent, "children", children);
        }
        json_array_append_new(children, json_integer((json_int_t)i));
    }
    for (int i = 0; i < VIEW_COUNT; i++) {
        const struct view *view = &world->views[i];
        json_array_append_new(roots, json_integer((json_int_t)json_array_size(nodes)));
        json_array_append_new(nodes, camera_node(view, i));
        json_array_append_new(cameras, json_pack("{s:s, s:s, s:{s:f, s:f, s:f}}", "name",
                                                 view->name, "type", "perspective", "perspective",
                                                 "yfov", view->fov_y * LEVEL_PI / 180, "znear",
                                                 0.05, "zfar", 500.0));
    }
    json_object_set_new(root, "scenes",
                        json_pack("[{s:s, s:o}]", "name", "Village", "nodes", roots));
    json_object_set_new(root, "nodes", nodes);
    json_object_set_new(root, "cameras", cameras);
}

static json_t *document(struct writer *w)
{
    json_t *root = json_pack("{s:{s:s, s:s}, s:i, s:[s, s]}", "asset", "version", "2.0",
                             "generator", "cranny-level", "scene", 0, "extensionsUsed",
                             "EXT_mesh_gpu_instancing", "MSFT_lod");
    add_nodes(w, root);
    json_object_set_new(root, "materials", materials());
    json_t *textures = json_array();
    for (int i = 0; i < TEXTURE_COUNT; i++)
        json_array_append_new(textures, json_pack("{s:i, s:i}", "sampler", i ? 1 : 0, "source", i));
    json_object_set_new(root, "textures", textures);
    json_object_set_new(root, "images", images(w));
    json_object_set_new(root, "samplers",
                        json_pack("[{s:i, s:i, s:i, s:i}, {s:i, s:i, s:i, s:i}]", "magFilter", 9729,
                                  "minFilter", 9987, "wrapS", 10497, "wrapT", 33071, "magFilter",
                                  9729, "minFilter", 9987, "wrapS", 33071, "wrapT", 33071));
    json_object_set_new(root, "meshes", meshes(w));
    json_object_set(root, "accessors", w->accessors);
    json_object_set(root, "bufferViews", w->views);
    json_object_set_new(root, "buffers",
                        json_pack("[{s:I}]", "byteLength", (json_int_t)w->bin.size));
    return root;
}

static void put32(uint8_t *at, size_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (8 * i));
}

static uint8_t *assemble(const char *text, const struct bytes *bin, size_t *size)
{
    size_t length = strlen(text), json = (length + 3) / 4 * 4, chunk = (bin->size + 3) / 4 * 4;
    *size = 12 + 8 + json + 8 + chunk;
    uint8_t *file = *size <= UINT32_MAX ? calloc(1, *size) : NULL;
    if (!file)
        return NULL;
    memcpy(file, "glTF", 4);
    put32(file + 4, 2);
    put32(file + 8, *size);
    put32(file + 12, json);
    memcpy(file + 16, "JSON", 4);
    memcpy(file + 20, text, length);
    memset(file + 20 + length, ' ', json - length);
    put32(file + 20 + json, chunk);
    memcpy(file + 24 + json, "BIN\0", 4);
    memcpy(file + 28 + json, bin->data, bin->size);
    return file;
}

uint8_t *glb_encode(const struct world *world, size_t *size)
{
    struct writer w = {.world = world, .views = json_array(), .accessors = json_array()};
    json_t *root = document(&w);
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(9)) : NULL;
    uint8_t *file = text && !w.failed ? assemble(text, &w.bin, size) : NULL;
    free(text);
    json_decref(root);
    json_decref(w.views);
    json_decref(w.accessors);
    free(w.bin.data);
    return file;
}
