/* cranny diff from outside: what it prints, its exit statuses, its map. */
#include "check.h"

#include <cranny/image.h>
#include <jansson.h>
#include <stdbool.h>
#include <sys/wait.h>
#include <unistd.h>

struct result {
    int exit;
    char out[4096], err[4096];
};

static void read_text(const char *path, char text[4096])
{
    FILE *file = fopen(path, "rb");
    size_t size = file ? fread(text, 1, 4095, file) : 0;
    text[size] = 0;
    if (file)
        fclose(file);
    unlink(path);
}

/* `arguments` as a shell would split them. */
static struct result run(const char *arguments)
{
    struct result result;
    char line[8192];
    snprintf(line, sizeof line, "'%s' diff %s >.out 2>.err", COMMAND, arguments);
    int status = system(line);
    result.exit = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    read_text(".out", result.out);
    read_text(".err", result.err);
    return result;
}

static void check_failure(const char *arguments, int expected, const char *part)
{
    struct result result = run(arguments);
    const char *end = strchr(result.err, '\n');
    CHECK_MSG(result.exit == expected, "%s: exit %d, expected %d: %s", arguments, result.exit,
              expected, result.err);
    CHECK_MSG(!*result.out, "%s: stdout: %s", arguments, result.out);
    CHECK_MSG(end && !end[1] && strncmp(result.err, "cranny: ", 8) == 0, "%s: stderr: %s",
              arguments, result.err);
    CHECK_MSG(strstr(result.err, part), "%s: no '%s' in: %s", arguments, part, result.err);
}

static void write_image(const char *path, int width, int height, const float *pixels)
{
    struct cranny_error why;
    CHECK_OK(cranny_image_write(path, CRANNY_IMAGE_VALUE, CRANNY_IMAGE_AUTO, width, height, 1,
                                pixels, 0, &why),
             why);
}

static double number_of(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    CHECK_MSG(json_is_number(value), "no number '%s'", key);
    return json_number_value(value);
}

static void test_json(void)
{
    struct result result = run("a.png b.pfm --json");
    CHECK_INT(result.exit, 0);
    CHECK(!*result.err);
    json_t *object = json_loads(result.out, 0, NULL);
    CHECK_MSG(object, "not JSON: %s", result.out);
    const double logs = log(256) - log(52);
    CHECK_NEAR(number_of(object, "error"),
               logs * logs / 4 + (pow(log(205), 2) / 2 + pow(log(205), 2) / 2) / 2, 1e-8);
    CHECK_NEAR(number_of(object, "rmse"), 0.4, 1e-7);
    CHECK_NEAR(number_of(object, "psnr"), -20 * log10(0.4), 1e-5);
    CHECK_NEAR(number_of(object, "max_abs"), 0.8, 1e-7);
    CHECK_NEAR(number_of(object, "mean"), -0.2, 1e-7);
    CHECK_INT(json_integer_value(json_object_get(object, "width")), 2);
    CHECK_INT(json_integer_value(json_object_get(object, "height")), 2);
    CHECK(strcmp(json_string_value(json_object_get(object, "a")), "a.png") == 0);
    CHECK(strcmp(json_string_value(json_object_get(object, "b")), "b.pfm") == 0);
    json_decref(object);
    result = run("b.pfm b.pfm --json");
    CHECK_INT(result.exit, 0);
    object = json_loads(result.out, 0, NULL);
    CHECK_NEAR(number_of(object, "error"), 0, 0);
    CHECK(json_is_null(json_object_get(object, "psnr")));
    json_decref(object);
}

static void test_text(void)
{
    struct result result = run("a.png b.pfm");
    CHECK_INT(result.exit, 0);
    CHECK_MSG(strstr(result.out, "rmse 0.40000") && strstr(result.out, "mean -0.20000"), "%s",
              result.out);
    result = run("a.png b.pfm -q");
    CHECK(result.exit == 0 && !*result.out && !*result.err);
    result = run("--help");
    CHECK(result.exit == 0 && strstr(result.out, "--fail-above E"));
}

static void test_threshold(void)
{
    CHECK_INT(run("a.png b.pfm --fail-above 100").exit, 0);
    CHECK_INT(run("b.pfm b.pfm --fail-above 0").exit, 0);
    check_failure("a.png b.pfm --fail-above 0.5 -q", 1, "above 0.5");
    struct result result = run("a.png b.pfm --fail-above=0.5 --json");
    CHECK_INT(result.exit, 1);
    json_t *object = json_loads(result.out, 0, NULL);
    CHECK(object && strstr(result.err, "above 0.5"));
    json_decref(object);
}

static void test_map(void)
{
    struct cranny_error why;
    struct cranny_image map;
    CHECK_INT(run("a.png b.pfm --map map.png --scale 1").exit, 0);
    CHECK_OK(cranny_image_read("map.png", CRANNY_IMAGE_COLOR, &map, &why), why);
    CHECK(map.width == 2 && map.height == 2);
    for (int i = 0; i < 12 && map.pixels; i++)
        CHECK_NEAR(map.pixels[i], i == 9 || i == 10 ? 0.2 : 1, 1.0 / 255);
    cranny_image_free(&map);
    CHECK(unlink("map.png") == 0);
    check_failure("a.png b.pfm --map map.jpg", 2, "map.jpg");
    check_failure("a.png b.pfm --map no/map.png", 1, "no/map.png");
    check_failure("a.png b.pfm --scale 0", 2, "--scale");
    check_failure("a.png b.pfm --scale 1.5", 2, "--scale");
    check_failure("a.png wide.pfm --map map.png", 3, "wide.pfm");
    CHECK(access("map.png", F_OK) != 0);
}

static void test_wrong(void)
{
    check_failure("", 2, "two images");
    check_failure("a.png", 2, "two images");
    check_failure("a.png b.pfm b.pfm", 2, "b.pfm");
    check_failure("a.png b.pfm --fail-above nan", 2, "--fail-above");
    check_failure("a.png b.pfm --fail-above=", 2, "--fail-above");
    check_failure("a.png b.pfm --mup x.png", 2, "--map");
    check_failure("a.png wide.pfm", 3, "2 x 2");
    check_failure("nowhere.png b.pfm --json", 3, "nowhere.png");
    check_failure("a.png junk.exr", 3, "junk.exr");
    check_failure("a.png .", 3, ".: ");
}

int main(void)
{
    char folder[] = "diff-XXXXXX";
    const float a[4] = {1, 1, 1, 0.2f}, b[4] = {1, 1, 1, 1}, wide[6] = {0};
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_image("a.png", 2, 2, a);
    write_image("b.pfm", 2, 2, b);
    write_image("wide.pfm", 3, 2, wide);
    FILE *junk = fopen("junk.exr", "wb");
    CHECK(junk && fputs("junk", junk) >= 0 && fclose(junk) == 0);
    test_json();
    test_text();
    test_threshold();
    test_map();
    test_wrong();
    CHECK(unlink("a.png") == 0 && unlink("b.pfm") == 0 && unlink("wide.pfm") == 0);
    CHECK(unlink("junk.exr") == 0 && chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("diff");
}
