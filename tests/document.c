/* glTF containers, URIs, and that saving without values changes nothing. */
#include "check.h"
#include "scene_files.h"

#include "scene/document.h"
#include "scene/document_parts.h"
#include "scene/scene.h"

#include <cranny/bake.h>

static struct cranny_error why;
static char *folder;

static const char *in_folder(const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static enum cranny_status parse(const void *data, size_t size, struct document **document)
{
    uint8_t *copy = malloc(size + 1);
    memcpy(copy, data, size);
    why.message[0] = 0;
    return document_parse(copy, size, "test", true, false, 1u << 26, NULL, document, &why);
}

/* `text` must be refused with `status` and a message that holds `words`. */
static void refuse(const void *data, size_t size, enum cranny_status status, const char *words)
{
    struct document *document = (struct document *)1;
    const enum cranny_status got = parse(data, size, &document);
    CHECK_MSG(got == status && !document && strstr(why.message, words) &&
                  !strchr(why.message, '\n'),
              "'%s' wanted, got %d: '%s'", words, (int)got, why.message);
    if (got == CRANNY_OK)
        document_destroy(&document);
}

#define REFUSE(text, words) refuse(text, strlen(text), CRANNY_INPUT, words)

static void test_json(void)
{
    REFUSE("", "empty");
    REFUSE("  \n", "empty");
    REFUSE("solid x", "neither");
    REFUSE("{\"asset\":", "line 1");
    REFUSE("{\"asset\":{\"version\":\"2.0\"},\"asset\":{}}", "duplicate");
    REFUSE("{}", "/asset");
    REFUSE("{\"asset\":{\"version\":2.0}}", "/asset/version");
    REFUSE("{\"asset\":{\"version\":\"1.0\"}}", "glTF 1.0");
    REFUSE("{\"asset\":{\"version\":\"3.0\"}}", "glTF 3.0");
    REFUSE("{\"asset\":{\"version\":\"2.0\",\"minVersion\":\"2.1\"}}", "2.1");
    REFUSE("{\"asset\":{\"version\":\"2.0\"},\"meshes\":{}}", "/meshes");
    REFUSE("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{},3]}", "/nodes/1");
    REFUSE("{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":[\"EXT_twisted_space\"]}",
           "EXT_twisted_space");
    struct document *document;
    const char *fine = "\xef\xbb\xbf{\"asset\":{\"version\":\"2.0\"},\"extensionsRequired\":"
                       "[\"KHR_materials_unlit\",\"KHR_mesh_quantization\"],\"n\":\"a\\u0000b\"}";
    CHECK_OK(parse(fine, strlen(fine), &document), why);
    CHECK_INT(document->indent, 0);
    document_destroy(&document);
    size_t depth = 100000, size = 2 * depth;
    char *deep = malloc(size);
    memset(deep, '[', size);
    memcpy(deep, "{\"a\":", 5);
    refuse(deep, size, CRANNY_INPUT, "JSON");
    free(deep);
    /* Two bytes of text must not become gigabytes of tree. */
    size = 1u << 20;
    char *wide = malloc(size);
    for (size_t i = 0; i < size; i++)
        wide[i] = "[],"[i % 3];
    memcpy(wide, "{\"a\":[", 6);
    refuse(wide, size, CRANNY_MEMORY, "JSON tree");
    free(wide);
}

static size_t put(uint8_t *file, size_t at, uint32_t value)
{
    memcpy(file + at, &value, 4);
    return at + 4;
}

static size_t put_chunk(uint8_t *file, size_t at, uint32_t type, const char *data, uint32_t size)
{
    at = put(file, put(file, at, size), type);
    memcpy(file + at, data, size);
    return at + size;
}

/* JSON padded to 44 bytes, a BIN chunk of 8, a foreign chunk of 4. */
static const char glb_json[] =
    "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":7}]} ";

static size_t make_glb(uint8_t *file)
{
    size_t at = put(file, put(file, put(file, 0, GLB_MAGIC), 2), 0);
    at = put_chunk(file, at, GLB_JSON, glb_json, sizeof glb_json - 1);
    at = put_chunk(file, at, GLB_BIN, "abcdefgh", 8);
    at = put_chunk(file, at, 0x58585858, "what", 4);
    put(file, 8, (uint32_t)at);
    return at;
}

static void test_glb(void)
{
    uint8_t file[512], bad[512];
    struct document *document;
    const uint8_t *data;
    size_t size = make_glb(file), there;
    CHECK_OK(parse(file, size, &document), why);
    CHECK_OK(document_buffer(document, 0, &data, &there, &why), why);
    CHECK(there >= 7 && memcmp(data, "abcdefg", 7) == 0);
    CHECK(document_buffer(document, 1, &data, &there, &why) == CRANNY_INPUT && !data);
    struct document_edit edit;
    size_t view;
    CHECK_OK(document_edit_begin(document, &edit, &why), why);
    CHECK_OK(document_edit_append(&edit, "xyz", 3, 34962, 0, &view, &why), why);
    CHECK_OK(document_edit_append(&edit, "12345", 5, 0, 0, &view, &why), why);
    CHECK_INT(view, 1);
    CHECK_OK(document_edit_save(document, &edit, in_folder("edited.glb"), &why), why);
    CHECK(document_edit_save(document, &edit, in_folder("edited.obj"), &why) == CRANNY_USAGE);
    document_edit_free(&edit);
    document_destroy(&document);
    CHECK_OK(document_load(in_folder("edited.glb"), false, 1u << 20, NULL, &document, &why), why);
    CHECK_OK(document_buffer(document, 0, &data, &there, &why), why);
    CHECK_INT(document->file_size % 4, 0);
    CHECK(there >= 37 && memcmp(data, "abcdefgh\0\0\0\0\0\0\0\0xyz", 19) == 0 &&
          memcmp(data + 32, "12345", 5) == 0);
    CHECK(document->file_size > 12 &&
          memcmp(document->file + document->file_size - 8, "XXXXwhat", 8) == 0);
    document_destroy(&document);
    for (size_t cut = 1; cut < size; cut++) {
        memcpy(bad, file, size);
        if (cut >= 4)
            refuse(bad, cut, CRANNY_INPUT, cut < 12 ? "header" : "truncated");
        if (cut < 12)
            continue;
        put(bad, 8, (uint32_t)cut);
        document = NULL;
        if (parse(bad, cut, &document) == CRANNY_OK)
            CHECK_MSG(cut == size - 12 || cut == size - 12 - 16, "cut at %zu is taken", cut);
        document_destroy(&document);
    }
    memcpy(bad, file, size);
    put(bad, 4, 1);
    refuse(bad, size, CRANNY_INPUT, "1.0");
    memcpy(bad, file, size);
    put(bad, 12, 0xffffffffu);
    refuse(bad, size, CRANNY_INPUT, "chunk");
    memcpy(bad, file, size);
    put(bad, 16, GLB_BIN);
    refuse(bad, size, CRANNY_INPUT, "JSON");
    memcpy(bad, file, size);
    put(bad, size - 8, GLB_BIN);
    refuse(bad, size, CRANNY_INPUT, "second BIN");
}

/* What buffer 0 holds when its uri is `uri`, in a file in the throwaway folder. */
static enum cranny_status read_uri(const char *uri, bool in_memory, bool allow_outside,
                                   uint64_t length, char out[64])
{
    struct document *document;
    char text[1024];
    const uint8_t *data;
    size_t size;
    snprintf(text, sizeof text,
             "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%llu,\"uri\":\"%s\"}]}",
             (unsigned long long)length, uri);
    CHECK_OK(document_parse((uint8_t *)strdup(text), strlen(text), in_folder("in/scene.gltf"),
                            in_memory, allow_outside, 1u << 26, NULL, &document, &why),
             why);
    const enum cranny_status status = document_buffer(document, 0, &data, &size, &why);
    CHECK((status == CRANNY_OK) == (data != NULL));
    out[0] = 0;
    if (status == CRANNY_OK)
        snprintf(out, 64, "%.*s", (int)size, (const char *)data);
    document_destroy(&document);
    return status;
}

static void accept_uri(const char *uri, const char *content)
{
    char out[64];
    const enum cranny_status status = read_uri(uri, false, false, 1, out);
    CHECK_MSG(status == CRANNY_OK && strcmp(out, content) == 0, "%s: '%s' %s", uri, out,
              why.message);
}

static void refuse_uri(const char *uri, const char *words)
{
    char out[64];
    why.message[0] = 0;
    const enum cranny_status status = read_uri(uri, false, false, 1, out);
    CHECK_MSG(status == CRANNY_INPUT && strstr(why.message, words), "%s: '%s' %s", uri, out,
              why.message);
}

static void write_text(const char *name, const char *text)
{
    CHECK_OK(cranny_file_write(in_folder(name), text, strlen(text), &why), why);
}

static void test_uris(void)
{
    char out[64], absolute[600];
    make_folder(in_folder("in"));
    make_folder(in_folder("in/sub"));
    write_text("secret.bin", "secret");
    write_text("in/a b.bin", "spaces");
    write_text("in/sub/\xc3\xa4.bin", "unicode");
    write_text("in/100%.bin", "percent");
    write_text("in/%41.bin", "raw");
    char target[600];
    snprintf(target, sizeof target, "%s", in_folder("secret.bin"));
    CHECK(symlink(target, in_folder("in/link.bin")) == 0);
    accept_uri("a%20b.bin", "spaces");
    accept_uri("a b.bin", "spaces");
    accept_uri("./sub/../a%20b.bin", "spaces");
    accept_uri("sub/%C3%A4.bin", "unicode");
    accept_uri("sub/\xc3\xa4.bin", "unicode");
    accept_uri("sub\\\\%C3%A4.bin", "unicode");
    accept_uri("100%.bin", "percent");
    accept_uri("%41.bin", "raw");
    refuse_uri("../secret.bin", "leaves");
    refuse_uri("%2e%2E/secret.bin", "leaves");
    refuse_uri("sub/../../secret.bin", "leaves");
    refuse_uri("..\\\\secret.bin", "leaves");
    refuse_uri("link.bin", "leaves");
    refuse_uri(target, "absolute");
    refuse_uri("https://example.org/a.bin", "scheme");
    refuse_uri("file:///etc/passwd", "scheme");
    refuse_uri("a%00b", "zero byte");
    refuse_uri("sub", "not a file");
    refuse_uri("missing.bin", "cannot be opened");
    refuse_uri("", "empty");
    CHECK(read_uri("a%20b.bin", true, false, 1, out) == CRANNY_INPUT);
    CHECK_OK(read_uri("../secret.bin", false, true, 1, out), why);
    CHECK(strcmp(out, "secret") == 0);
    snprintf(absolute, sizeof absolute, "%s", target);
    CHECK_OK(read_uri(absolute, false, true, 1, out), why);
    CHECK_OK(read_uri("link.bin", false, true, 1, out), why);
}

static void test_data_uris(void)
{
    char out[64];
    accept_uri("data:application/octet-stream;base64,aGVsbG8=", "hello");
    accept_uri("DATA:;BASE64,aGVsbG8", "hello");
    accept_uri("data:;base64,aGVs\\nbG8%3D", "hello");
    accept_uri("data:text/plain,he%6clo", "hello");
    refuse_uri("data:;base64,aGVsbG8==", "base64");
    refuse_uri("data:;base64,aGVsb", "base64");
    refuse_uri("data:;base64,aGV=sbG8", "base64");
    refuse_uri("data:;base64,aG-sbG8=", "base64");
    refuse_uri("data:;base64", "comma");
    CHECK(read_uri("data:;base64,aGVsbG8=", true, false, 6, out) == CRANNY_INPUT);
    CHECK_OK(read_uri("data:;base64,aGVsbG8=", true, false, 5, out), why);
    for (size_t size = 0; size < 20; size++) {
        struct document *document;
        const char *empty = "{\"asset\":{\"version\":\"2.0\"}}";
        const struct file_part parts[] = {{"abcdefghijklmnopqrst", size / 2},
                                          {&"abcdefghijklmnopqrst"[size / 2], size - size / 2}};
        char *uri = uri_encode_data("x/y", parts, 2);
        uint8_t *data = NULL;
        size_t back = 0;
        CHECK_OK(parse(empty, strlen(empty), &document), why);
        CHECK_OK(uri_decode_data(document, uri, "x", &data, &back, &why), why);
        CHECK(back == size && memcmp(data, "abcdefghijklmnopqrst", size) == 0);
        document_destroy(&document);
        free(uri);
        free(data);
    }
}

static void test_numbers(void)
{
    char out[64];
    const char *lengths[] = {"-1", "1.5", "\"3\"", "18446744073709551615", "1e300"};
    for (size_t i = 0; i < COUNT_OF(lengths); i++) {
        struct document *document = NULL;
        char text[256];
        const uint8_t *data;
        size_t size;
        snprintf(text, sizeof text,
                 "{\"asset\":{\"version\":\"2.0\"},\"buffers\":[{\"byteLength\":%s,"
                 "\"uri\":\"data:,abc\"}]}",
                 lengths[i]);
        if (parse(text, strlen(text), &document) == CRANNY_OK)
            CHECK(document_buffer(document, 0, &data, &size, &why) == CRANNY_INPUT);
        else
            CHECK(why.status == CRANNY_INPUT);
        document_destroy(&document);
    }
    CHECK(read_uri("data:,abc", true, false, 4000000000u, out) == CRANNY_INPUT);
}

/* A .gltf with files beside it goes into another folder with them, or into a .glb without. */
static void test_moving(void)
{
    struct document *document;
    struct document_edit edit;
    const uint8_t *data;
    uint8_t *owned;
    size_t size, view;
    make_folder(in_folder("move"));
    make_folder(in_folder("move/t"));
    make_folder(in_folder("other"));
    write_text("move/a b.bin", "0123456789");
    write_text("move/second.bin", "second");
    write_text("move/t/i.png", "image");
    write_text("move/s.gltf",
               "{\n  \"asset\": {\"version\": \"2.0\"}, \"x\": 0.1, \"buffers\": [{\"byteLength\": "
               "10, \"uri\": \"a%20b.bin\"}, {\"uri\": \"second.bin\", \"byteLength\": 6}],\n"
               "  \"images\": [{\"uri\": \"t/i.png\"}, {\"uri\": \"gone.png\"}]}");
    CHECK_OK(document_load(in_folder("move/s.gltf"), false, 1u << 20, NULL, &document, &why), why);
    CHECK_INT(document->indent, 2);
    for (int kind = 0; kind < 2; kind++) {
        struct document *back;
        const char *name = kind ? "other/out.glb" : "other/out.gltf";
        CHECK_OK(document_edit_begin(document, &edit, &why), why);
        CHECK_OK(document_edit_append(&edit, "appended", 8, 0, 0, &view, &why), why);
        CHECK_OK(document_edit_save(document, &edit, in_folder(name), &why), why);
        document_edit_free(&edit);
        CHECK_OK(document_load(in_folder(name), false, 1u << 20, NULL, &back, &why), why);
        CHECK_OK(document_buffer(back, 0, &data, &size, &why), why);
        CHECK(size >= 10 && memcmp(data, "0123456789", 10) == 0);
        const json_t *first = json_array_get(json_object_get(back->root, "bufferViews"), 0);
        const size_t buffer = (size_t)json_integer_value(json_object_get(first, "buffer"));
        const size_t offset = (size_t)json_integer_value(json_object_get(first, "byteOffset"));
        CHECK_INT(buffer, kind ? 0 : 2);
        CHECK_OK(document_buffer(back, buffer, &data, &size, &why), why);
        CHECK(size >= offset + 8 && memcmp(data + offset, "appended", 8) == 0);
        CHECK_OK(document_buffer(back, 1, &data, &size, &why), why);
        CHECK(size == 6 && memcmp(data, "second", 6) == 0);
        CHECK_OK(document_image(back, 0, &data, &size, &owned, &why), why);
        CHECK(size == 5 && memcmp(data, "image", 5) == 0);
        free(owned);
        CHECK_NEAR(json_real_value(json_object_get(back->root, "x")), 0.1, 0);
        document_destroy(&back);
    }
    write_text("other/second.bin", "other!");
    CHECK_OK(document_edit_begin(document, &edit, &why), why);
    CHECK(document_edit_save(document, &edit, in_folder("other/out2.gltf"), &why) == CRANNY_FAILED);
    CHECK(access(in_folder("other/out2.gltf"), F_OK) != 0);
    CHECK_OK(document_edit_save(document, &edit, in_folder("move/out.gltf"), &why), why);
    CHECK(document_edit_save(document, &edit, in_folder("nowhere/out.gltf"), &why) != CRANNY_OK);
    document_edit_free(&edit);
    document_destroy(&document);
}

static int round_trips;

static void round_trip(const char *path, void *user)
{
    struct document *before, *after = NULL;
    struct document_edit edit;
    char name[128];
    (void)user;
    why.message[0] = 0;
    if (document_load(path, false, 1u << 28, NULL, &before, &why) != CRANNY_OK) {
        CHECK_MSG(why.message[0] && !strchr(why.message, '\n'), "%s", path);
        return;
    }
    snprintf(name, sizeof name, "trip%d", round_trips++);
    make_folder(in_folder(name));
    snprintf(name + strlen(name), 32, "/out.%s", before->is_glb ? "glb" : "gltf");
    CHECK_OK(document_edit_begin(before, &edit, &why), why);
    CHECK_OK(document_edit_save(before, &edit, in_folder(name), &why), why);
    document_edit_free(&edit);
    CHECK_OK(document_load(in_folder(name), false, 1u << 28, NULL, &after, &why), why);
    CHECK_MSG(after && json_equal(before->root, after->root), "%s: JSON differs", path);
    char *old = json_dumps(before->root, JSON_COMPACT),
         *fresh = after ? json_dumps(after->root, JSON_COMPACT) : NULL;
    CHECK_MSG(fresh && strcmp(old, fresh) == 0, "%s: members in another order", path);
    free(old);
    free(fresh);
    for (size_t i = 0; after && i < before->buffer_count; i++) {
        const uint8_t *a, *b;
        size_t a_size, b_size;
        if (document_buffer(before, i, &a, &a_size, NULL) != CRANNY_OK)
            continue;
        const enum cranny_status status = document_buffer(after, i, &b, &b_size, &why);
        CHECK_MSG(status == CRANNY_OK && a_size <= b_size && memcmp(a, b, a_size) == 0,
                  "%s: buffer %zu", path, i);
    }
    document_destroy(&before);
    document_destroy(&after);
}

int main(void)
{
    folder = scratch_folder();
    if (!folder)
        return 1;
    test_json();
    test_glb();
    test_uris();
    test_data_uris();
    test_numbers();
    test_moving();
    if (check_scenes()) {
        walk_scenes("formats", round_trip, NULL);
        walk_scenes("variants_camp", round_trip, NULL);
        CHECK(round_trips > 400);
    }
    remove_folder(folder);
    free(folder);
    return check_end("document");
}
