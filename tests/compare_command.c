/* cranny compare from outside: results, pictures, the cache, and what is left behind. */
#include "render_files.h"

#include <cranny/screen.h>

/* Rays at two counts, two presets of every method, volumes at three rates of samples. */
enum { TRIALS = 2 + 2 * (CRANNY_METHOD_COUNT + 1) + 3 };

static const char hostile[] = "a <b>'\"&$(x);.gltf";

static void remove_tree(const char *path)
{
    char line[512];
    snprintf(line, sizeof line, "rm -rf -- '%s'", path);
    CHECK_INT(system(line), 0);
}

/* What a folder holds, all levels, sorted. */
static char *tree_of(const char *path)
{
    char line[512];
    size_t size;
    snprintf(line, sizeof line, "find '%s' | sort >.out 2>/dev/null", path);
    CHECK(system(line) >= 0);
    char *text = read_file(".out", &size);
    unlink(".out");
    return text;
}

/* All are refused before anything is made. */
static void test_usage(void)
{
    static const struct {
        const char *part, *arguments[7];
    } cases[] = {
        {"-o: name a folder", {"--size", "8x8"}},
        {"--methods: 'sao' is none of: ssao", {"-o", "out", "--methods", "ssao,sao"}},
        {"--radius: '0' is not a number above 0", {"-o", "out", "--radius", "0"}},
        {"--rays", {"-o", "out", "--rays", "0"}},
        {"than the truth's 1 ", {"-o", "out", "--rays", "1", "--methods", "raytrace"}},
        {"--camera and --view", {"-o", "out", "--camera", "0", "--view", "1"}},
        {"--view and --views", {"-o", "out", "--view", "0", "--views", "2"}},
        {"--eye needs --target", {"-o", "out", "--eye", "1,2,3"}},
        {"--fov and --ortho", {"-o", "out", "--fov", "60", "--ortho", "2"}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *const *a = cases[i].arguments;
        check_failure(run("compare", "view.gltf", a[0], a[1], a[2], a[3], a[4], a[5], a[6], NULL),
                      2, cases[i].part);
    }
    check_failure(run("compare", "-o", "out", NULL), 2, "no scene given");
    check_failure(run("compare", "view.gltf", "-o", "out", "--view", "7", NULL), 2,
                  "--view: '7' is neither EYE:TARGET");
    CHECK(access("out", F_OK) != 0);
}

/* The input is no scene: an exit of 1 shows that the folder was tried before anything was read. */
static void test_folders(void)
{
    write_file("junk.glb", "junk", 4);
    check_failure(run("compare", "junk.glb", "-o", "no/out", NULL), 1, "no/out");
    check_failure(run("compare", "junk.glb", "-o", "junk.glb", NULL), 1, "junk.glb: cannot be");
    if (geteuid() != 0) {
        mkdir("closed", 0500);
        check_failure(run("compare", "junk.glb", "-o", "closed", NULL), 1, "closed");
        rmdir("closed");
    }
    check_failure(run("compare", "junk.glb", "-o", "out", NULL), 3, "junk.glb");
    struct result result = run("compare", "junk.glb", "nowhere.glb", "-o", "out", NULL);
    CHECK_EXIT(result, 3);
    CHECK_INT(line_count(result.err), 2);
    done(&result);
    CHECK(access("out", F_OK) != 0);
    unlink("junk.glb");
}

static json_t *compare_small(const char *scene, const char *folder)
{
    struct result result = run("compare", scene, "-o", folder, "--size", "48x36", "--rays", "64",
                               "--repeat", "2", "--json", NULL);
    return take_json(&result, 0);
}

static void check_trial(const json_t *trial)
{
    static const char *const texts[] = {"name",  "preset",    "device",
                                        "image", "error_map", "command"};
    static const char *const numbers[] = {"milliseconds", "error", "rmse",         "mean",
                                          "max_abs",      "runs",  "setup_seconds"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        CHECK(*text_of(trial, texts[i]));
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++)
        number_of(trial, numbers[i]);
    CHECK(number_of(trial, "milliseconds") > 0);
    CHECK(number_of(trial, "error") >= 0 && number_of(trial, "rmse") <= 1);
    const json_t *parameters = json_object_get(trial, "parameters");
    CHECK(strcmp(text_of(parameters, "method"), text_of(trial, "name")) == 0);
    CHECK((number_of(trial, "setup_seconds") > 0) == !strcmp(text_of(trial, "name"), "volumes"));
    char path[300];
    snprintf(path, sizeof path, "out/%s", text_of(trial, "image"));
    CHECK_MSG(access(path, F_OK) == 0, "no %s", path);
    snprintf(path, sizeof path, "out/%s", text_of(trial, "error_map"));
    CHECK_MSG(access(path, F_OK) == 0, "no %s", path);
}

static void check_view(const json_t *view)
{
    const json_t *reference = json_object_get(view, "reference"), *trial;
    const json_t *methods = json_object_get(view, "methods");
    size_t i;
    CHECK(strcmp(text_of(view, "scene"), hostile) == 0);
    CHECK_INT(number_of(view, "width"), 48);
    CHECK_INT(number_of(view, "height"), 36);
    CHECK_NEAR(number_of(view, "radius_world"), 0.5, 0);
    CHECK_INT(number_of(reference, "rays"), 64);
    CHECK(number_of(reference, "seconds") > 0);
    CHECK(json_is_false(json_object_get(reference, "cached")));
    CHECK(number_of(json_object_get(reference, "standard_error"), "mean") > 0);
    CHECK_INT(json_array_size(methods), TRIALS);
    json_array_foreach(methods, i, trial) check_trial(trial);
}

/* Runs a command of the results in this folder. */
static void repeat_command(const char *command)
{
    char line[4096];
    CHECK_MSG(strncmp(command, "cranny ", 7) == 0, "%s", command);
    snprintf(line, sizeof line, "'%s' %s -q >.out 2>.err", COMMAND, command + 7);
    CHECK_MSG(system(line) == 0, "%s", line);
    unlink(".out");
    unlink(".err");
}

static const char *after_slash(const char *path)
{
    return strrchr(path, '/') + 1;
}

static void check_same_picture(const char *image)
{
    char kept[300];
    snprintf(kept, sizeof kept, "out/%s", image);
    CHECK_MSG(same_files(kept, after_slash(image)), "%s is another picture", image);
}

/* The commands make the same pictures, and diff finds the same errors. */
static void check_commands(const json_t *view)
{
    const json_t *reference = json_object_get(view, "reference"), *trial;
    const char *truth = text_of(reference, "image");
    size_t i;
    repeat_command(text_of(reference, "command"));
    check_same_picture(truth);
    json_array_foreach(json_object_get(view, "methods"), i, trial)
    {
        const char *image = text_of(trial, "image");
        repeat_command(text_of(trial, "command"));
        check_same_picture(image);
        struct result result = run("diff", after_slash(image), after_slash(truth), "--json", NULL);
        json_t *object = take_json(&result, 0);
        CHECK_NEAR(number_of(object, "error"), number_of(trial, "error"), 1e-6);
        CHECK_NEAR(number_of(object, "rmse"), number_of(trial, "rmse"), 1.0 / 255);
        json_decref(object);
        unlink(after_slash(image));
    }
    unlink(after_slash(truth));
}

static void check_page(void)
{
    size_t size;
    char *page = read_file("out/index.html", &size);
    CHECK_TEXT(page, "<!doctype html>");
    CHECK_TEXT(page, "a &lt;b&gt;'&quot;&amp;$(x);.gltf");
    CHECK(!strstr(page, "<b>'"));
    CHECK(!strstr(page, "http:") && !strstr(page, "https:"));
    CHECK(!strstr(page, "nan") && !strstr(page, "-nan"));
    CHECK_TEXT(page, "; once a scene: ");
    CHECK_TEXT(page, "</html>");
    /* Rays and volumes, in the plots of two views and of their mean. */
    int series = 0;
    for (const char *at = page; (at = strstr(at, "class=\"series\"")); at++)
        series++;
    CHECK_INT(series, 6);
    free(page);
}

/* What differs between two runs by right. */
static void strip_times(json_t *results)
{
    static const char *const facts[] = {"seconds", "trace_seconds", "cached"};
    json_t *view, *trial;
    size_t v, t;
    json_object_del(results, "command");
    json_array_foreach(json_object_get(results, "views"), v, view)
    {
        for (int i = 0; i < 3; i++)
            json_object_del(json_object_get(view, "reference"), facts[i]);
        json_array_foreach(json_object_get(view, "methods"), t, trial)
        {
            json_object_del(trial, "milliseconds");
            json_object_del(trial, "runs");
            json_object_del(trial, "setup_seconds");
        }
    }
}

static void check_second_run(json_t *first)
{
    char *before = tree_of("out");
    CHECK(rename("out/images", "images") == 0);
    json_t *second = compare_small(hostile, "out"), *view;
    size_t v;
    json_array_foreach(json_object_get(second, "views"), v, view)
    {
        const json_t *reference = json_object_get(view, "reference");
        CHECK(json_is_true(json_object_get(reference, "cached")));
        CHECK(number_of(reference, "trace_seconds") > 0);
    }
    char *after = tree_of("out");
    CHECK_MSG(strcmp(before, after) == 0, "before: %s after: %s", before, after);
    CHECK_INT(system("diff -r images out/images >/dev/null"), 0);
    strip_times(first);
    strip_times(second);
    CHECK(json_equal(first, second));
    json_decref(second);
    remove_tree("images");
    free(before);
    free(after);
}

static void test_results(void)
{
    static const char *const keys[] = {"version", "machine", "views", "failures", "warnings", NULL};
    write_scene(hostile);
    json_t *results = compare_small(hostile, "out"), *view;
    json_t *file = json_load_file("out/results.json", 0, NULL);
    size_t v;
    check_keys(results, keys);
    CHECK(json_equal(results, file));
    CHECK_INT(json_array_size(json_object_get(results, "views")), 2);
    json_array_foreach(json_object_get(results, "views"), v, view) check_view(view);
    check_commands(json_array_get(json_object_get(results, "views"), 0));
    check_page();
    check_second_run(results);
    json_decref(results);
    json_decref(file);
    remove_tree("out");
    unlink(hostile);
}

static double truth_is_kept(const char *option, const char *value)
{
    struct result result = run("compare", "view.gltf", "-o", "out", "--cache", "truths", "--camera",
                               "0", "--size", "32x24", "--rays", "16", "--methods", "ssao",
                               "--repeat", "1", "--json", option, value, NULL);
    json_t *results = take_json(&result, 0);
    const json_t *view = json_array_get(json_object_get(results, "views"), 0);
    const bool kept = json_is_true(json_object_get(json_object_get(view, "reference"), "cached"));
    CHECK_INT(json_array_size(json_object_get(view, "methods")), 2);
    json_decref(results);
    return kept;
}

/* A truth is found again for what it shows, and for nothing else. */
static void test_cache(void)
{
    CHECK(!truth_is_kept("--threads", "1"));
    CHECK(truth_is_kept("--threads", "2"));
    CHECK(truth_is_kept("--guard", "9"));
    CHECK(!truth_is_kept("--radius", "0.25"));
    CHECK(!truth_is_kept("--fov", "50"));
    CHECK(!truth_is_kept("--msaa", "2"));
    CHECK(!truth_is_kept("--rays", "17"));
    CHECK(!truth_is_kept("--size", "32x25"));
    CHECK_INT(system("for f in truths/*.pfm; do printf x >\"$f\"; done"), 0);
    CHECK(!truth_is_kept("--threads", "1"));
    CHECK(truth_is_kept("--threads", "1"));
    remove_tree("out");
    remove_tree("truths");
}

/* Views and radii are for the scene before them; a broken scene does not stop the others. */
static void test_several_scenes(void)
{
    write_file("junk.glb", "junk", 4);
    CHECK(system("cp view.gltf other.gltf") == 0);
    struct result result = run("compare", "--size", "16x12", "--rays", "4", "--methods", "ssao",
                               "--repeat", "1", "--json", "--radius", "0.75", "-o", "out",
                               "view.gltf", "--view", "near=1.2,1.1,5:1.2,1.1,0:40", "--view",
                               "front", "junk.glb", "other.gltf", "--radius", "0.25", NULL);
    CHECK_TEXT(result.err, "cranny: junk.glb");
    json_t *results = take_json(&result, 3), *views = json_object_get(results, "views");
    CHECK_INT(json_array_size(views), 4);
    CHECK_INT(json_array_size(json_object_get(results, "failures")), 1);
    CHECK(strcmp(text_of(json_array_get(views, 0), "camera"), "near") == 0);
    CHECK(strcmp(text_of(json_array_get(views, 1), "camera"), "front") == 0);
    CHECK_NEAR(number_of(json_array_get(views, 1), "radius_world"), 0.75, 0);
    CHECK_NEAR(number_of(json_array_get(views, 2), "radius_world"), 0.25, 0);
    json_decref(results);
    size_t size;
    char *page = read_file("out/index.html", &size);
    CHECK_TEXT(page, "Not shown: ");
    free(page);
    result = run("compare", "other.gltf", "-o", "out", "--size", "16x12", "--rays", "4",
                 "--methods", "ssao", "--views", "3", "--json", NULL);
    results = take_json(&result, 0);
    CHECK_INT(json_array_size(json_object_get(results, "views")), 3);
    json_decref(results);
    remove_tree("out");
    unlink("junk.glb");
    unlink("other.gltf");
}

static json_t *compare_row(const json_t *results, size_t index)
{
    const json_t *view = json_array_get(json_object_get(results, "views"), 0);
    return json_array_get(json_object_get(view, "methods"), index);
}

static json_t *compare_presets(const char *methods, const char *first, const char *second)
{
    struct result result =
        run("compare", "view.gltf", "-o", "out", "--camera", "0", "--size", "48x36", "--rays", "4",
            "--repeat", "1", "--cache", "truths", "--json", "--methods", methods, "--preset", first,
            second ? "--preset" : NULL, second, NULL);
    return take_json(&result, 0);
}

/* A row for each file, after those of the methods; its command makes its picture. */
static void test_presets(void)
{
    const char soft[] = "{\"method\": \"volumes\", \"intensity\": 0.5, \"quads\": false}";
    const char thin[] = "{\"method\": \"hbao\", \"radius_world\": 7}";
    write_file("soft.json", soft, sizeof soft - 1);
    CHECK(mkdir("my presets", 0700) == 0);
    write_file("my presets/thin & <b>.json", thin, sizeof thin - 1);
    json_t *results = compare_presets("volumes", "soft.json", "my presets/thin & <b>.json");
    CHECK_INT(json_array_size(
                  json_object_get(json_array_get(json_object_get(results, "views"), 0), "methods")),
              7);
    const json_t *row = compare_row(results, 5), *other = compare_row(results, 6);
    CHECK(strcmp(text_of(row, "name"), "volumes") == 0);
    CHECK(strcmp(text_of(row, "preset"), "soft") == 0);
    CHECK_NEAR(number_of(json_object_get(row, "parameters"), "intensity"), 0.5, 0);
    CHECK(json_is_false(json_object_get(json_object_get(row, "parameters"), "quads")));
    CHECK(number_of(row, "mean") > number_of(compare_row(results, 0), "mean"));
    CHECK(strcmp(text_of(other, "name"), "hbao") == 0);
    CHECK(strcmp(text_of(other, "preset"), "thin & <b>") == 0);
    CHECK(!strcmp(text_of(other, "image"), "images/001-view-hbao-file2-thin----b-.png"));
    CHECK_NEAR(number_of(json_object_get(other, "parameters"), "radius_world"), 0.5, 0);
    check_commands(json_array_get(json_object_get(results, "views"), 0));
    json_decref(results);
    remove_tree("my presets");
    remove_tree("out");
}

static void test_refused_presets(void)
{
    static const struct {
        const char *text, *part;
        int exit;
    } cases[] = {
        {"{\"intensity\": 1}", "does not say whose preset it is", 3},
        {"{\"method\": \"ssa\"}", "no method 'ssa'", 3},
        {"{\"method\": \"volumes\", \"samples\": 4}", "samples: no such parameter", 3},
        {"{\"method\": \"volumes\", \"spacing\": 99}", "spacing: 99 is out of range", 3},
        {"[1]", "does not say whose", 3},
        {"{", "line 1", 3},
        {"", "line 1", 3},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_file("bad.json", cases[i].text, strlen(cases[i].text));
        check_failure(run("compare", "view.gltf", "-o", "out", "--preset", "bad.json", NULL),
                      cases[i].exit, cases[i].part);
    }
    CHECK(rename("soft.json", "paper.json") == 0);
    check_failure(run("compare", "view.gltf", "-o", "out", "--preset", "paper.json", NULL), 2,
                  "there is a row 'volumes paper'");
    check_failure(run("compare", "view.gltf", "-o", "out", "--preset", "nowhere.json", NULL), 3,
                  "nowhere.json");
    CHECK(access("out", F_OK) != 0);
    unlink("bad.json");
    unlink("paper.json");
}

/* Of an earlier run's pictures those go that the new one lacks; other files stay, and so does
 * everything when the list of the earlier run is not to be read, or names what it cannot have made.
 */
static void test_stale_pictures(void)
{
    static const char *const lists[] = {
        "junk",
        "{\"views\": [{\"reference\": {\"image\": \"images/001/../../../keep.png\"}, \"methods\": "
        "[{\"image\": \"images/mine.png\", \"error_map\": 7}, 3, {}]}, []]}",
        "{\"views\": {\"a\": 1}}",
        "[]",
    };
    json_decref(compare_presets("ssao,volumes", "soft.json", NULL));
    write_file("out/images/mine.png", "mine", 4);
    write_file("out/images/001-mine.png", "mine", 4);
    write_file("keep.png", "mine", 4);
    CHECK(mkdir("out/images/001", 0700) == 0);
    CHECK(access("out/images/001-view-volumes-1-25.png", F_OK) == 0);
    json_decref(compare_presets("ssao", "soft.json", NULL));
    CHECK(access("out/images/001-view-volumes-1-25.png", F_OK) != 0);
    CHECK(access("out/images/001-view-volumes-1-25-error.png", F_OK) != 0);
    char *before = tree_of("out");
    for (size_t i = 0; i < sizeof lists / sizeof *lists; i++) {
        write_file("out/results.json", lists[i], strlen(lists[i]));
        json_decref(compare_presets("ssao", "soft.json", NULL));
        char *after = tree_of("out");
        CHECK_MSG(strcmp(before, after) == 0, "before: %s after: %s", before, after);
        free(after);
    }
    CHECK_TEXT(before, "images/mine.png");
    CHECK_TEXT(before, "images/001-mine.png");
    CHECK_TEXT(before, "images/001-view-truth.png");
    CHECK_TEXT(before, "images/001-view-volumes-file1-soft.png");
    CHECK(unlink("keep.png") == 0);
    free(before);
    remove_tree("out");
    remove_tree("truths");
}

static void check_text_is(const char *path, const char *expected)
{
    size_t size;
    char *text = read_file(path, &size);
    CHECK_MSG(strcmp(text, expected) == 0, "%s: %s", path, text);
    free(text);
}

static void interrupt(const char *option, const char *value, const char *words)
{
    char *args[] = {(char *)"cranny",    (char *)"compare",
                    (char *)"view.gltf", (char *)"--size",
                    (char *)"320x240",   (char *)"-o",
                    (char *)"out",       (char *)"--camera",
                    (char *)"0",         (char *)"--repeat",
                    (char *)"1000",      (char *)option,
                    (char *)value,       NULL};
    check_interrupt(args, 900, words);
}

static void test_interrupt(void)
{
    static const char nothing[] = "cranny: interrupted; nothing was written";
    interrupt("--rays", "65536", nothing);
    CHECK(access("out", F_OK) != 0);
    CHECK_RUN("compare", "view.gltf", "-q", "-o", "out", "--camera", "0", "--size", "320x240",
              "--rays", "8", "--repeat", "1", "--methods", "ssao");
    remove_tree("out/cache");
    write_file("out/index.html", "old", 3);
    interrupt("--rays", "8", "cranny: interrupted; only out/cache was written");
    check_text_is("out/index.html", "old");
    remove_tree("out");
    CHECK(mkdir("out", 0700) == 0 && mkdir("out/images", 0700) == 0);
    write_file("out/index.html", "old", 3);
    write_file("out/images/mine.png", "old", 3);
    char *before = tree_of("out");
    interrupt("--rays", "65536", nothing);
    char *after = tree_of("out");
    CHECK_MSG(strcmp(before, after) == 0, "before: %s after: %s", before, after);
    check_text_is("out/index.html", "old");
    struct result result = run_full("compare", "view.gltf", "-o", "out", "--rays", "4", "--repeat",
                                    "1", "--methods", "ssao", "--cache", "truths", NULL);
    check_failure(result, 1, "cannot");
    free(after);
    after = tree_of("out");
    CHECK_MSG(strcmp(before, after) == 0, "before: %s after: %s", before, after);
    check_text_is("out/index.html", "old");
    free(before);
    free(after);
    remove_tree("out");
    remove_tree("truths");
}

static void test_help(void)
{
    struct result result = run("compare", "--help", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--view [NAME=]EYE:TARGET[:FOV]|CAMERA");
    CHECK_TEXT(result.out, "the others go on");
    done(&result);
    result = run("compare", "view.gltf", "-q", "-o", "out", "--size", "8x8", "--rays", "1",
                 "--methods", "hbao", NULL);
    CHECK_EXIT(result, 0);
    CHECK_INT(result.out_size + result.err_size, 0);
    done(&result);
    remove_tree("out");
}

int main(void)
{
    char folder[] = "compare-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_scene("view.gltf");
    test_usage();
    test_folders();
    test_help();
    test_results();
    test_cache();
    test_several_scenes();
    test_presets();
    test_stale_pictures();
    test_refused_presets();
    test_interrupt();
    char left[4096];
    list_folder(left, sizeof left);
    CHECK_MSG(strcmp(left, "/./../view.gltf") == 0, "left behind: %s", left);
    clear_folder();
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("compare_command");
}
