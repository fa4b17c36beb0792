/* cranny tune from outside: what it finds, what it writes, what it refuses, what it leaves behind.
 */
#include "render_files.h"

/* Picture, truth and options that fit in a blink. */
#define SMALL "--size", "64x48", "--rays", "64", "--cache", "truths"

static json_t *fit(const char *method, const char *option, const char *value, const char *option_2,
                   const char *value_2)
{
    struct result result =
        run("tune", "view.gltf", SMALL, "--view", "0", "--view", "side=3,2,3:0.3,0.3,0.3", "--json",
            "-q", "--method", method, option, value, option_2, value_2, NULL);
    return take_json(&result, 0);
}

static double cost_of(const json_t *result, const char *set, const char *when)
{
    return number_of(json_object_get(json_object_get(result, set), when), "cost");
}

/* All are refused before anything is read: there is no such scene. */
static void test_usage(void)
{
    static const struct {
        const char *part, *arguments[6];
    } cases[] = {
        {"--method: name the method", {"-q"}},
        {"'hba' is none of: ssao", {"--method", "hba"}},
        {"raytrace: is the truth", {"--method", "raytrace"}},
        {"preset.txt: -o takes", {"--method", "hbao", "-o", "preset.txt"}},
        {"no parameter 'intensty'; did you mean 'intensity'?",
         {"--method", "hbao", "--fit", "intensty"}},
        {"intensity is named twice", {"--method", "hbao", "--fit", "intensity,intensity"}},
        {"radius_world is no matter", {"--method", "hbao", "--fit", "radius-world"}},
        {"quads is no matter", {"--method", "volumes", "--fit", "quads"}},
        {"no parameter ''", {"--method", "hbao", "--fit", ""}},
        {"--evaluations", {"--method", "hbao", "--evaluations", "0"}},
        {"--held-out", {"--method", "hbao", "--held-out", "some"}},
        {"--radius: '0' is not", {"--method", "hbao", "--radius", "0"}},
        {"--camera and --view", {"--method", "hbao", "--camera", "0", "--view", "1"}},
        {"out of range", {"--method", "hbao", "--intensity", "-3"}},
        {"is no file and none of", {"--method", "hbao", "--preset", "best"}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *const *a = cases[i].arguments;
        check_failure(run("tune", "nowhere.glb", a[0], a[1], a[2], a[3], a[4], a[5], NULL), 2,
                      cases[i].part);
    }
    check_failure(run("tune", "--method", "ssao", NULL), 2, "no scene given");
    check_failure(run("tune", "nowhere.glb", "--method", "ssao", NULL), 3, "nowhere.glb");
    check_failure(run("tune", "nowhere.glb", "--method", "ssao", "-o", "no/a.json", NULL), 1,
                  "no/a.json");
    struct result result =
        run("tune", "nowhere.glb", "--method", "ssao", "--intensity", "1", "--contrast", "1",
            "--bias", "0", "--radius-scale", "1", "--thickness", "1", NULL);
    check_failure(result, 2, "sets all that is fitted");
}

static void check_result(const json_t *result)
{
    static const char *const keys[] = {"method",   "output",     "evaluations", "converged",
                                       "flat",     "fitted",     "fit",         "held_out",
                                       "views",    "parameters", "rays",        "seconds",
                                       "warnings", "width",      "height",      NULL};
    const json_t *row, *parameters = json_object_get(result, "parameters");
    size_t i;
    check_keys(result, keys);
    CHECK(cost_of(result, "fit", "after") <= cost_of(result, "fit", "before"));
    CHECK_INT(json_array_size(json_object_get(result, "views")), 2);
    json_array_foreach(json_object_get(result, "fitted"), i, row) CHECK(json_equal(
        json_object_get(parameters, text_of(row, "name")), json_object_get(row, "after")));
    CHECK(!json_object_get(parameters, "radius_world") && !json_object_get(parameters, "threads") &&
          !json_object_get(parameters, "isa") && !json_object_get(parameters, "seed"));
}

/* From constants that are far off: they come back near enough to be much better on both sets. */
static void test_fit(void)
{
    static const char *const wanted[] = {"radius_scale", "intensity", "contrast", "angle_bias"};
    json_t *result = fit("hbao", "--preset", "wrong.json", "-o", "found.json");
    check_result(result);
    const json_t *fitted = json_object_get(result, "fitted");
    CHECK_INT(json_array_size(fitted), 4);
    for (size_t i = 0; i < 4; i++)
        CHECK(strcmp(text_of(json_array_get(fitted, i), "name"), wanted[i]) == 0);
    CHECK(cost_of(result, "fit", "after") < 0.6 * cost_of(result, "fit", "before"));
    CHECK(cost_of(result, "held_out", "after") < 0.8 * cost_of(result, "held_out", "before"));
    CHECK(json_is_true(json_object_get(result, "converged")));
    json_t *file = json_load_file("found.json", 0, NULL);
    CHECK(json_equal(file, json_object_get(result, "parameters")));
    json_decref(file);
    json_decref(result);
}

/* What was written is what render, compare and tune read, and it gives the error that was said. */
static void test_preset(void)
{
    json_t *again = fit("hbao", "--preset", "found.json", "--evaluations", "1");
    CHECK_INT(number_of(again, "evaluations"), 1);
    CHECK_NEAR(cost_of(again, "fit", "before"), cost_of(again, "fit", "after"), 0);
    const json_t *view = json_array_get(json_object_get(again, "views"), 0);
    CHECK(json_is_true(json_object_get(view, "cached")));
    struct result result =
        run("compare", "view.gltf", SMALL, "-o", "out", "--methods", "raytrace", "--preset",
            "found.json", "--camera", "0", "--repeat", "1", "--json", NULL);
    json_t *compared = take_json(&result, 0), *row, *found = NULL;
    size_t i;
    json_array_foreach(
        json_object_get(json_array_get(json_object_get(compared, "views"), 0), "methods"), i,
        row) if (strcmp(text_of(row, "preset"), "found") == 0) found = row;
    CHECK(found);
    CHECK_NEAR(number_of(found, "rmse"), number_of(json_object_get(view, "after"), "rmse"), 1e-9);
    CHECK_NEAR(number_of(found, "error"), number_of(json_object_get(view, "after"), "error"), 1e-9);
    CHECK_RUN("render", "view.gltf", "--size", "32x24", "--method", "hbao", "--preset",
              "found.json", "-o", "a.png", "-q");
    check_failure(run("render", "view.gltf", "--method", "ssao", "--preset", "found.json", NULL), 3,
                  "found.json");
    json_decref(compared);
    json_decref(again);
    CHECK_INT(system("rm -rf out a.png"), 0);
}

static void test_threads(void)
{
    static const char *const others[][2] = {
        {"--threads", "1"}, {"--threads", "3"}, {"--cpu-mask", "portable"}};
    size_t size;
    for (int i = 0; i < 3; i++) {
        char name[] = "a.json";
        name[0] = (char)('a' + i);
        json_decref(fit("ssao", "-o", name, others[i][0], others[i][1]));
    }
    char *text = read_file("a.json", &size);
    CHECK_TEXT(text, "\"method\": \"ssao\"");
    free(text);
    CHECK(same_files("a.json", "b.json") && same_files("a.json", "c.json"));
    CHECK_INT(system("rm a.json b.json c.json"), 0);
}

/* What the command line sets stays; what --fit names is fitted all the same, whatever its type. */
static void test_what_is_fitted(void)
{
    json_t *result = fit("volumes", "--set", "intensity=1.2", "--evaluations", "5");
    const json_t *row;
    size_t i;
    json_array_foreach(json_object_get(result, "fitted"), i, row)
        CHECK(strcmp(text_of(row, "name"), "intensity") != 0);
    CHECK_NEAR(number_of(json_object_get(result, "parameters"), "intensity"), 1.2, 0);
    CHECK_INT(number_of(result, "evaluations"), 5);
    CHECK(json_is_false(json_object_get(result, "converged")));
    json_decref(result);
    result = fit("volumes", "--fit", "combine,knee", "--combine", "product");
    CHECK_INT(json_array_size(json_object_get(result, "fitted")), 2);
    CHECK(strcmp(text_of(json_object_get(result, "parameters"), "combine"), "product") != 0);
    json_decref(result);
}

static size_t held_count(const json_t *result)
{
    const json_t *view;
    size_t i, count = 0;
    json_array_foreach(json_object_get(result, "views"), i, view) count +=
        json_is_true(json_object_get(view, "held_out"));
    return count;
}

static void test_held_out(void)
{
    static const struct {
        const char *option, *value, *hold;
        size_t views, held;
    } cases[] = {
        {"--views", "5", "alternate", 5, 2}, {"--views", "5", "rest", 5, 4},
        {"--views", "5", "none", 5, 0},      {"--camera", "0", "alternate", 2, 1},
        {"--camera", "plan", "rest", 2, 1},  {"--camera", "0", "none", 1, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct result run_result =
            run("tune", "view.gltf", "--size", "32x24", "--rays", "4", "--json", "-q", "--method",
                "ssao", "--evaluations", "1", "--held-out", cases[i].hold, cases[i].option,
                cases[i].value, NULL);
        json_t *result = take_json(&run_result, 0);
        CHECK_INT(json_array_size(json_object_get(result, "views")), cases[i].views);
        CHECK_INT(held_count(result), cases[i].held);
        CHECK_INT(number_of(json_object_get(result, "held_out"), "views"), cases[i].held);
        json_decref(result);
    }
}

/* Views and radii are for the scene before them, and scenes count alike. */
static void test_several_scenes(void)
{
    CHECK(system("cp view.gltf other.gltf") == 0);
    struct result run_result =
        run("tune", "--radius", "0.75", "view.gltf", "--view", "0", "--view", "1", "--view",
            "a=1.2,1.1,5:1.2,1.1,0", "other.gltf", "--radius", "0.25", "--size", "32x24", "--rays",
            "4", "--json", "-q", "--method", "crease", "--evaluations", "1", NULL);
    json_t *result = take_json(&run_result, 0), *views = json_object_get(result, "views");
    CHECK_INT(json_array_size(views), 5);
    CHECK_NEAR(number_of(json_array_get(views, 2), "radius_world"), 0.75, 0);
    CHECK_NEAR(number_of(json_array_get(views, 3), "radius_world"), 0.25, 0);
    const json_t *fitted = json_object_get(result, "fit"),
                 *scenes = json_object_get(fitted, "scenes");
    CHECK_INT(json_array_size(scenes), 2);
    double sum = 0;
    for (size_t i = 0; i < 2; i++)
        sum += number_of(json_object_get(json_array_get(scenes, i), "before"), "rmse") / 2;
    CHECK_NEAR(number_of(json_object_get(fitted, "before"), "rmse"), sum, 1e-9);
    json_decref(result);
    check_failure(run("tune", "view.gltf", "junk.glb", "--method", "ssao", SMALL, NULL), 3,
                  "junk.glb");
    unlink("other.gltf");
}

static void test_text(void)
{
    struct result result =
        run("tune", "view.gltf", SMALL, "--method", "hbao", "-o", "a.json", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "a.json: hbao, fitted to 1 view, judged by 1");
    CHECK_TEXT(result.out, "held out");
    CHECK_TEXT(result.out, "view.gltf (1)");
    CHECK_TEXT(result.out, "angle_bias");
    done(&result);
    result = run("tune", "view.gltf", SMALL, "--method", "hbao", "-q", NULL);
    CHECK_INT(result.out_size + result.err_size, 0);
    CHECK_EXIT(result, 0);
    done(&result);
    result = run("tune", "--help", "--method", "volumes", NULL);
    CHECK_EXIT(result, 0);
    CHECK_TEXT(result.out, "--delta-scale");
    CHECK_TEXT(result.out, "--held-out alternate|rest|none");
    done(&result);
    result = run("tune", "view.gltf", SMALL, "--method", "hbao", "-v", NULL);
    CHECK_TEXT(result.err, "cranny: fit 1: cost");
    CHECK_TEXT(result.err, "(best so far)");
    done(&result);
    unlink("a.json");
}

static void check_kept(const char *expected)
{
    size_t size;
    char *text = read_file("a.json", &size);
    CHECK_MSG(strcmp(text, expected) == 0, "a.json: %s", text);
    free(text);
}

/* An interrupted fit leaves the old preset, a full disk, too. */
static void test_interrupt(void)
{
    char *args[] = {(char *)"cranny",  (char *)"tune",     (char *)"view.gltf", (char *)"--size",
                    (char *)"640x480", (char *)"--rays",   (char *)"1",         (char *)"-o",
                    (char *)"a.json",  (char *)"--method", (char *)"raymarch",  NULL};
    write_file("a.json", "old", 3);
    check_interrupt(args, 900, "cranny: interrupted; nothing was written");
    check_kept("old");
    struct result result = run_full("tune", "view.gltf", "--size", "64x48", "--rays", "4",
                                    "--method", "hbao", "--cache", "other", "-o", "a.json", NULL);
    check_failure(result, 1, "cannot");
    check_kept("old");
    unlink("a.json");
    CHECK_INT(system("rm -rf other"), 0);
}

int main(void)
{
    static const char wrong[] =
        "{\"method\": \"hbao\", \"intensity\": 0.4, \"contrast\": 0.6, \"angle_bias\": 30}";
    char folder[] = "tune-XXXXXX";
    CHECK(mkdtemp(folder) && chdir(folder) == 0);
    write_scene("view.gltf");
    test_usage();
    write_file("wrong.json", wrong, sizeof wrong - 1);
    test_fit();
    test_preset();
    test_threads();
    test_what_is_fitted();
    test_held_out();
    test_several_scenes();
    test_text();
    test_interrupt();
    unlink("wrong.json");
    unlink("found.json");
    CHECK_INT(system("rm -rf truths"), 0);
    char left[4096];
    list_folder(left, sizeof left);
    CHECK_MSG(strcmp(left, "/./../view.gltf") == 0, "left behind: %s", left);
    clear_folder();
    CHECK(chdir("..") == 0 && rmdir(folder) == 0);
    return check_end("tune_command");
}
