#include "scene/import.h"

#include "scene/document_parts.h"

#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <strings.h>

static void set_accessor(struct builder *builder, json_t *attributes, const char *name,
                         size_t accessor)
{
    builder_set(builder, attributes, name, json_integer((json_int_t)accessor));
}

/* glTF wants unit normals. */
static bool add_normals(struct builder *builder, const struct aiMesh *mesh, json_t *attributes)
{
    float(*normals)[3] = alloc_array(mesh->mNumVertices, sizeof *normals);
    for (unsigned i = 0; normals && i < mesh->mNumVertices; i++) {
        const struct aiVector3D n = mesh->mNormals[i];
        const float length = sqrtf(n.x * n.x + n.y * n.y + n.z * n.z);
        const bool good = isfinite(length) && length > 0;
        normals[i][0] = good ? n.x / length : 0;
        normals[i][1] = good ? n.y / length : 1;
        normals[i][2] = good ? n.z / length : 0;
    }
    if (normals)
        set_accessor(builder, attributes, "NORMAL",
                     builder_floats(builder, &normals[0][0], mesh->mNumVertices, 3, false));
    free(normals);
    return normals;
}

static bool add_texcoords(struct builder *builder, const struct aiMesh *mesh, int set,
                          json_t *attributes)
{
    char name[32];
    float(*texcoords)[2] = alloc_array(mesh->mNumVertices, sizeof *texcoords);
    for (unsigned i = 0; texcoords && i < mesh->mNumVertices; i++) {
        texcoords[i][0] = mesh->mTextureCoords[set][i].x;
        texcoords[i][1] = mesh->mTextureCoords[set][i].y;
    }
    snprintf(name, sizeof name, "TEXCOORD_%d", set);
    if (texcoords)
        set_accessor(builder, attributes, name,
                     builder_floats(builder, &texcoords[0][0], mesh->mNumVertices, 2, false));
    free(texcoords);
    return texcoords;
}

static bool add_colors(struct builder *builder, const struct aiMesh *mesh, json_t *attributes)
{
    float(*colors)[4] = alloc_array(mesh->mNumVertices, sizeof *colors);
    for (unsigned i = 0; colors && i < mesh->mNumVertices; i++) {
        const struct aiColor4D c = mesh->mColors[0][i];
        const float rgba[4] = {c.r, c.g, c.b, c.a};
        for (int k = 0; k < 4; k++)
            colors[i][k] = isfinite(rgba[k]) ? clamp_float(rgba[k], 0, 1) : 1;
    }
    if (colors)
        set_accessor(builder, attributes, "COLOR_0",
                     builder_floats(builder, &colors[0][0], mesh->mNumVertices, 4, false));
    free(colors);
    return colors;
}

/* Corners per face: meshes are sorted by kind, so that all faces have the same. */
static unsigned corners_of(const struct aiMesh *mesh)
{
    return mesh->mPrimitiveTypes & aiPrimitiveType_TRIANGLE ? 3
           : mesh->mPrimitiveTypes & aiPrimitiveType_LINE   ? 2
           : mesh->mPrimitiveTypes & aiPrimitiveType_POINT  ? 1
                                                            : 0;
}

static bool add_indices(struct builder *builder, const struct aiMesh *mesh, json_t *primitive)
{
    const unsigned corners = corners_of(mesh);
    uint32_t *indices = alloc_array(mesh->mNumFaces, corners * sizeof *indices);
    size_t count = 0;
    for (unsigned f = 0; indices && f < mesh->mNumFaces; f++)
        if (mesh->mFaces[f].mNumIndices == corners)
            for (unsigned c = 0; c < corners; c++)
                indices[count++] = mesh->mFaces[f].mIndices[c];
    if (count)
        set_accessor(builder, primitive, "indices", builder_indices(builder, indices, count));
    free(indices);
    return indices;
}

/* The primitive of an assimp mesh, or NULL when it shows nothing. */
static enum cranny_status import_primitive(struct import *import, const struct aiMesh *mesh,
                                           json_t **primitive, struct cranny_error *why)
{
    static const int modes[] = {0, 0, 1, 4};
    struct builder *builder = &import->builder;
    const unsigned corners = corners_of(mesh);
    *primitive = NULL;
    if (!mesh->mNumVertices || !mesh->mNumFaces || !corners)
        return CRANNY_OK;
    enum cranny_status status = document_reserve(
        &import->place, (uint64_t)mesh->mNumVertices * 64 + (uint64_t)mesh->mNumFaces * 12,
        "the scene", why);
    if (status != CRANNY_OK)
        return status;
    json_t *attributes = json_object();
    *primitive = json_object();
    builder_set(builder, *primitive, "attributes", attributes);
    set_accessor(builder, attributes, "POSITION",
                 builder_floats(builder, &mesh->mVertices[0].x, mesh->mNumVertices, 3, true));
    bool good = !mesh->mNormals || add_normals(builder, mesh, attributes);
    for (int set = 0; good && set < AI_MAX_NUMBER_OF_TEXTURECOORDS && mesh->mTextureCoords[set];
         set++)
        good = add_texcoords(builder, mesh, set, attributes);
    if (good && mesh->mColors[0])
        good = add_colors(builder, mesh, attributes);
    good = good && add_indices(builder, mesh, *primitive);
    if (mesh->mMaterialIndex < import->scene->mNumMaterials)
        set_accessor(builder, *primitive, "material", mesh->mMaterialIndex);
    if (corners != 3)
        set_accessor(builder, *primitive, "mode", (size_t)modes[corners]);
    return good ? CRANNY_OK : fail_memory(why, "mesh");
}

static enum cranny_status import_primitives(struct import *import, struct cranny_error *why)
{
    const unsigned count = import->scene->mNumMeshes;
    import->meshes = alloc_array(count, sizeof *import->meshes);
    import->primitives = alloc_array(count, sizeof *import->primitives);
    if (!import->meshes || !import->primitives)
        return fail_memory(why, "meshes");
    enum cranny_status status = CRANNY_OK;
    bool moving = import->scene->mNumAnimations > 0;
    for (unsigned i = 0; status == CRANNY_OK && i < count; i++) {
        import->meshes[i] = SIZE_MAX;
        moving = moving || import->scene->mMeshes[i]->mNumBones;
        status = import_primitive(import, import->scene->mMeshes[i], &import->primitives[i], why);
    }
    if (moving)
        hook_warn(import->place.hooks,
                  "%s: skins and animations are not carried over; the stored pose is used",
                  import->place.path);
    return status;
}

/* The glTF mesh of a node; SIZE_MAX: none. Nodes that show one mesh share it. */
static size_t node_mesh(struct import *import, const struct aiNode *node)
{
    struct builder *builder = &import->builder;
    const unsigned first = node->mNumMeshes ? node->mMeshes[0] : 0;
    if (node->mNumMeshes == 1 && import->meshes[first] != SIZE_MAX)
        return import->meshes[first];
    json_t *primitives = json_array();
    for (unsigned i = 0; i < node->mNumMeshes; i++)
        if (import->primitives[node->mMeshes[i]])
            json_array_append_new(primitives, json_deep_copy(import->primitives[node->mMeshes[i]]));
    if (!json_array_size(primitives)) {
        json_decref(primitives);
        return SIZE_MAX;
    }
    json_t *mesh = json_object();
    builder_name(builder, mesh, import->scene->mMeshes[first]->mName.data);
    builder_set(builder, mesh, "primitives", primitives);
    const size_t index = builder_append(builder, "meshes", mesh);
    if (node->mNumMeshes == 1)
        import->meshes[first] = index;
    return index;
}

static void to_rows(const struct aiMatrix4x4 *m, double rows[12])
{
    const float *entries = &m->a1;
    for (int i = 0; i < 12; i++)
        rows[i] = (double)entries[i];
}

static bool metadata(const struct aiScene *scene, const char *key, double *value)
{
    const struct aiMetadata *data = scene->mMetaData;
    for (unsigned i = 0; data && i < data->mNumProperties; i++) {
        if (strcmp(data->mKeys[i].data, key) != 0)
            continue;
        const void *entry = data->mValues[i].mData;
        if (data->mValues[i].mType == AI_INT32)
            *value = *(const int32_t *)entry;
        else if (data->mValues[i].mType == AI_FLOAT)
            *value = (double)*(const float *)entry;
        else if (data->mValues[i].mType == AI_DOUBLE)
            *value = *(const double *)entry;
        else
            return false;
        return true;
    }
    return false;
}

/* FBX states its axes (for glTF's x, y and z: "coord", "up", "front") and its unit in
 * centimetres; assimp 5.2 hands both on without applying them. */
static void apply_fbx_space(const struct aiScene *scene, double root[12])
{
    static const char *const names[3][2] = {
        {"CoordAxis", "CoordAxisSign"}, {"UpAxis", "UpAxisSign"}, {"FrontAxis", "FrontAxisSign"}};
    static const double identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    double space[12] = {0}, unit, axis, sign;
    if (!metadata(scene, "UnitScaleFactor", &unit) || !(unit > 0) || !isfinite(unit))
        return;
    /* A root that is turned or scaled already shows a newer assimp: it leaves centimetres. */
    const bool applied = memcmp(root, identity, sizeof identity) != 0;
    const double scale = 0.01 * (applied ? 1 : unit);
    for (int i = 0; i < 3; i++) {
        const bool known = !applied && metadata(scene, names[i][0], &axis) &&
                           metadata(scene, names[i][1], &sign) && axis >= 0 && axis <= 2;
        space[4 * i + (known ? (int)axis : i)] = known && sign < 0 ? -scale : scale;
    }
    if (!(transform_determinant(space) > 0)) {
        memcpy(space, identity, sizeof space);
        space[0] = space[5] = space[10] = scale;
    }
    transform_multiply(space, root, root);
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static bool normalize(double v[3])
{
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return isfinite(length) && length > 0;
}

/* Columns right, up, back, place: glTF's cameras look down −Z. */
static bool camera_matrix(const struct aiCamera *camera, double rows[12])
{
    double back[3] = {-(double)camera->mLookAt.x, -(double)camera->mLookAt.y,
                      -(double)camera->mLookAt.z};
    double up[3] = {(double)camera->mUp.x, (double)camera->mUp.y, (double)camera->mUp.z}, right[3];
    const double place[3] = {(double)camera->mPosition.x, (double)camera->mPosition.y,
                             (double)camera->mPosition.z};
    bool good = normalize(back);
    cross(up, back, right);
    good = normalize(right) && good;
    cross(back, right, up);
    for (int i = 0; i < 3; i++) {
        const double row[4] = {right[i], up[i], back[i], place[i]};
        memcpy(rows + 4 * i, row, sizeof row);
    }
    return good;
}

static json_t *camera_object(const struct aiCamera *camera)
{
    const double aspect = camera->mAspect > 0 ? (double)camera->mAspect : 16.0 / 9;
    double near_plane = (double)camera->mClipPlaneNear, half = (double)camera->mOrthographicWidth;
    near_plane = near_plane > 1e-6 && isfinite(near_plane) ? near_plane : 0.01;
    if (half > 0)
        return json_pack("{s:s, s:{s:f, s:f, s:f, s:f}}", "type", "orthographic", "orthographic",
                         "xmag", half, "ymag", half / aspect, "zfar", near_plane + 1000, "znear",
                         near_plane);
    const double wide = fmin(fmax((double)camera->mHorizontalFOV, 0.02), 3.1);
    return json_pack("{s:s, s:{s:f, s:f, s:f}}", "type", "perspective", "perspective",
                     "aspectRatio", aspect, "yfov", 2 * atan(tan(wide / 2) / aspect), "znear",
                     near_plane);
}

/* Cameras hang below the node of their name. */
static void import_cameras(struct import *import, const struct aiNode *node, json_t *children)
{
    struct builder *builder = &import->builder;
    for (unsigned i = 0; i < import->scene->mNumCameras; i++) {
        const struct aiCamera *camera = import->scene->mCameras[i];
        double rows[12];
        if (strcmp(camera->mName.data, node->mName.data) != 0 || !camera_matrix(camera, rows))
            continue;
        json_t *object = camera_object(camera), *place = builder_node(builder, NULL, rows);
        if (object)
            builder_name(builder, object, camera->mName.data);
        set_accessor(builder, place, "camera", builder_append(builder, "cameras", object));
        json_array_append_new(children,
                              json_integer((json_int_t)builder_append(builder, "nodes", place)));
    }
}

/* User properties of FBX and others that say what glTF's extras would. */
static void import_role(struct builder *builder, const struct aiNode *node, json_t *object)
{
    const struct aiMetadata *data = node->mMetaData;
    for (unsigned i = 0; data && i < data->mNumProperties; i++) {
        if (strcmp(data->mKeys[i].data, "cranny_role") != 0 ||
            data->mValues[i].mType != AI_AISTRING)
            continue;
        const struct aiString *word = data->mValues[i].mData;
        builder_set(builder, object, "extras",
                    json_pack("{s:s%}", "cranny_role", word->data,
                              (size_t)strnlen(word->data, word->length)));
        return;
    }
}

/* A node still to be made, and the list that will name it. */
struct pending {
    const struct aiNode *node;
    json_t *siblings;
};

static bool import_node(struct import *import, struct pending **queue, size_t *count,
                        size_t *capacity, size_t at)
{
    struct builder *builder = &import->builder;
    const struct aiNode *node = (*queue)[at].node;
    if (!grow_array((void **)queue, capacity, *count + node->mNumChildren, sizeof **queue))
        return false;
    double rows[12];
    to_rows(&node->mTransformation, rows);
    if (at == 0)
        apply_fbx_space(import->scene, rows);
    json_t *object = builder_node(builder, node->mName.data, rows), *children = json_array();
    import_role(builder, node, object);
    const size_t mesh = node_mesh(import, node);
    if (mesh != SIZE_MAX)
        set_accessor(builder, object, "mesh", mesh);
    const size_t index = builder_append(builder, "nodes", object);
    json_array_append_new((*queue)[at].siblings, json_integer((json_int_t)index));
    import_cameras(import, node, children);
    for (unsigned i = 0; i < node->mNumChildren; i++)
        (*queue)[(*count)++] = (struct pending){node->mChildren[i], children};
    if (node->mNumChildren || json_array_size(children))
        builder_set(builder, object, "children", children);
    else
        json_decref(children);
    return true;
}

/* Breadth first, without recursion: a hostile file nests as deep as it likes. */
static enum cranny_status import_nodes(struct import *import, struct cranny_error *why)
{
    struct builder *builder = &import->builder;
    struct pending *queue = NULL;
    size_t count = 0, capacity = 0;
    json_t *roots = json_array(), *scene = json_object();
    builder_set(builder, scene, "nodes", roots);
    bool good = grow_array((void **)&queue, &capacity, 1, sizeof *queue);
    if (good && import->scene->mRootNode)
        queue[count++] = (struct pending){import->scene->mRootNode, roots};
    for (size_t at = 0; good && at < count; at++)
        good = import_node(import, &queue, &count, &capacity, at);
    free(queue);
    if (!json_array_size(roots))
        json_object_del(scene, "nodes");
    builder_append(builder, "scenes", scene);
    builder_set(builder, builder->root, "scene", json_integer(0));
    return good ? CRANNY_OK : fail_memory(why, "nodes");
}

static enum cranny_status convert(struct import *import, struct document **document,
                                  struct cranny_error *why)
{
    builder_begin(&import->builder);
    enum cranny_status status = import_materials(import, why);
    if (status == CRANNY_OK)
        status = import_primitives(import, why);
    if (status == CRANNY_OK)
        status = import_nodes(import, why);
    for (unsigned i = 0; import->primitives && i < import->scene->mNumMeshes; i++)
        json_decref(import->primitives[i]);
    free(import->primitives);
    free(import->meshes);
    if (status != CRANNY_OK) {
        builder_free(&import->builder);
        return status;
    }
    status = builder_finish(&import->builder, import->place.path, import->place.memory_limit,
                            document, why);
    if (status == CRANNY_OK)
        (*document)->hooks = import->place.hooks;
    return status;
}

/* assimp's PLY reader counts to whatever the header says, past the end of the file. */
static enum cranny_status check_ply(const char *path, FILE *file, long size,
                                    struct cranny_error *why)
{
    char line[256], magic[4] = {0};
    rewind(file);
    if (fread(magic, 1, 3, file) != 3 || memcmp(magic, "ply", 3) != 0)
        return CRANNY_OK;
    while (fgets(line, sizeof line, file) && strncmp(line, "end_header", 10) != 0) {
        unsigned long long count;
        if (sscanf(line, " element %*s %llu", &count) == 1 && count > (unsigned long long)size)
            return fail(why, CRANNY_INPUT, "%s: its header promises %llu elements in %ld bytes",
                        path, count, size);
    }
    return CRANNY_OK;
}

static enum cranny_status check_file(const char *path, uint64_t memory_limit,
                                     struct cranny_error *why)
{
    const char *dot = strrchr(path, '.');
    FILE *file = fopen(path, "rbe");
    if (!file)
        return fail(why, CRANNY_INPUT, "%s: cannot be opened: %m", path);
    char magic[4] = {0};
    const size_t got = fread(magic, 1, 4, file);
    const bool unreadable = ferror(file);
    const long size = fseek(file, 0, SEEK_END) == 0 ? ftell(file) : 0;
    enum cranny_status status = unreadable ? CRANNY_OK : check_ply(path, file, size, why);
    fclose(file);
    if (status != CRANNY_OK)
        return status;
    if (unreadable)
        return fail(why, CRANNY_INPUT, "%s: cannot be read; is it a folder?", path);
    if (!got)
        return fail(why, CRANNY_INPUT, "%s: the file is empty", path);
    if (memcmp(magic, "glTF", 4) == 0 ||
        (dot && (strcasecmp(dot, ".gltf") == 0 || strcasecmp(dot, ".glb") == 0)))
        return fail(why, CRANNY_INPUT, "%s: not a readable glTF file", path);
    if (size > 0 && (uint64_t)size > memory_limit)
        return fail(why, CRANNY_MEMORY, "%s: %ld bytes are more than the memory limit", path, size);
    return CRANNY_OK;
}

enum cranny_status document_import(const char *path, bool allow_outside, uint64_t memory_limit,
                                   const struct cranny_hooks *hooks, struct document **document,
                                   struct cranny_error *why)
{
    *document = NULL;
    enum cranny_status status = check_file(path, memory_limit, why);
    struct import import = {.place = {.path = copy_text(path),
                                      .allow_outside = allow_outside,
                                      .memory_limit = memory_limit,
                                      .hooks = hooks}};
    if (status == CRANNY_OK && !import.place.path)
        status = fail_memory(why, path);
    if (status != CRANNY_OK) {
        free(import.place.path);
        return status;
    }
    struct import_files files;
    import_files_begin(&files, &import.place);
    struct aiPropertyStore *properties = aiCreatePropertyStore();
    aiSetImportPropertyInteger(properties, AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, 0);
    import.scene = aiImportFileExWithProperties(
        path,
        aiProcess_Triangulate | aiProcess_JoinIdenticalVertices | aiProcess_SortByPType |
            aiProcess_FlipUVs | aiProcess_TransformUVCoords | aiProcess_ValidateDataStructure,
        &files.io, properties);
    status = import.scene
                 ? convert(&import, document, why)
                 : fail(why, CRANNY_INPUT, "%s: cannot be read: %s", path, aiGetErrorString());
    if (import.scene)
        aiReleaseImport(import.scene);
    aiReleasePropertyStore(properties);
    free(import.place.path);
    return status;
}
