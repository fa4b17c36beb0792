/* The command from outside: exit statuses, messages, files left behind, JSON, interruption. */
#include "command.h"

#include <jansson.h>
#include <stdint.h>

static void put_u32(FILE *file, uint32_t value)
{
    fwrite(&value, 4, 1, file);
}

static float bump(int x, int z)
{
    return (float)((x * 7 + z * 13) % 5) * 0.4f;
}

/* A bumpy square of side × side vertices, a metre apart. */
static void write_glb(const char *path, int side)
{
    uint32_t vertices = (uint32_t)(side * side),
             triangles = (uint32_t)(2 * (side - 1) * (side - 1));
    uint32_t split = vertices * 12, size = split + triangles * 12;
    char json[1024];
    int length = snprintf(
        json, sizeof json,
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0}],\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},"
        "\"indices\":1}]}],\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":%u,"
        "\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[%d,1.6,%d]},{\"bufferView\":1,"
        "\"componentType\":5125,\"count\":%u,\"type\":\"SCALAR\"}],\"bufferViews\":[{\"buffer\":0,"
        "\"byteLength\":%u},{\"buffer\":0,\"byteOffset\":%u,\"byteLength\":%u}],"
        "\"buffers\":[{\"byteLength\":%u}]}",
        vertices, side - 1, side - 1, triangles * 3, split, split, triangles * 12, size);
    while (length % 4)
        json[length++] = ' ';
    FILE *file = fopen(path, "wb");
    fwrite("glTF", 1, 4, file);
    put_u32(file, 2);
    put_u32(file, 12 + 8 + (uint32_t)length + 8 + size);
    put_u32(file, (uint32_t)length);
    fwrite("JSON", 1, 4, file);
    fwrite(json, 1, (size_t)length, file);
    put_u32(file, size);
    fwrite("BIN\0", 1, 4, file);
    for (int z = 0; z < side; z++)
        for (int x = 0; x < side; x++)
            fwrite((float[]){(float)x, bump(x, z), (float)z}, 4, 3, file);
    for (int z = 0; z + 1 < side; z++)
        for (int x = 0; x + 1 < side; x++) {
            uint32_t a = (uint32_t)(z * side + x), b = a + (uint32_t)side;
            fwrite((uint32_t[]){a, b, a + 1, a + 1, b, b + 1}, 4, 6, file);
        }
    fclose(file);
}

static void test_help(void)
{
    static const char *const commands[] = {"bake", "info", "check", "diff", "render"};
    struct result result = run("--help", NULL);
    CHECK_EXIT(result, 0);
    for (int i = 0; i < 5; i++)
        CHECK_TEXT(result.out, commands[i]);
    CHECK_INT(result.err_size, 0);
    done(&result);
    for (int i = 0; i < 5; i++) {
        result = run(commands[i], "--help", NULL);
        CHECK_EXIT(result, 0);
        CHECK_TEXT(result.out, "Examples:");
        done(&result);
    }
    result = run("bake", "--help", NULL);
    CHECK_TEXT(result.out, "--distance-long X");
    CHECK_TEXT(result.out, "least_squares|splat|vertex");
    CHECK_TEXT(result.out, "--ground[=HEIGHT]");
    done(&result);
    result = run("--version", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "cranny ");
    done(&result);
}

static void test_usage(void)
{
    check_failure(run(NULL), 2, "cranny --help");
    check_failure(run("bak", NULL), 2, "did you mean 'bake'");
    check_failure(run("zzzzzz", NULL), 2, "unknown command 'zzzzzz'");
    check_failure(run("grid.glb", NULL), 2, "cranny bake grid.glb");
    check_failure(run("bake", NULL), 2, "no scene given");
    check_failure(run("bake", "grid.glb", "--ray", "4", NULL), 2, "did you mean '--rays'");
    check_failure(run("bake", "grid.glb", "--distance-lnog=4", NULL), 2, "'--distance-long'");
    check_failure(run("bake", "grid.glb", "--set", "alhpa=1", NULL), 2, "'--alpha'");
    check_failure(run("bake", "grid.glb", "--qqqqqqq", NULL), 2, "'--qqqqqqq'");
    check_failure(run("bake", "grid.glb", "-z", NULL), 2, "'-z'");
    check_failure(run("bake", "grid.glb", "--rays", "0", NULL), 2, "--rays: 0 is out of range");
    check_failure(run("bake", "grid.glb", "--rays", NULL), 2, "--rays needs a value");
    check_failure(run("bake", "grid.glb", "--rays", "--json", NULL), 2, "--rays needs a value");
    check_failure(run("bake", "grid.glb", "--alpha=nan", NULL), 2, "--alpha");
    check_failure(run("bake", "grid.glb", "--fit", "best", NULL), 2, "least_squares");
    check_failure(run("bake", "grid.glb", "--to", "texture", NULL), 2, "occlusion, color");
    check_failure(run("bake", "grid.glb", "--raw", NULL), 2, "--to attribute");
    check_failure(run("bake", "grid.glb", "--ground=high", NULL), 2, "--ground");
    check_failure(run("bake", "grid.glb", "--preview-size", "10", NULL), 2, "WIDTHxHEIGHT");
    check_failure(run("bake", "grid.glb", "--memory-limit", "8Q", NULL), 2, "--memory-limit");
    check_failure(run("bake", "grid.glb", "--json=yes", NULL), 2, "takes no value");
    check_failure(run("bake", "grid.glb", "other.glb", NULL), 2, "other.glb");
    check_failure(run("bake", "grid.glb", "-o", "out.obj", NULL), 2, "out.obj");
    check_failure(run("bake", "grid.glb", "--preview", "out.jpg", NULL), 2, "out.jpg");
    check_failure(run("info", "grid.glb", "--rays", "4", NULL), 2, "--rays");
    check_failure(run("bake", "grid.glb", "--preview-camera", "0", NULL), 2, "--preview-camera");
}

static void test_input(void)
{
    static const char *const commands[] = {"bake", "info", "check"};
    size_t size;
    char *data = read_file("grid.glb", &size);
    write_file("cut.glb", data, size / 2);
    write_file("empty.glb", data, 0);
    free(data);
    for (int i = 0; i < 3; i++) {
        check_failure(run(commands[i], "nowhere.glb", NULL), 3, "nowhere.glb");
        check_failure(run(commands[i], "cut.glb", "--json", NULL), 3, "cut.glb");
        check_failure(run(commands[i], "empty.glb", NULL), 3, "empty.glb");
        check_failure(run(commands[i], ".", NULL), 3, ".: ");
        check_failure(run(commands[i], "grid.glb", "--scene", "4", NULL), 2, "grid.glb");
    }
    check_failure(run("bake", "missing/x.glb", NULL), 3, "missing/x.glb");
    check_failure(run("bake", "grid.glb", "--preset", "nowhere.json", NULL), 3, "nowhere.json");
    check_failure(run("bake", "grid.glb", "--memory-limit", "12K", NULL), 1, "grid.glb");
    unlink("cut.glb");
    unlink("empty.glb");
}

static const char *const keys[] = {"input",    "output",      "meshes",    "instances",
                                   "vertices", "triangles",   "samples",   "invalid_samples",
                                   "rays",     "mrays_per_s", "fit_rms",   "seconds",
                                   "bytes",    "warnings",    "parameters"};
static const char *const second_keys[] = {"load",  "bvh",   "sample", "trace",
                                          "solve", "write", "total"};

static void test_json(void)
{
    struct result result = run("bake", "grid.glb", "--json", "--rays=8", "--no-adaptive",
                               "--ground=-1.5", "--set", "contrast=0.3", NULL);
    CHECK_EXIT(result, 0);
    json_t *object = json_loadb(result.out, result.out_size, 0, NULL);
    CHECK_MSG(json_is_object(object), "stdout: %s", result.out);
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++)
        CHECK_MSG(json_object_get(object, keys[i]), "no key '%s'", keys[i]);
    for (size_t i = 0; i < sizeof second_keys / sizeof *second_keys; i++)
        CHECK_MSG(json_is_real(json_object_get(json_object_get(object, "seconds"), second_keys[i])),
                  "no key '%s'", second_keys[i]);
    CHECK(strcmp(json_string_value(json_object_get(object, "output")), "grid-ao.glb") == 0);
    CHECK_INT(json_integer_value(json_object_get(object, "triangles")), 2 * 15 * 15);
    CHECK_INT(json_integer_value(json_object_get(object, "vertices")), 16 * 16);
    json_int_t samples = json_integer_value(json_object_get(object, "samples"));
    json_int_t rays = json_integer_value(json_object_get(object, "rays"));
    CHECK_MSG(rays == 8 * samples && samples > 0, "%lld rays, %lld samples", (long long)rays,
              (long long)samples);
    json_t *parameters = json_object_get(object, "parameters");
    CHECK_INT(json_integer_value(json_object_get(parameters, "rays")), 8);
    CHECK(json_is_true(json_object_get(parameters, "ground")));
    CHECK_NEAR(json_number_value(json_object_get(parameters, "ground_height")), -1.5, 0);
    CHECK_NEAR(json_number_value(json_object_get(parameters, "contrast")), 0.3, 1e-12);
    CHECK(json_dump_file(parameters, "preset.json", 0) == 0);
    json_decref(object);
    done(&result);
    rename("grid-ao.glb", "first.glb");
    result = run("bake", "grid.glb", "-q", "--preset", "preset.json", NULL);
    CHECK_EXIT(result, 0);
    CHECK_INT(result.out_size + result.err_size, 0);
    CHECK(same_files("first.glb", "grid-ao.glb"));
    done(&result);
    unlink("first.glb");
    unlink("preset.json");
    unlink("grid-ao.glb");
}

static void test_info_check(void)
{
    struct result result = run("info", "grid.glb", "--json", NULL);
    CHECK_EXIT(result, 0);
    json_t *object = json_loadb(result.out, result.out_size, 0, NULL);
    CHECK_INT(json_integer_value(json_object_get(object, "triangles")), 2 * 15 * 15);
    json_t *corner = json_object_get(json_object_get(object, "bounds"), "max");
    CHECK_NEAR(json_number_value(json_array_get(corner, 0)), 15, 0);
    json_decref(object);
    done(&result);
    result = run("info", "grid.glb", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "450");
    done(&result);
    result = run("check", "grid.glb", "--json", NULL);
    CHECK_EXIT(result, 0);
    object = json_loadb(result.out, result.out_size, 0, NULL);
    CHECK(json_is_array(json_object_get(object, "findings")));
    CHECK_INT(json_integer_value(json_object_get(object, "errors")), 0);
    json_decref(object);
    done(&result);
    const char *empty = "{\"asset\":{\"version\":\"2.0\"}}";
    write_file("empty.gltf", empty, strlen(empty));
    result = run("check", "empty.gltf", NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "error: ");
    done(&result);
    check_failure(run("bake", "empty.gltf", NULL), 3, "triangle");
    unlink("empty.gltf");
}

static json_int_t role_instances(json_t *info, const char *role)
{
    json_t *roles = json_object_get(info, "roles");
    return json_integer_value(json_object_get(json_object_get(roles, role), "instances"));
}

static void test_roles(void)
{
    struct result result = run("info", "grid.glb", "--json", "--role", "shrub=nothing*", "--role",
                               "tree=*", "--role=grass=x", NULL);
    CHECK_EXIT(result, 0);
    json_t *object = json_loadb(result.out, result.out_size, 0, NULL);
    CHECK_INT(role_instances(object, "tree"), 1);
    CHECK_INT(role_instances(object, "solid"), 0);
    CHECK_INT(json_array_size(json_object_get(object, "warnings")), 2);
    CHECK_INT(json_integer_value(json_object_get(json_object_get(object, "lods"), "groups")), 0);
    json_decref(object);
    done(&result);
    result = run("info", "grid.glb", "--role", "ignored=*", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "role ignored 1 instances, 450 triangles");
    CHECK_TEXT(result.out, "triangles    0 (450 stored)");
    done(&result);
    check_failure(run("info", "grid.glb", "--role", "bush=*", NULL), 2, "'bush=*' is not ROLE=");
    check_failure(run("info", "grid.glb", "--role", "tree=", NULL), 2, "is not ROLE=");
    check_failure(run("info", "grid.glb", "--role", "tree", NULL), 2, "is not ROLE=");
    result = run("check", "grid.glb", "--role", "ignored=*", NULL);
    CHECK_EXIT(result, 3);
    CHECK_TEXT(result.out, "empty-scene");
    done(&result);
}

static void test_outputs(void)
{
    struct result result =
        run("bake", "grid.glb", "--preview", "view.png", "--preview-size", "64x48", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "grid-ao.glb");
    size_t size;
    char *png = read_file("view.png", &size);
    CHECK(size > 24 && memcmp(png, "\x89PNG", 4) == 0 && png[19] == 64 && png[23] == 48);
    free(png);
    done(&result);

    char *data = read_file("grid.glb", &size);
    write_file("same.glb", data, size);
    free(data);
    result = run("bake", "same.glb", "-o", "same.glb", NULL);
    CHECK_EXIT(result, 0);
    CHECK(same_files("same.glb", "grid-ao.glb"));
    done(&result);

    const char *obj = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
    write_file("corner.OBJ", obj, strlen(obj));
    result = run("bake", "corner.OBJ", NULL);
    CHECK_EXIT(result, 0);
    data = read_file("corner-ao.glb", &size);
    CHECK(size > 12 && memcmp(data, "glTF", 4) == 0);
    free(data);
    done(&result);
    result = run("info", "corner-ao.glb", "--json", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "\"triangles\": 2,");
    done(&result);
    const char *const made[] = {"view.png", "same.glb", "grid-ao.glb", "corner.OBJ",
                                "corner-ao.glb"};
    for (int i = 0; i < 5; i++)
        CHECK(unlink(made[i]) == 0);
}

/* The second bake takes all over, and says so. */
static void test_cache(void)
{
    struct result result = run("bake", "grid.glb", "-o", "kept.glb", "--cache", "kept", NULL);
    CHECK_INT(result.exit, 0);
    CHECK_TEXT(result.out, "everything baked anew: nothing was kept yet");
    done(&result);
    result =
        run("bake", "grid.glb", "-o", "kept.glb", "--cache", "kept", "--report", "kept.html", NULL);
    CHECK_INT(result.exit, 0);
    CHECK_TEXT(result.out, "0 changed; taken over: 100.00 % of the samples, 1 of 1 meshes");
    done(&result);
    result =
        run("bake", "grid.glb", "-o", "kept.glb", "--cache", "kept", "--rays", "9", "--json", NULL);
    CHECK_TEXT(result.out, "\"outcome\": \"parameters\"");
    CHECK_TEXT(result.out, "\"reused_samples\": 0");
    done(&result);
    result = run("bake", "grid.glb", "-o", "kept.glb", "--json", NULL);
    CHECK_TEXT(result.out, "\"cache\": null");
    done(&result);
    CHECK(unlink("kept.glb") == 0 && unlink("kept.html") == 0);
    CHECK_INT(system("rm -r kept"), 0);
}

/* The input is no scene: an exit of 1 shows that the folder was tried before anything was read. */
static void test_folders(void)
{
    write_file("junk.glb", "junk", 4);
    check_failure(run("bake", "junk.glb", "-o", "no/such/out.glb", NULL), 1, "no/such/out.glb");
    check_failure(run("bake", "junk.glb", "-o", "/proc/out.glb", NULL), 1, "/proc/out.glb");
    check_failure(run("bake", "junk.glb", "--preview", "no/a.png", NULL), 1, "no/a.png");
    mkdir("folder.glb", 0700);
    check_failure(run("bake", "junk.glb", "-o", "folder.glb", NULL), 1, "folder.glb");
    rmdir("folder.glb");
    check_failure(run("bake", "junk.glb", "--cache", "no/such", NULL), 1, "no/such");
    check_failure(run("bake", "junk.glb", "--cache", "/proc", NULL), 1, "/proc");
    check_failure(run("bake", "junk.glb", "--cache", "junk.glb", NULL), 1, "--cache");
    if (geteuid() != 0) {
        mkdir("closed", 0500);
        check_failure(run("bake", "junk.glb", "-o", "closed/a.glb", NULL), 1, "closed/a.glb");
        rmdir("closed");
    }
    unlink("junk.glb");
}

static void check_old_output(const char *before)
{
    char after[4096];
    size_t size;
    list_folder(after, sizeof after);
    CHECK_MSG(strcmp(before, after) == 0, "files before: %s, after: %s", before, after);
    char *old = read_file("grid-ao.glb", &size);
    CHECK(size == 3 && memcmp(old, "old", 3) == 0);
    free(old);
}

static void test_full_disk(void)
{
    char before[4096];
    write_file("grid-ao.glb", "old", 3);
    list_folder(before, sizeof before);
    check_failure(run_full("bake", "grid.glb", NULL), 1, "grid-ao.glb");
    check_old_output(before);
    char *args[] = {(char *)"cranny", (char *)"--help", NULL};
    int full = open("/dev/full", O_WRONLY);
    pid_t child = fork();
    if (!child) {
        dup2(full, 1);
        int err = open(".err", O_CREAT | O_TRUNC | O_WRONLY, 0600);
        dup2(err, 2);
        execv(COMMAND, args);
        _exit(127);
    }
    CHECK_INT(wait_exit(child), 1);
    close(full);
    size_t size;
    char *err = read_file(".err", &size);
    CHECK_TEXT(err, "standard output");
    free(err);
    unlink(".err");
}

static void test_interrupt(int number)
{
    char before[4096];
    write_file("grid-ao.glb", "old", 3);
    list_folder(before, sizeof before);
    char *args[] = {(char *)"cranny",
                    (char *)"bake",
                    (char *)"grid.glb",
                    (char *)"--rays=65536",
                    (char *)"--samples-per-face=256",
                    NULL};
    pid_t child = start(RLIM_INFINITY, -1, args);
    nanosleep(&(struct timespec){0, 700000000}, NULL);
    double sent_s = now_s();
    CHECK(waitpid(child, NULL, WNOHANG) == 0);
    kill(child, number);
    CHECK_INT(wait_exit(child), 130);
    CHECK_MSG(now_s() - sent_s < 5, "%.1f s to stop", now_s() - sent_s);
    size_t size;
    char *err = read_file(".err", &size);
    CHECK_TEXT(err, "cranny: interrupted");
    CHECK_INT(line_count(err), 1);
    free(err);
    unlink(".out");
    unlink(".err");
    check_old_output(before);
    unlink("grid-ao.glb");
}

static void test_same_bits(void)
{
    static const char *const threads[] = {"1", "2", "7", "2"};
    static const char *const names[] = {"t1.glb", "t2.glb", "t7.glb", "again.glb"};
    for (int i = 0; i < 4; i++) {
        struct result result = run("bake", "grid.glb", "--threads", threads[i], "-o", names[i],
                                   "--to", "attribute", "--raw", NULL);
        CHECK_EXIT(result, 0);
        done(&result);
        CHECK_MSG(same_files("t1.glb", names[i]), "%s differs from t1.glb", names[i]);
    }
    struct result result = run("bake", "grid.glb", "--seed", "5", "-o", "seed.glb", "--to",
                               "attribute", "--raw", NULL);
    CHECK_EXIT(result, 0);
    CHECK(!same_files("t1.glb", "seed.glb"));
    done(&result);
    for (int i = 0; i < 4; i++)
        unlink(names[i]);
    unlink("seed.glb");
}

/* On a terminal there is a progress line; it is gone at the end. */
static void test_terminal(void)
{
    int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0)
        return;
    int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    setenv("TERM", "xterm", 1);
    char *args[] = {(char *)"cranny", (char *)"bake", (char *)"grid.glb", (char *)"--rays=4096",
                    NULL};
    pid_t child = start(RLIM_INFINITY, slave, args);
    close(slave);
    char text[65536];
    size_t used = 0;
    for (ssize_t got = 1; got > 0 && used<sizeof text - 1; used += got> 0 ? (size_t)got : 0)
        got = read(master, text + used, sizeof text - 1 - used);
    text[used] = 0;
    close(master);
    CHECK_INT(wait_exit(child), 0);
    CHECK_TEXT(text, "trace");
    CHECK_TEXT(text, "Mrays/s");
    CHECK_MSG(used > 4 && strcmp(text + used - 4, "\r\x1b[K") == 0, "ends in: %s", text);
    unlink(".out");
    unlink("grid-ao.glb");
}

static void test_document(void)
{
    struct result result = run("--dump-parameters", NULL);
    size_t size;
    char *document = read_file(SOURCE_FOLDER "/docs/parameters.md", &size);
    CHECK_EXIT(result, 0);
    CHECK_MSG(size == result.out_size && memcmp(document, result.out, size) == 0,
              "docs/parameters.md is stale: cranny --dump-parameters > docs/parameters.md");
    free(document);
    done(&result);
}

int main(void)
{
    char folder[] = "cli-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_glb("grid.glb", 16);
    test_help();
    test_usage();
    test_input();
    test_json();
    test_info_check();
    test_roles();
    test_outputs();
    test_cache();
    test_folders();
    test_full_disk();
    test_same_bits();
    test_terminal();
    test_interrupt(SIGINT);
    test_interrupt(SIGTERM);
    test_document();
    char left[4096];
    list_folder(left, sizeof left);
    CHECK_MSG(strcmp(left, "/./../grid.glb") == 0, "left behind: %s", left);
    clear_folder();
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("cli");
}
