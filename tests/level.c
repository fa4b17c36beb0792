/* cranny-level and cranny-demo, run as programs: same bits, the counts they state, their manners.
 */
#include "check.h"

#include "base/base.h"

#include <cranny/cranny.h>
#include <dirent.h>
#include <fcntl.h>
#include <jansson.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

static char folder[] = "/tmp/cranny-test-level-XXXXXX";

/* `text` receives what went to stdout and stderr together. The exit status; -1: killed. */
static int run(const char *const *args, char *text, size_t text_size)
{
    int ends[2], status = -1;
    size_t used = 0;
    ssize_t got;
    if (pipe(ends))
        return -1;
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], 1);
        dup2(ends[1], 2);
        close(ends[0]);
        execv(args[0], (char *const *)args);
        _exit(127);
    }
    close(ends[1]);
    while ((got = read(ends[0], text + used, text_size - 1 - used)) > 0)
        used += (size_t)got;
    text[used] = 0;
    close(ends[0]);
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static const char *in_folder(const char *name, char path[256])
{
    snprintf(path, 256, "%s/%s", folder, name);
    return path;
}

static json_t *make(const char *scale, const char *seed, const char *path)
{
    static char text[65536];
    const char *args[] = {LEVEL_PROGRAM, "--scale", scale, "--seed", seed,
                          "--json",      "-o",      path,  NULL};
    CHECK_INT(run(args, text, sizeof text), 0);
    json_t *stated = json_loads(text, 0, NULL);
    CHECK_MSG(json_is_object(stated), "%s", text);
    return stated;
}

static json_int_t number(json_t *object, const char *key)
{
    return json_integer_value(json_object_get(object, key));
}

static void check_same_bits(void)
{
    char a[256], b[256], c[256];
    uint8_t *first = NULL, *second = NULL, *other = NULL;
    size_t sizes[3] = {0};
    json_decref(make("0.1", "7", in_folder("a.glb", a)));
    json_decref(make("0.1", "7", in_folder("b.glb", b)));
    json_decref(make("0.1", "8", in_folder("c.glb", c)));
    struct cranny_error why;
    CHECK_OK(file_read(a, 1u << 30, &first, &sizes[0], &why), why);
    CHECK_OK(file_read(b, 1u << 30, &second, &sizes[1], &why), why);
    CHECK_OK(file_read(c, 1u << 30, &other, &sizes[2], &why), why);
    CHECK(sizes[0] == sizes[1] && memcmp(first, second, sizes[0]) == 0);
    CHECK(sizes[0] != sizes[2] || memcmp(first, other, sizes[0]) != 0);
    free(first);
    free(second);
    free(other);
}

static void check_names(const struct cranny_scene *scene)
{
    bool tree = false, shrub = false, lod = false, mirrored = false;
    for (uint32_t i = 0; i < cranny_scene_instance_count(scene); i++) {
        const struct cranny_instance *instance = cranny_scene_instance(scene, i);
        const double *m = instance->world_from_object;
        tree = tree || strncmp(instance->name, "Tree_", 5) == 0;
        shrub = shrub || strncmp(instance->name, "Shrub_", 6) == 0;
        lod = lod || strstr(instance->name, "_LOD");
        mirrored = mirrored || m[0] * (m[5] * m[10] - m[6] * m[9]) -
                                       m[1] * (m[4] * m[10] - m[6] * m[8]) +
                                       m[2] * (m[4] * m[9] - m[5] * m[8]) <
                                   0;
    }
    CHECK(tree && shrub && mirrored);
    CHECK(!lod);
}

/* Everything stands on the terrain's block and nothing is lost: bounds as designed. */
static void check_scene(const char *path, json_t *stated)
{
    struct cranny_scene *scene = NULL;
    struct cranny_error why;
    struct cranny_scene_info info;
    CHECK_OK(cranny_scene_load(path, NULL, &scene, &why), why);
    if (!scene)
        return;
    cranny_scene_get_info(scene, &info);
    CHECK_INT(info.triangles, number(stated, "triangles"));
    CHECK_INT(info.vertices, number(stated, "vertices"));
    CHECK_INT(info.unique_triangles, number(stated, "unique_triangles"));
    CHECK_INT(info.unique_vertices, number(stated, "unique_vertices"));
    CHECK_INT(info.cameras, number(stated, "cameras"));
    CHECK(info.masked_triangles > 0 && info.masked_triangles < info.triangles);
    CHECK_INT(info.double_sided_triangles, info.masked_triangles);
    CHECK_NEAR(info.bounds[1], -6, 1e-6);
    CHECK_MSG(info.bounds[4] > 8 && info.bounds[4] < 60, "top at %g", info.bounds[4]);
    CHECK_MSG(info.bounds[0] > -85 && info.bounds[3] < 85, "%g to %g", info.bounds[0],
              info.bounds[3]);
    check_names(scene);
    cranny_scene_destroy(&scene);
}

static void check_scales(void)
{
    static const char *const scales[] = {"0.01", "0.3", "1", "60"};
    json_int_t last = 0;
    char path[256];
    in_folder("scale.glb", path);
    for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
        json_t *stated = make(scales[i], "1", path);
        json_int_t triangles = number(stated, "triangles");
        CHECK_MSG(triangles > last, "%lld at scale %s", (long long)triangles, scales[i]);
        last = triangles;
        if (i < 3)
            check_scene(path, stated);
        if (i == 0)
            CHECK_MSG(triangles < 20000, "%lld", (long long)triangles);
        if (i == 2) {
            CHECK_MSG(triangles > 150000 && triangles < 320000, "%lld", (long long)triangles);
            CHECK(number(stated, "trees") >= 200 && number(stated, "shrubs") >= 1500);
        }
        json_decref(stated);
    }
    CHECK_MSG(last > 10000000, "%lld", (long long)last);
}

static int lines(const char *text)
{
    int count = 0;
    for (; *text; text++)
        count += *text == '\n';
    return count;
}

static void check_manners(void)
{
    static char text[65536];
    const char *cases[][6] = {
        {LEVEL_PROGRAM},
        {LEVEL_PROGRAM, "--scale", "0", "-o", "x.glb"},
        {LEVEL_PROGRAM, "--scale", "nan", "-o", "x.glb"},
        {LEVEL_PROGRAM, "--seed", "-1", "-o", "x.glb"},
        {LEVEL_PROGRAM, "--colour", "-o", "x.glb"},
        {LEVEL_PROGRAM, "-o"},
        {DEMO_PROGRAM},
        {DEMO_PROGRAM, "a.glb"},
        {DEMO_PROGRAM, "a.glb", "b.glb", "-o", "x"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        CHECK_INT(run(cases[i], text, sizeof text), 2);
        CHECK_MSG(lines(text) == 1, "%s", text);
    }
    const char *unwritable[] = {LEVEL_PROGRAM, "--scale", "0.01", "-o", "/nowhere/level.glb", NULL};
    CHECK_INT(run(unwritable, text, sizeof text), 1);
    CHECK_MSG(lines(text) == 1 && strstr(text, "/nowhere/level.glb"), "%s", text);
    const char *missing[] = {DEMO_PROGRAM, "/nowhere/scene.glb", "-o", folder, NULL};
    CHECK_INT(run(missing, text, sizeof text), 3);
    const char *helps[][3] = {{LEVEL_PROGRAM, "--help"}, {DEMO_PROGRAM, "--help"}};
    for (int i = 0; i < 2; i++) {
        CHECK_INT(run(helps[i], text, sizeof text), 0);
        CHECK(strstr(text, "example:"));
    }
}

static const char *const methods[] = {"ssao", "hbao", "crease", "alchemy", "volumes"};

static void check_picture(const char *format, const char *word)
{
    char name[64], file[256];
    struct stat info;
    snprintf(name, sizeof name, format, word);
    CHECK_MSG(stat(in_folder(name, file), &info) == 0 && info.st_size > 1000, "%s", name);
}

/* A row of the table: milliseconds and an error above 0, and a shift within what visibility has. */
static void check_scores(const char *html, const char *method)
{
    char begin[64];
    double milliseconds = -1, error = -1, shift = -2;
    snprintf(begin, sizeof begin, "<th scope=\"row\">%s</th><td>", method);
    const char *row = strstr(html, begin);
    CHECK_MSG(row != NULL, "%s", method);
    if (!row)
        return;
    const int got = sscanf(row + strlen(begin), "%lf ms</td><td>%lf</td><td>%lf</td>",
                           &milliseconds, &error, &shift);
    CHECK_INT(got, 3);
    CHECK_MSG(milliseconds > 0 && milliseconds < 60000, "%s %g ms", method, milliseconds);
    CHECK_MSG(error > 0 && error < 30, "%s error %g", method, error);
    CHECK_MSG(shift > -1 && shift < 1, "%s shift %g", method, shift);
}

static void check_frame(const char *html)
{
    CHECK(strstr(html, "<h2 id=\"frame\">"));
    CHECK(strstr(html, "--method raytrace --rays 8 -o frame-truth.png"));
    CHECK(!strstr(html, "nan") && !strstr(html, "inf "));
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        char command[64];
        snprintf(command, sizeof command, "--method %s -o frame-%s.png", methods[i], methods[i]);
        CHECK_MSG(strstr(html, command) != NULL, "%s", command);
        check_scores(html, methods[i]);
        check_picture("page/frame-%s.png", methods[i]);
        check_picture("page/frame-%s-map.png", methods[i]);
    }
    check_picture("page/frame-%s.png", "truth");
    check_picture("page/frame-%s.png", "lit");
    check_picture("page/frame-%s.png", "open");
}

static void check_page(void)
{
    static char text[65536];
    char level[256], page[256], file[256];
    uint8_t *html = NULL;
    size_t size;
    struct cranny_error why;
    struct stat info;
    json_decref(make("0.01", "1", in_folder("<&>.glb", level)));
    const char *args[] = {DEMO_PROGRAM, level, "-o",      in_folder("page", page),
                          "--rays",     "8",   "--quiet", NULL};
    CHECK_INT(run(args, text, sizeof text), 0);
    CHECK_MSG(text[0] == 0, "%s", text);
    CHECK_OK(file_read(in_folder("page/index.html", file), 1u << 24, &html, &size, &why), why);
    CHECK(html && strstr((char *)html, "&lt;&amp;>-ao.glb"));
    CHECK(html && !strstr((char *)html, "http:") && !strstr((char *)html, "https:"));
    if (html)
        check_frame((char *)html);
    free(html);
    for (int i = 1; i <= 3; i++) {
        char name[32];
        snprintf(name, sizeof name, "page/before-%d.png", i);
        CHECK(stat(in_folder(name, file), &info) == 0 && info.st_size > 1000);
        snprintf(name, sizeof name, "page/after-%d.png", i);
        CHECK(stat(in_folder(name, file), &info) == 0 && info.st_size > 1000);
    }
    CHECK(stat(in_folder("page/<&>-ao.glb", file), &info) == 0 && info.st_size > 1000);
}

/* A scene of one wall: nothing is near anything, and the page says so. */
static void check_bare_page(void)
{
    static const char wall[] = "v 0 0 0\nv 4 0 0\nv 4 3 0\nv 0 3 0\nf 1 2 3 4\n";
    static char text[65536];
    char scene[256], page[256], file[256];
    uint8_t *html = NULL;
    size_t size;
    struct cranny_error why;
    CHECK_OK(cranny_file_write(in_folder("wall.obj", scene), wall, sizeof wall - 1, &why), why);
    const char *args[] = {DEMO_PROGRAM, scene, "-o",      in_folder("bare", page),
                          "--rays",     "2",   "--quiet", NULL};
    CHECK_INT(run(args, text, sizeof text), 0);
    CHECK_OK(file_read(in_folder("bare/index.html", file), 1u << 24, &html, &size, &why), why);
    CHECK(html && strstr((char *)html, "<h2 id=\"frame\">"));
    CHECK(html && strstr((char *)html, "Left out:") && !strstr((char *)html, "frame-truth"));
    free(html);
}

static void empty(const char *path)
{
    DIR *directory = opendir(path);
    const struct dirent *entry;
    char file[600];
    while (directory && (entry = readdir(directory))) {
        snprintf(file, sizeof file, "%s/%s", path, entry->d_name);
        unlink(file);
    }
    if (directory)
        closedir(directory);
    rmdir(path);
}

static void clean(void)
{
    char path[256];
    empty(in_folder("page", path));
    empty(in_folder("bare", path));
    empty(folder);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    check_same_bits();
    check_scales();
    check_manners();
    check_page();
    check_bare_page();
    clean();
    return check_end("level");
}
